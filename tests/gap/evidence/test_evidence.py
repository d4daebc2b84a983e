"""Evidence of effects against plain formulas."""

import numpy as np
import pytest

from mlscorr.effects import EFFECTS, make_effect
from mlscorr.gap.evidence import (
    SETTINGS,
    ErrorModel,
    Observations,
    column_table,
    error_models,
    unknown_blocks,
)
from mlscorr.gap.evidence.evidence import block_gain, suited_models, weigh_blocks, without_known
from mlscorr.gap.evidence.observations import STATED, relevant_models
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures
from tests.gap.inference import surveyed


def test_evidence_is_the_likelihood_with_the_amplitudes_integrated():
    "Closed form against the normal density of covariance I + s^2 A A^T, averaged over s"
    rng = np.random.default_rng(3)
    sizes = SETTINGS.amplitudes
    a = 30 * rng.standard_normal((50, 3))
    r = rng.standard_normal(50) * 3
    gain = block_gain((a.T @ a)[None], (a.T @ r)[None, :, None], sizes)[0, 0]
    each = []
    for s in sizes:
        v = np.eye(50) + s**2 * a @ a.T
        each.append(-0.5 * (np.linalg.slogdet(v)[1] + r @ np.linalg.solve(v, r) - r @ r))
    assert gain == pytest.approx(np.logaddexp.reduce(each) - np.log(len(sizes)))


def test_without_the_drift_in_the_covariance_a_clean_survey_alarms(with_surface):
    "White residuals and nothing else: some effect explains the drift of any survey"
    g, signs = with_surface
    rows = surveyed(g, 20)
    observed = Observations.of(g.rows, g.background)
    columns = column_table(rows, signs, (), observed.sigma)
    residual = observed.columns(rows.residual[:, None])
    white = weigh_blocks(observed, [ErrorModel(scale=1e-3)], residual, columns)
    assert white.gain.max() > 20
    assert weigh_blocks(observed, error_models(), residual, columns).gain.max() < 8


def test_the_order_of_rows_and_the_zero_of_time_do_not_matter(with_surface):
    "Rows shuffled give the same evidence"
    g, signs = with_surface
    rows = surveyed(g, 39, make_effect("range_bias", magnitude=0.01))
    order = np.random.default_rng(0).permutation(len(rows))
    mixed = rows.select(order)
    effects = [kind for kind in EFFECTS if kind.name in ("range_bias", "time_offset", "lever_arm")]
    gains = []
    for some in (rows, mixed):
        signs, _ = signatures(some, g.survey, effects)
        observed = Observations.of(some, background(some, g.survey))
        columns = column_table(some, signs, (), observed.sigma)
        residual = observed.columns(some.residual[:, None])
        gains.append(weigh_blocks(observed, [STATED], residual, columns).gain[:, 0])
    assert np.allclose(*gains, rtol=1e-6)


def test_an_unknown_error_that_a_known_effect_makes_is_not_unknown(with_surface):
    "A range error in proportion to the range is range_scale, as long as that is in the library"
    g, signs = with_surface
    unknown = unknown_blocks(g.rows, g.survey)
    observed = Observations.of(g.rows, g.background)
    leads = []
    for library in (signs, tuple(s for s in signs if s.name != "range_scale")):
        kept = without_known(observed, column_table(g.rows, library, unknown, observed.sigma))
        members = {block.member for block in kept.blocks if block.label == "unknown"}
        leads.append({unknown[i].hint for i in members})
    assert leads[1] - leads[0] == {"range error in proportion to the range"}


def test_models_suit_what_acts_and_what_does_not(with_surface):
    "A mounting turned by 0.1 deg makes the POS look worse than it is; a calm one is kept for it"
    g, signs = with_surface
    rows = surveyed(g, 36, make_effect("boresight", magnitude=[0.1, 0.0, 0.1]))
    observations = Observations.of(rows, g.background)
    residual = observations.columns(rows.residual[:, None])
    table = column_table(rows, signs, (), observations.sigma)
    alone = relevant_models(observations, error_models(), residual, [residual[:, :0]])
    suited = suited_models(observations, table, error_models(), residual)
    assert min(model.scale for model in alone) >= 1.0
    assert min(model.scale for model in suited) < 1.0
