"""Further unknowns beside trend and signals: what they are is what the full solution says."""

import numpy as np
import pytest

from mlscorr.estimate import estimate_correction, tie_factor
from mlscorr.estimate.added_unknowns import AddedUnknowns
from tests.beds.tied_passes import tied_passes


@pytest.fixture(scope="module")
def tied():
    "Adjustment of control and ties, and parameters"
    survey = tied_passes(1, number=60)
    alone = estimate_correction(survey.trajectory, survey.matched)
    adjustment = alone.adjustment
    return adjustment.with_factor(tie_factor(adjustment.errors, survey.ties)), alone.parameters


def columns_of(adjustment, seed):
    "Two columns at random"
    rows = sum(factor.misclosure.size for factor in adjustment.observing)
    return np.random.default_rng(seed).standard_normal((rows, 2))


def test_what_was_added_to_the_misclosures_is_found(tied):
    "Columns times known sizes of centimetres, within three sigmas, and highly significant"
    adjustment, parameters = tied
    columns = columns_of(adjustment, 1)
    sizes = np.array([0.03, -0.02])
    changed = adjustment.with_added(columns @ sizes)
    added = AddedUnknowns.of(changed, parameters, columns, np.ones(2))
    assert (np.abs(added.correction - sizes) < 3 * added.sigma).all()
    assert (added.sigma < 0.002).all()  # m
    assert added.statistic > 10 * added.critical
    assert added.is_wrong(np.array([0.005, 0.025])).tolist() == [True, False]


def test_the_response_is_what_the_trend_takes_of_a_unit(tied):
    "The trend without the unknowns differs by response times size from that of clean misclosures"
    adjustment, parameters = tied
    columns = columns_of(adjustment, 2)
    sizes = np.array([0.03, -0.02])
    added = AddedUnknowns.of(adjustment, parameters, columns, np.ones(2))
    changed = adjustment.with_added(columns @ sizes)
    before, after = (each.solve(parameters).trend for each in (adjustment, changed))
    assert np.abs(after - before - added.response @ sizes).max() < 1e-9  # m


def test_nothing_added_is_chance(tied):
    "Columns at random explain no more than chance does"
    adjustment, parameters = tied
    added = AddedUnknowns.of(adjustment, parameters, columns_of(adjustment, 3), np.ones(2))
    assert added.statistic < added.critical
    assert not added.is_wrong(np.zeros(2)).any()
