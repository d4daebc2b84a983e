"""Between two observations their states say all; beyond them the signal fades."""

import numpy as np
import pytest

from mlscorr.collocation import Covariance, Noise, Signal, collocate
from mlscorr.collocation._conditional import Epochs
from mlscorr.collocation._recursion import filter_columns, smooth_columns, smooth_covariance
from mlscorr.collocation.interpolation import interpolate
from tests.collocation.joint_states import ALL_FAMILIES, START, Bed

ASKED = START + np.array([-1e5, -3.0, 0.0, 7.0, 7.001, 22.0, 41.0, 59.0, 80.0, 1e6])
BEDS = [Bed(seed) for seed in range(4)]
BEDS += [Bed(30 + i, (family,) * 3) for i, family in enumerate(ALL_FAMILIES)]


def interpolated(bed, gps_time, mixing, design=None, trend=None, root=None):
    "Mean (q, r) and covariance (q, r, r) of the bed's last column, the others being the design"
    recursion, covariances = bed.filtered()
    p = bed.columns.shape[2] - 1
    whitened, states = filter_columns(recursion, bed.columns)
    states = states + covariances @ smooth_columns(recursion, whitened)[1]
    same, following = smooth_covariance(recursion, bed.steps, covariances)[2:]
    q, r, _ = mixing.shape
    clocks = np.repeat(bed.gps_time[:, None], 3, axis=1)
    asked = np.repeat(gps_time[:, None], 3, axis=1)
    mean = np.empty((q, r))
    covariance = np.empty((q, r, r))
    epochs = Epochs(
        gps_time,
        asked,
        np.zeros((q, r, p)) if design is None else design,
        mixing,
        np.zeros(p) if trend is None else trend,
        np.zeros((p, p)) if root is None else root,
        mean,
        covariance,
    )
    interpolate(bed.gps_time, clocks, bed.layout, states, same, following, epochs)
    return mean, covariance


def dense(bed, mixing):
    "What all columns and the covariance of the signal at ASKED are by the joint covariance"
    n, r, c = bed.columns.shape
    d = bed.layout.size
    h = bed.observing
    joint = bed.joint([*bed.gps_time, *ASKED])
    for i in range(len(ASKED)):
        here = slice((n + i) * d, (n + i + 1) * d)
        across = joint[here, : n * d] @ h.T
        gain = np.linalg.solve(bed.total, across.T).T
        see = np.zeros((mixing.shape[1], d))
        see[:, bed.first] = mixing[i]
        left = joint[here, here] - gain @ across.T
        yield see @ gain @ bed.columns.reshape(n * r, c), see @ left @ see.T


@pytest.mark.parametrize("bed", BEDS, ids=lambda bed: "-".join(bed.families))
def test_signals_are_those_of_the_joint_covariance(bed):
    "Before, between, at and past the observations, mean and covariance to 1e-8"
    mixing = np.random.default_rng(1).normal(size=(len(ASKED), 4, 5))
    mean, covariance = interpolated(bed, ASKED, mixing)
    for i, (columns, expected) in enumerate(dense(bed, mixing)):
        np.testing.assert_allclose(mean[i], columns[:, -1], atol=1e-8)
        np.testing.assert_allclose(covariance[i], expected, atol=1e-8)


@pytest.mark.parametrize("bed", BEDS[:4], ids=lambda bed: "-".join(bed.families))
def test_the_trend_adds_what_the_signal_does_not_absorb(bed):
    "Mean + A x, and (A - B S A_l) C (A - B S A_l)^T beside the signal's covariance"
    rng = np.random.default_rng(2)
    q = len(ASKED)
    r = 3
    p = 2
    mixing = rng.normal(size=(q, r, 5))
    design = rng.normal(size=(q, r, p))
    trend = rng.normal(size=p)
    root = np.triu(rng.normal(size=(p, p)))
    mean, covariance = interpolated(bed, ASKED, mixing, design, trend, root)
    for i, (columns, signal) in enumerate(dense(bed, mixing)):
        lacking = (design[i] - columns[:, :p]) @ root
        np.testing.assert_allclose(mean[i], design[i] @ trend + columns[:, p], atol=1e-8)
        np.testing.assert_allclose(covariance[i], signal + lacking @ lacking.T, atol=1e-8)


def test_one_process_of_one_quantity_takes_the_same_way():
    "The shortcut for a single process gives what two quantities of it give"
    n = 9
    gps_time = START + np.arange(9) * 4.0
    asked = START + np.linspace(-5.0, 40.0, 31)
    unit = np.ones((n, 1, 1))
    signal = Signal(0.3 * unit, Covariance("matern52", 11.0))
    misclosure = np.random.default_rng(3).normal(size=(n, 1))
    solved = collocate(gps_time, misclosure, Noise(0.01 * unit), unit, [signal])
    results = []
    for r in (1, 2):
        mixing = np.full((31, r, 1), 0.3)
        mean, covariance = solved.predict(asked, np.ones((31, r, 1)), [mixing])
        results.append((mean[:, 0], covariance[:, 0, 0]))
    np.testing.assert_allclose(*(mean for mean, _ in results), rtol=1e-12)
    np.testing.assert_allclose(*(variance for _, variance in results), rtol=1e-12)


def test_the_order_of_epochs_does_not_matter():
    "Asked backward or at random, each epoch gets bit for bit the same: the search leaves no trace"
    bed = BEDS[0]
    rng = np.random.default_rng(4)
    asked = START + np.sort(rng.uniform(-20.0, 90.0, 60))
    mixing = rng.normal(size=(60, 2, 5))
    mean, covariance = interpolated(bed, asked, mixing)
    for order in (np.arange(60)[::-1], rng.permutation(60)):
        there, spread = interpolated(bed, asked[order], mixing[order])
        np.testing.assert_array_equal(there, mean[order])
        np.testing.assert_array_equal(spread, covariance[order])


@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_far_from_all_observations_the_prior_remains(family):
    "A day away the signal's mean is zero and its variance what it was before any observation"
    bed = Bed(5, (family,) * 3)
    mixing = np.random.default_rng(6).normal(size=(2, 3, 5))
    far = START + np.array([-86_400.0, 86_400.0])
    mean, covariance = interpolated(bed, far, mixing)
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(covariance, mixing @ mixing.swapaxes(1, 2), atol=1e-12)
