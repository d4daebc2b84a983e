"""Squares of innovations that sizes explain, and the remaining ones."""

import numpy as np
import pytest

from mlscorr.gap.closure._systematic import SystematicGap, share_gone, unit_square
from mlscorr.gap.closure.folds import CrossFit
from mlscorr.gap.evidence import ColumnTable, Explanations, Observations
from mlscorr.gap.evidence.evidence import ColumnBlock
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.residuals import background


@pytest.mark.parametrize(
    ("before", "after", "share"),
    [
        (100.0, 1.0, 0.99),
        (100.0, 0.0, 1.0),
        (100.0, -47.0, 1.0),
        (-5.0, 10.0, -1.0),
        (50.0, 100.0, -0.5),
        (0.0, 0.0, 0.0),
        (-3.0, -8.0, 0.0),
    ],
)
def test_no_share_is_more_than_all(before, after, share):
    "Signed squares of any size give a share within [-1, 1]"
    assert share_gone(before, after) == pytest.approx(share)


def gap(size, other=0.0, found=None, seed=1):
    "600 innovations with two known columns, the first of some size, judged in 5 folds"
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((600, 2))
    blocks = [ColumnBlock(name, i, np.array([i]), 1.0, 1.0) for i, name in enumerate("ab")]
    residual = columns @ [size, other] + rng.standard_normal(600)
    own = columns[:, :1]
    fold = np.arange(600) // 10 % 5
    cross = CrossFit(own, fold, 5)
    if found is None:
        sizes = cross.sizes(residual[:, None])[:-1, 0, 0]
    else:
        sizes = np.full(5, found)
    explanations = Explanations.of(ColumnTable(columns, tuple(blocks)), columns)
    every = np.ones(600, bool)
    return SystematicGap(
        residual, own[:, 0] * sizes[fold], own, explanations, cross, every, fold, 1e-6
    ), columns[:, 0] * size


@pytest.mark.parametrize("seed", range(4))
def test_the_stated_share_is_that_of_the_noise_free_truth(seed):
    "Of 12 sigmas 98 to 100 % go; stated to 3 %, and the interval holds the truth"
    measured, truth = gap(0.5, seed=seed)
    gone = 1 - np.sum((truth - measured.predicted) ** 2) / np.sum(truth**2)
    squares = measured.measure(np.random.default_rng(2))
    share = share_gone(*squares.square)
    assert share == pytest.approx(gone, abs=0.03)
    assert squares.interval[0] <= gone <= squares.interval[1] <= 1.0
    assert squares.square[1] > 0
    assert squares.folds.sum(axis=0) == pytest.approx(5 * squares.square)


def test_what_another_block_explains_stays():
    "A second effect as large as the first: half of the squares stay, to a tenth"
    squares = gap(0.5, 0.5)[0].measure(np.random.default_rng(2))
    assert share_gone(*squares.square) == pytest.approx(0.5, abs=0.1)
    assert squares.interval[0] < 0.5 < squares.interval[1]


def test_a_size_that_the_data_contradict_leaves_its_rest():
    "Half of the true size leaves a quarter of the square, to five percent"
    squares = gap(0.5, found=0.25)[0].measure(np.random.default_rng(2))
    assert share_gone(*squares.square) == pytest.approx(0.75, abs=0.05)


def test_nothing_predicted_leaves_the_signed_gap_as_it_is():
    "Without an effect and a prediction the gap lies within the band of chance"
    squares = gap(0.0, found=0.0)[0].measure(np.random.default_rng(2))
    low, high = np.percentile(squares.chance, [0.5, 99.5])
    assert low <= squares.square[0] == squares.square[1] <= high


@pytest.mark.long
def test_a_sum_over_planes_of_two_passes_is_as_long_as_what_they_differ_by(case):
    "The first look at a plane says where it is, to a metre: the unit is that of the second looks"
    survey, _, rows, _ = case
    shared = rows.select(rows.two_times)
    observations = Observations.of(shared, background(shared, survey))
    length = np.sqrt(unit_square(observations, STATED) * observations.second.sum())
    assert len(observations) > 1.5 * observations.second.sum()
    assert 0.0005 < length < 0.05  # m: noise of a plane, of a POS of centimetres
