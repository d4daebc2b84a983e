"""Made-up surveys of features for the inference: rows with drift and effects, plain formulas."""

from dataclasses import replace

import gap_study
import numpy as np

from mlscorr.collocation import Covariance
from mlscorr.gap.evidence import SETTINGS, weigh_labels
from mlscorr.gap.evidence.decision import decide, learned
from mlscorr.gap.evidence.labels import joint_score
from mlscorr.gap.signatures import Bench


def surveyed(g, seed, *effects, kind="sines", outside=None):
    "Rows of a survey with drift from no covariance function, and effects at finite size"
    rng = np.random.default_rng(seed)
    residual = gap_study.errors(g, rng, kind)
    for effect in effects:
        change = Bench(g.rows, g.survey).change(effect, rng)
        residual += change.shift + np.log1p(change.growth)
    if outside is not None:
        residual += outside
    return replace(g.rows, residual=residual)


def named(rows, g, signs, replicas=0):
    "Verdict on rows"
    rng = np.random.default_rng(0)
    evidence = weigh_labels(rows, g.background, g.survey, signs, rng, replicas)
    joint, evidence = joint_score(rows, g.survey, signs, evidence)
    return decide(evidence, learned().probabilities(joint))


def dense(g, model):
    "V of all metric rows, written out"
    rows = g.rows
    m = len(g.rows)
    bg = g.background
    tau = model.time * g.background.correlation_time
    lag = np.subtract.outer(bg.gps_time, bg.gps_time)
    smooth = Covariance(model.family, tau)
    anew = smooth(np.subtract.outer(bg.clock, bg.clock))
    if model.increased:
        growth = np.array([*model.increased, 1.0])[bg.increased]
    else:
        growth = 1.0
    position = np.reshape(growth, (-1, 1)) * bg.position
    legs = model.scale**2 * anew * (position @ position.T)
    scale, family, time = model.attitude
    turned = Covariance(family, time * g.background.correlation_time)(lag)
    legs += scale**2 * turned * (bg.attitude @ bg.attitude.T)
    first = np.arange(len(bg.row)) < rows.metric.sum()
    place = np.where(first[:, None], rows.partials[bg.row, :3], rows.partials_2[bg.row, :3])
    legs += (
        model.fixes**2
        * Covariance("exponential", SETTINGS.fix_correlation_time)(lag)
        * (place @ place.T)
    )
    sums = np.zeros((m, len(bg.row)))
    sums[bg.row, np.arange(len(bg.row))] = 1.0
    design = rows.survey_design().toarray()
    v = sums @ legs @ sums.T + design @ design.T + model.noise**2 * np.diag(rows.noise)
    return v[np.ix_(rows.metric, rows.metric)]
