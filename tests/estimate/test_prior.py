"""Priors of correlation times and scales follow from the drive."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import position_adjustment, position_prior
from mlscorr.estimate.adjustment import NO_TREND
from mlscorr.estimate.posterior import NAMES, SPLIT, mounting_prior
from mlscorr.survey import Pos
from tests.beds.pos_errors import CONSTANT, EPOCHS, Case, even, outage_case

STEADY = "steady"
PERFECT = "perfect"
GROWING = "growing"


def equations_of(kind, pos=None, n=5, prior=position_prior):
    "Of a drive without sigmas, with steady ones, all zero, or with those of an outage"
    if kind == GROWING:
        case = outage_case(1, n)
    else:
        if kind == STEADY:
            sigma = np.full((len(EPOCHS), 3), 0.02)
        elif kind == PERFECT:
            sigma = np.zeros((len(EPOCHS), 3))
        else:
            sigma = None
        case = Case(EPOCHS, CONSTANT, even(n), np.random.default_rng(1), sigma)
    return position_adjustment(case.recorded, case.matched, pos or Pos(), 0, prior)


def start(prior, name):
    "A parameter's start value"
    return float(np.exp(prior.start[NAMES.index(name)]))


def spread(prior, name):
    "One sigma of a parameter's logarithm, None where it is fixed"
    free = [NAMES[i] for i in prior.free]
    if name in free:
        return prior.spread[free.index(name)]
    return None


@pytest.mark.parametrize("n", [3, 5, 9])
def test_drift_is_correlated_over_four_control_intervals(n):
    "The paper's rule where the POS states its sigmas: 4 times 194 s over n - 1"
    prior = position_prior(equations_of(STEADY, n=n))
    interval = 194.0 / (n - 1)
    assert start(prior, "drift_time") == pytest.approx(4.0 * interval, rel=1e-6)
    assert start(prior, "bias_time") == pytest.approx(4.0 * interval, rel=1e-6)


@pytest.mark.parametrize("interval", [40.0, 2.0])
def test_noise_of_gnss_lasts_seconds_where_sigma_shows_what_grows(interval):
    "3 s however far apart control points are, one interval where they are closer; else an interval"
    times = 3.0 + interval * np.arange(5)
    growing = outage_case(1, 5).recorded.position_sigma
    for sigma, expected in ((growing, min(interval, 3.0)), (np.full_like(growing, 0.02), interval)):
        case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(1), sigma)
        adjustment = position_adjustment(case.recorded, case.matched, Pos(), 0, position_prior)
        assert start(position_prior(adjustment), "jitter_time") == pytest.approx(expected)


def test_without_sigmas_the_believed_time_holds():
    "17 s where survey.toml says so, whatever the interval of the control points"
    prior = position_prior(equations_of(None, Pos(correlation_time=17.0)))
    assert start(prior, "drift_time") == pytest.approx(17.0)
    prior = mounting_prior(equations_of(STEADY, Pos(correlation_time=17.0)))
    assert start(prior, "drift_time") == pytest.approx(17.0)


def test_the_attitude_follows_the_drift_in_a_correction_alone():
    "Its time is free about 120 s in a calibration, where targets tell of the gyros"
    correction = position_prior(equations_of(None))
    calibration = mounting_prior(equations_of(None))
    assert correction.attitude_follows and spread(correction, "attitude_time") is None
    assert not calibration.attitude_follows
    assert start(calibration, "attitude_time") == pytest.approx(120.0)
    assert spread(calibration, "attitude_time") == pytest.approx(np.log(3.0))


@pytest.mark.parametrize("kind", [None, STEADY, GROWING, PERFECT])
def test_jitter_and_bias_are_free_where_sigma_has_two_parts(kind):
    "A sigma without a part that GNSS holds has drift alone, and its four parameters stay"
    adjustment = equations_of(kind)
    free = {NAMES[i] for i in position_prior(adjustment).free}
    is_split = bool(np.any(adjustment.errors.epochs.gnss))
    assert (set(SPLIT) <= free) == is_split and (not set(SPLIT) & free) == (not is_split)
    assert is_split == (kind != PERFECT)


def test_scales_are_ten_and_times_two_or_three():
    "One sigma: factor 10 on scales of position, 2 on drift time and attitude, 3 on other times"
    prior = mounting_prior(equations_of(GROWING))
    factors = {NAMES[i]: np.exp(own) for i, own in zip(prior.free, prior.spread, strict=True)}
    scales = ("drift_scale", "walk_scale", "jitter_scale", "bias_scale")
    assert factors == pytest.approx(
        {
            **dict.fromkeys(scales, 10.0),
            **dict.fromkeys(("jitter_time", "bias_time", "attitude_time", "trend_sigma"), 3.0),
            **dict.fromkeys(("drift_time", "attitude_scale"), 2.0),
        }
    )


def test_what_sigma_is_raised_by_at_once_has_a_scale_of_its_own():
    "A solution of 0.3 m for 60 s may be better than that, by ten; what grows gently needs none"
    sigma = np.where((EPOCHS > 60.0) & (EPOCHS < 120.0), 0.3, 0.02)[:, None] * np.ones(3)
    case = Case(EPOCHS, CONSTANT, even(5), np.random.default_rng(1), sigma)
    raised = position_adjustment(case.recorded, case.matched, Pos(), 0, position_prior)
    assert np.exp(spread(position_prior(raised), "level_scale")) == pytest.approx(10.0)
    assert spread(position_prior(equations_of(GROWING)), "level_scale") is None


def test_what_is_stated_is_believed_first():
    "All scales start at one but that of the random walk beside an integrated drift, at a tenth"
    prior = position_prior(equations_of(GROWING))
    for name in ("drift_scale", "jitter_scale", "bias_scale", "attitude_scale"):
        assert start(prior, name) == pytest.approx(1.0)
    assert start(prior, "walk_scale") == pytest.approx(0.1)
    assert len(prior.spread) == len(prior.free)


def test_a_trend_is_believed_to_be_of_a_decimetre_or_of_none():
    "Its coefficients' sigma starts at 0.1 m; without any coefficient it is no parameter"
    adjustment = equations_of(GROWING)
    assert start(position_prior(adjustment), "trend_sigma") == pytest.approx(0.1)  # m
    assert spread(position_prior(replace(adjustment, order=NO_TREND)), "trend_sigma") is None
