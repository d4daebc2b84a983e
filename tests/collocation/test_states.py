"""Each process has its block of states, which time carries and observations see."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from mlscorr.collocation import Covariance, Signal
from mlscorr.collocation._states import (
    Layout,
    carry,
    dense_blocks,
    fill_noise,
    fill_transition,
)
from tests.collocation.joint_states import ALL_FAMILIES, Bed, carried, stationary

LAGS = np.array([1e-3, 0.3, 4.0, 50.0])  # s
BEDS = [Bed(seed) for seed in range(3)] + [Bed(9, (family,) * 3) for family in ALL_FAMILIES]


def transitions(bed, lag):
    out = np.zeros((1, 3, 3, 3))
    fill_transition(bed.layout, np.full((1, 3), lag), out)
    return out[0]


def noises(bed, lag):
    out = np.zeros((1, 3, 3, 3))
    fill_noise(bed.layout, np.full((1, 3), lag), out)
    return out[0]


def test_the_layout_counts_states_of_processes():
    "Three exponential, one Matern 3/2 and two Matern 5/2 processes have 3 + 2 + 6 states"
    parts = [("exponential", 3), ("matern32", 1), ("matern52", 2)]
    signals = [Signal(np.zeros((4, 3, k)), Covariance(name, 10.0)) for name, k in parts]
    layout = Layout.of(signals)
    assert layout.first.tolist() == [0, 1, 2, 3, 5, 8]
    assert layout.signal.tolist() == [0, 0, 0, 1, 2, 2]
    assert layout.states.tolist() == [1, 2, 3] and layout.size == 11
    np.testing.assert_allclose(layout.rates, [0.1, np.sqrt(3) / 10, np.sqrt(5) / 10])


def test_without_signals_there_is_no_state():
    "Least squares without signals has a layout of nothing"
    layout = Layout.of([])
    assert layout.size == 0 and len(layout.first) == 0


@pytest.mark.parametrize("lag", LAGS)
@pytest.mark.parametrize("bed", BEDS, ids=lambda bed: "-".join(bed.families))
def test_time_carries_by_the_matrix_exponential(bed, lag):
    "F is exp(G dt) and Q what keeps the stationary covariance: P = F P F^T + Q, to 1e-12"
    f = transitions(bed, lag)
    q = noises(bed, lag)
    for s, (family, covariance) in enumerate(zip(bed.families, bed.covariances, strict=True)):
        d = covariance.states
        expected = carried(family, covariance.rate * lag)
        np.testing.assert_allclose(f[s, :d, :d], expected, atol=1e-12)
        p = stationary(family)
        np.testing.assert_allclose(q[s, :d, :d], p - expected @ p @ expected.T, atol=1e-12)
        assert not f[s, d:].any() and not f[s, :, d:].any()
        assert not q[s, d:].any() and not q[s, :, d:].any()


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("bed", BEDS, ids=lambda bed: "-".join(bed.families))
def test_all_states_are_carried_at_once(bed, transposed):
    "F x and F^T x block by block are the products with the whole matrix"
    rng = np.random.default_rng(1)
    f = bed.transition(7.0)
    f = f.T if transposed else f
    blocks = transitions(bed, 7.0)
    x = rng.normal(size=(bed.layout.size, 4))
    moved = x.copy()
    carry(bed.layout, blocks, moved, transposed)
    np.testing.assert_allclose(moved, f @ x, atol=1e-12)
    assert dense_blocks(bed.layout, blocks[None])[0] == pytest.approx(bed.transition(7.0))


def test_two_steps_are_a_long_one():
    "Carried over 3 s and then 5 s, the states are where 8 s take them"
    for bed in BEDS:
        x = np.random.default_rng(2).normal(size=(bed.layout.size, 2))
        long = x.copy()
        carry(bed.layout, transitions(bed, 8.0), long, False)
        for lag in (3.0, 5.0):
            carry(bed.layout, transitions(bed, lag), x, False)
        np.testing.assert_allclose(x, long, atol=1e-13)


def test_noise_stands_in_the_block_of_each_process_alone():
    "Blocks stand on the diagonal, of each process's size; zeros between processes"
    for bed in BEDS:
        spread = dense_blocks(bed.layout, noises(bed, np.inf)[None])[0]
        expected = block_diag(*(stationary(family) for family in bed.processes))
        np.testing.assert_allclose(spread, expected, atol=1e-12)


def test_a_process_knows_itself_by_its_covariance_function():
    "The first state now and after a lag is correlated as the covariance function says"
    for family in ALL_FAMILIES:
        covariance = Covariance(family, 12.0)
        layout = Layout.of([Signal(np.ones((1, 1, 1)), covariance)])
        for lag in LAGS:
            f = np.zeros((1, 1, 3, 3))
            p = np.zeros((1, 1, 3, 3))
            fill_transition(layout, np.array([[lag]]), f)
            fill_noise(layout, np.array([[np.inf]]), p)
            d = covariance.states
            assert (f[0, 0, :d, :d] @ p[0, 0, :d, :d])[0, 0] == pytest.approx(
                covariance(lag), abs=1e-12
            )
