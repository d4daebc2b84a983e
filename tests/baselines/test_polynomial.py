"""LS-n and LSC-n: a polynomial drift is recovered, and the paper's equations are kept."""

import numpy as np
import pytest

from mlscorr.baselines import Undetermined, fit_literal, fit_polynomial
from mlscorr.survey import Pos
from tests.beds.pos_errors import CONSTANT, LENGTH, case_at_a_gap
from tests.beds.streets import DURATION, SHIFT, SIGMA, TIME, observed, targets, trajectory


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_a_polynomial_of_time_is_recovered(order):
    "LS-n removes a polynomial drift of its order everywhere, beyond the control points too"
    rng = np.random.default_rng(order)
    coefficients = rng.normal(0.0, 0.3, (order + 1, 3))

    def drift(time):
        return np.polynomial.polynomial.polyval((time - TIME) / DURATION, coefficients).T

    place, time = targets(rng)
    correction = fit_polynomial(trajectory(), observed(place, time, place + drift(time)), order)
    error = correction.corrected.position - trajectory().position - drift(trajectory().gps_time)
    assert np.abs(error).max() < 1e-6


@pytest.mark.parametrize("order", [2, 5])
def test_the_literal_collocation_is_that_of_the_paper(order):
    "Two sweeps over the epochs give what Eq. 13-15 give when written out with full matrices"
    rng = np.random.default_rng(7)
    place, time = targets(rng)
    drive = trajectory()
    matched = observed(place, time, place + rng.normal(0.0, 0.2, place.shape))
    correction, found = fit_literal(drive, matched, Pos(), order)
    assert found["correlation_time"] == pytest.approx(4 * epochs_interval(time))
    arm = place - drive.at(time).position
    n = len(time)
    c0 = np.array(found["c0"])
    b = np.zeros((3 * n, 6 * n))
    for i, (x, y, z) in enumerate(arm):
        minus_phi = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        b[3 * i : 3 * i + 3, 6 * i : 6 * i + 6] = np.hstack([np.eye(3), minus_phi])
    scaled = (time - TIME) / DURATION
    a = np.kron(np.vander(scaled, order + 1), np.eye(3))
    v = b @ np.diag(np.tile(c0, n)) @ b.T + (SIGMA**2 + 1e-6) * np.eye(3 * n)
    l_ = matched.misclosure.ravel()
    y = np.linalg.solve(a.T @ np.linalg.solve(v, a), a.T @ np.linalg.solve(v, l_))
    at = np.array([0, 333, 700, 1000])
    lag = np.abs(drive.gps_time[at, None] - time)
    cross = np.kron(np.exp(-lag / found["correlation_time"]), np.diag(c0))
    signal = (cross @ b.T @ np.linalg.solve(v, l_ - a @ y)).reshape(-1, 6)
    trend = np.kron(np.vander((drive.gps_time[at] - TIME) / DURATION, order + 1), np.eye(3)) @ y
    wanted = signal[:, :3] + trend.reshape(-1, 3)
    got = correction.corrected.position[at] - drive.position[at]
    assert np.abs(got - wanted).max() < 1e-6
    turned = correction.corrected.attitude[at] * drive.attitude[at].inv()
    assert np.abs(turned.as_rotvec() - signal[:, 3:]).max() < 1e-9


def epochs_interval(time):
    "Mean interval of the times that are more than a second apart"
    kept = [time[0]]
    for next_time in time[1:]:
        if next_time - kept[-1] > 1.0:
            kept.append(next_time)
    return (kept[-1] - kept[0]) / (len(kept) - 1)


@pytest.mark.parametrize("order", [2, 5])
def test_a_polynomial_needs_more_epochs_than_its_order_and_one(order):
    "n + 1 epochs are refused, also when there are more targets, within a second of each other"
    place, time = targets(np.random.default_rng(6), order + 3)
    time = TIME + np.linspace(3.0, 97.0, order + 3)
    time[-2:] = time[-3] + [0.3, 0.6]
    given = observed(place, time, place + SHIFT)
    with pytest.raises(Undetermined, match=f"at {order + 2} or more epochs.*there are {order + 1}"):
        fit_polynomial(trajectory(), given, order)
    with pytest.raises(Undetermined, match="or more epochs"):
        fit_literal(trajectory(), given, Pos(), order)


def test_control_at_both_edges_of_a_gap_alone_is_enough():
    """Without a recorded interval the correlation time is four times all that was recorded."""
    case = case_at_a_gap()
    correction, found = fit_literal(case.recorded, case.matched, Pos(), 0)
    assert found["correlation_time"] == pytest.approx(4 * (LENGTH - 5.0))
    moved = correction.corrected.position - case.recorded.position
    assert np.abs(moved - CONSTANT[0]).max() < 0.05  # m
