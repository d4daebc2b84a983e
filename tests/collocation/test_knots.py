"""Knots stand where a signal needs them, and their prior is that of its covariance."""

import numpy as np
import pytest

from mlscorr.collocation import Covariance, Signal
from mlscorr.collocation._block_cholesky import factorise, solve_in_place
from mlscorr.collocation._knots import (
    SHARE,
    Knots,
    add_prior,
    knot_gains,
    knot_step,
    prior_roots,
    thinned,
)
from mlscorr.collocation._pattern import Pattern, diagonal
from mlscorr.collocation._states import Layout
from tests.collocation.joint_states import ALL_FAMILIES, START, carried, stationary


@pytest.mark.parametrize("family", ALL_FAMILIES)
@pytest.mark.parametrize("time", [5.0, 600.0])
def test_between_knots_a_step_apart_little_is_left(family, time):
    "In the middle of a step remains SHARE of the signal's sigma, to a tenth, and never more"
    covariance = Covariance(family, time)
    step = knot_step(covariance)
    layout = Layout.of([Signal(np.ones((1, 1, 1)), covariance)])
    epochs = np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * step
    knots = Knots(np.array([0, 2]), epochs[[0, -1]], epochs[[0, -1]], np.array([[[0, 1]]]))
    cell = np.zeros(5, dtype=np.int64)
    _, remaining = knot_gains(layout, knots, cell, epochs[:, None])
    assert np.sqrt(remaining.max()) == pytest.approx(SHARE, rel=0.1)
    assert np.argmax(remaining) == 2


def test_epochs_lie_on_knots_or_between_close_ones():
    "Within a step of the next knot, or a quarter of a step past one; none closer than a quarter"
    rng = np.random.default_rng(1)
    clock = np.sort(np.append(rng.uniform(0, 100, 40), 50 + rng.uniform(0, 3, 400)))
    step = 0.5
    knots = thinned(clock, step)
    here = clock[knots]
    assert np.diff(here).min() > step / 4
    after = np.searchsorted(here, clock)
    gap = np.append(here, np.inf)[after] - here[np.maximum(after - 1, 0)]
    past = clock - here[np.maximum(np.searchsorted(here, clock, side="right") - 1, 0)]
    assert ((gap <= step) | (past <= step / 4)).all()
    assert thinned(clock[:0], step).size == 0
    assert np.array_equal(thinned(np.array([1.0, 1.0, 2.0]), 0.0), [0, 2])


def test_every_signal_has_knots_of_its_own_and_a_cell_names_those_about_it():
    "An exponential signal has them at all epochs, a smooth one at some"
    gps_time = START + np.array([5.0, 0.0, 0.1, 0.2, 0.3, 5.0])
    covariances = [Covariance("exponential", 30.0), Covariance("matern52", 30.0)]
    knots = Knots.of(gps_time, np.column_stack([gps_time, gps_time]), map(knot_step, covariances))
    assert knots.first.tolist() == [0, 5, 7]
    assert (knots.clock - START).round(9).tolist() == [0.0, 0.1, 0.2, 0.3, 5.0, 0.0, 5.0]
    assert knots.cells[0].tolist() == [[-1, 0], [-1, 5]]
    assert knots.cells[2].tolist() == [[1, 2], [5, 6]]
    assert knots.cells[-1].tolist() == [[4, -1], [6, -1]]


@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_the_prior_is_the_inverse_of_the_joint_covariance(family):
    "L0^-1 of two processes at four knots, one of them across a restart, to 1e-9"
    covariance = Covariance(family, 20.0)
    clock = np.array([0.0, 3.0, 20.0, 1e7])
    layout = Layout.of([Signal(np.ones((1, 1, 2)), covariance)])
    cells = np.array([[[-1, 0]], [[0, 1]], [[1, 2]], [[2, 3]], [[3, -1]]])
    knots = Knots(np.array([0, 4]), clock, clock, cells)
    d = covariance.states
    pattern = Pattern.of(np.full(4, 2 * d), np.array([[0, 1], [1, 2], [2, 3]]))
    values = pattern.zeros
    roots, steps = prior_roots(layout, knots)
    add_prior(layout, knots, pattern, roots, steps, values)
    assert factorise(pattern, values) == -1
    inverse = np.eye(8 * d)
    solve_in_place(pattern, values, inverse)
    for i, late in enumerate(clock):
        for j, early in enumerate(clock[: i + 1]):
            expected = carried(family, min(covariance.rate * (late - early), 600.0))
            expected = np.kron(np.eye(2), expected @ stationary(family))
            rows, columns = (pattern.first[pattern.place[k]] + np.arange(2 * d) for k in (i, j))
            assert inverse[np.ix_(rows, columns)] == pytest.approx(expected, abs=1e-9)
    determinant = 2 * np.log(diagonal(pattern, values)).sum()
    of_roots = 4 * np.log(np.einsum("kii->ki", roots)[:, :d]).sum()
    assert determinant == pytest.approx(of_roots, abs=1e-9)
