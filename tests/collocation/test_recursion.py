"""One pass forward and one backward say all that the joint covariance of all states says."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from mlscorr.collocation._recursion import (
    filter_columns,
    filter_covariance,
    precision_between,
    smooth_columns,
    smooth_covariance,
)
from tests.collocation.joint_states import ALL_FAMILIES, Bed

BEDS = [Bed(seed, r=1 + seed % 3) for seed in range(6)]
BEDS += [Bed(20 + i, (family,) * 3) for i, family in enumerate(ALL_FAMILIES)]
every_bed = pytest.mark.parametrize("bed", BEDS, ids=lambda bed: "-".join(bed.families))


def smoothed_dense(bed):
    "V^-1, and the covariance (n d, n d) of the states given all observations"
    joint = bed.joint(bed.gps_time)
    h = bed.observing
    weight = np.linalg.inv(bed.total)
    return weight, joint - joint @ h.T @ weight @ h @ joint


@every_bed
def test_whitened_observations_have_the_inverse_covariance(bed):
    "W^T W = V^-1 for the W that turns columns into innovations of unit variance"
    recursion, _ = bed.filtered()
    n, r, _ = bed.columns.shape
    unit = np.eye(n * r).reshape(n, r, n * r)
    w = filter_columns(recursion, unit)[0].reshape(n * r, n * r)
    np.testing.assert_allclose(w @ bed.total @ w.T, np.eye(n * r), atol=1e-9)
    blocks = w.reshape(n, r, n, r).swapaxes(1, 2)
    assert all(not blocks[i, j].any() for i in range(n) for j in range(i + 1, n))


@every_bed
def test_filtered_states_know_the_past_alone(bed):
    "State and covariance at epoch i are those that the dense formula gives of epochs 0 to i"
    recursion, covariances = bed.filtered()
    n, r, c = bed.columns.shape
    states = filter_columns(recursion, bed.columns)[1]
    joint = bed.joint(bed.gps_time)
    h = bed.observing
    d = bed.layout.size
    noise = block_diag(*bed.noise)
    for i in range(n):
        seen = slice(0, (i + 1) * r)
        here = slice(i * d, (i + 1) * d)
        cross = joint[here] @ h[seen].T
        total = h[seen] @ joint @ h[seen].T + noise[seen, seen]
        gain = np.linalg.solve(total, cross.T).T
        flat = bed.columns.reshape(n * r, c)[seen]
        np.testing.assert_allclose(states[i], gain @ flat, atol=1e-8)
        left = joint[here, here] - gain @ cross.T
        np.testing.assert_allclose(covariances[i], left, atol=1e-9)


@every_bed
def test_the_determinant_is_that_of_the_whiteners(bed):
    "log |V| = -2 sum log of the whiteners' diagonals"
    recursion, _ = bed.filtered()
    logarithm = -2.0 * np.log(np.einsum("nii->ni", recursion.whiteners)).sum()
    assert logarithm == pytest.approx(np.linalg.slogdet(bed.total)[1], abs=1e-9)


@every_bed
def test_backward_come_weights_and_smoothed_states(bed):
    "u = V^-1 c, and x + P a is the state that all observations give"
    recursion, covariances = bed.filtered()
    n, r, c = bed.columns.shape
    whitened, states = filter_columns(recursion, bed.columns)
    weights, adjoints = smooth_columns(recursion, whitened)
    expected = np.linalg.solve(bed.total, bed.columns.reshape(n * r, c))
    np.testing.assert_allclose(weights.reshape(n * r, c), expected, atol=1e-7)
    joint = bed.joint(bed.gps_time) @ bed.observing.T @ expected
    smoothed = states + covariances @ adjoints
    np.testing.assert_allclose(smoothed.reshape(joint.shape), joint, atol=1e-8)


@every_bed
def test_smoothed_covariances_are_blocks_of_the_joint_one(bed):
    "Of V^-1 the diagonal, of the states those with themselves and with the next epoch's"
    recursion, covariances = bed.filtered()
    n, r, _ = bed.columns.shape
    d = bed.layout.size
    blocks, _, same, following = smooth_covariance(recursion, bed.steps, covariances)
    weight, joint = smoothed_dense(bed)
    weight = weight.reshape(n, r, n, r).swapaxes(1, 2)
    joint = joint.reshape(n, d, n, d).swapaxes(1, 2)
    assert following.shape == (n - 1, d, d)
    for i in range(n):
        np.testing.assert_allclose(blocks[i], weight[i, i], rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(same[i], joint[i, i], atol=1e-9)
        if i + 1 < n:
            np.testing.assert_allclose(following[i], joint[i, i + 1], atol=1e-9)


@every_bed
def test_blocks_off_the_diagonal_come_by_walking_back(bed):
    "V^-1 between any two epochs, next to each other or from end to end"
    recursion, covariances = bed.filtered()
    n, r, _ = bed.columns.shape
    future = smooth_covariance(recursion, bed.steps, covariances)[1]
    weight = np.linalg.inv(bed.total).reshape(n, r, n, r).swapaxes(1, 2)
    for early in range(n):
        for late in range(early + 1, n):
            block = precision_between(recursion, future, early, late)
            np.testing.assert_allclose(block, weight[early, late], rtol=1e-6, atol=1e-7)


def test_two_equal_observations_without_noise_stop_the_filter():
    "At the second of two observations of one time the whitener is no number; before it they are"
    bed = Bed(1, r=1)
    bed.mixing[2] = bed.mixing[1]  # at the same time
    nothing = np.zeros_like(bed.noise)
    whiteners = filter_covariance(bed.layout, bed.layout.size, bed.steps, bed.mixing, nothing)[2]
    assert np.isfinite(whiteners[:2]).all() and np.isnan(whiteners[2]).any()


def test_a_single_epoch_has_no_next_one():
    "Of one epoch there is a covariance and none with what follows"
    bed = Bed(2)
    bed.mixing = bed.mixing[:1]
    bed.noise = bed.noise[:1]
    bed.steps = bed.steps[:1]
    recursion, covariances = bed.filtered()
    blocks, _, same, following = smooth_covariance(recursion, bed.steps, covariances)
    h = bed.observing[:2, : bed.layout.size]
    total = h @ bed.prior @ h.T + bed.noise[0]
    np.testing.assert_allclose(blocks[0], np.linalg.inv(total), atol=1e-9)
    expected = bed.prior - bed.prior @ h.T @ np.linalg.solve(total, h @ bed.prior)
    np.testing.assert_allclose(same[0], expected, atol=1e-12)
    assert len(following) == 0
