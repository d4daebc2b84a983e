"""Sizes by the innovations of all folds but one."""

import numpy as np
import pytest

from mlscorr.gap.closure.folds import CrossFit, cross_fitted
from mlscorr.gap.evidence import SETTINGS
from mlscorr.gap.evidence.observations import STATED


@pytest.fixture
def case():
    "300 innovations of 5 folds and two columns of sizes 0.2 and -0.1 m"
    rng = np.random.default_rng(5)
    columns = 30 * rng.standard_normal((300, 2))
    fold = np.arange(300) % 5
    return CrossFit(columns, fold, 5), columns @ [0.2, -0.1] + rng.standard_normal(300)


def test_a_size_knows_nothing_of_the_fold_that_judges_it(case):
    "Innovations of one fold that are wrong by a thousand leave its size, and spoil all others'"
    cross, residual = case
    wrong = residual + 1000.0 * (cross.fold == 2)
    before, after = (cross.sizes(values[:, None])[:, :, 0] for values in (residual, wrong))
    np.testing.assert_array_equal(before[2], after[2])
    assert (np.abs(after - before)[[0, 1, 3, 4, 5]].max(axis=1) > 0.1).all()


def test_sizes_are_found_to_what_the_noise_lets(case):
    "0.2 and -0.1 m within four of their sigmas, 1 / (30 sqrt(240)) m, in each fold"
    cross, residual = case
    sizes = cross.sizes(residual[:, None])[:, :, 0]
    assert sizes.shape == (6, 2)
    assert np.abs(sizes - [0.2, -0.1]).max() < 4 / (30 * np.sqrt(240))


def test_without_folds_all_tell(case):
    "Without held-out rows the size of the only fold is that of all rows"
    cross, residual = case
    sizes = CrossFit(cross.columns, np.zeros(300, int), 1).sizes(residual[:, None])
    np.testing.assert_array_equal(sizes[0], sizes[1])


def test_drift_is_allowed_for(late):
    "Found among the drift of the POS, the clock's 6 ms come out to a quarter in each fold"
    observed = late.observations
    rows = late.rows
    column = next(sign for sign in late.signs if sign.name == "time_offset").jacobian
    residual = observed.columns(rows.residual[:, None])[:, 0]
    fold = (rows.gps_time[observed.row] // 5.0).astype(int) % 5
    sizes = cross_fitted(observed, STATED, fold, 5, observed.columns(column), residual)
    assert np.abs(sizes - 0.006).max() < 1.5e-3
    assert np.abs(sizes).max() * np.abs(column).max() < SETTINGS.free_sigma
