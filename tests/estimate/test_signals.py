"""The POS error as signals: what each has for a sigma and a clock."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.collocation import FAMILIES, INTEGRATED
from mlscorr.pos import SignalParameters, pose_signals
from mlscorr.pos.stated import stated_sigma
from mlscorr.survey import Pos, Trajectory

TIME = 413200.0 + np.arange(0.0, 100.0, 0.5)  # s
PARAMETERS = SignalParameters("matern32", 2.0, 30.0, 0.1, 1.0, 5.0, 3.0, 60.0, 1.0, 1.5, 90.0, 0.1)


@pytest.fixture(scope="module")
def stated():
    "A drive at UTM size whose sigma grows from 2 cm to 1 m in the second half"
    grown = 0.98 * np.clip((TIME - TIME[100]) / (TIME[-1] - TIME[100]), 0.0, 1.0) ** 1.5
    sigma = np.repeat(0.02 + grown[:, None], 3, axis=1)
    path = np.array([528000.0, 3379000.0, 20.0]) + np.outer(TIME - TIME[0], [0.0, 10.0, 0.0])
    trajectory = Trajectory(TIME, path, Rotation.identity(len(TIME)), sigma)
    return stated_sigma(trajectory, Pos(), TIME)


def partials(n):
    return np.broadcast_to(np.eye(6)[:3], (n, 3, 6))


@pytest.mark.parametrize("family", FAMILIES)
def test_drift_has_the_stated_sigma_times_its_scale(stated, family):
    "sqrt(1 m^2 - 2 cm^2) times 2 at an outage's end, nothing before; bias, jitter as GNSS holds"
    drift, jitter, bias, attitude = pose_signals(
        stated, replace(PARAMETERS, family=family), partials(len(TIME))
    )
    assert drift.mixing[-1] == pytest.approx(2.0 * np.sqrt(1 - 0.02**2) * np.eye(3))
    assert not drift.mixing[0].any()
    assert jitter.mixing[0] == pytest.approx(0.02 * np.eye(3))
    assert bias.mixing[-1] == pytest.approx(0.06 * np.eye(3))
    assert attitude.covariance.correlation_time == 90.0  # s


def test_integrated_drift_is_two_walks_on_one_clock(stated):
    "Velocity and position random walk grow together; bias and attitude are Matern 3/2 then"
    signals = pose_signals(stated, replace(PARAMETERS, family=INTEGRATED), partials(len(TIME)))
    velocity, walk, _, bias, _ = signals
    assert velocity.clock is not None and np.array_equal(velocity.clock, walk.clock)
    assert velocity.covariance.family == INTEGRATED and walk.covariance.family == "exponential"
    assert bias.covariance.family == "matern32"
    growth = velocity.mixing[-1, 0, 0] / velocity.mixing[-41, 0, 0]
    since = TIME[[-1, -41]] - stated.starts[-1]
    assert growth == pytest.approx((since[0] / since[1]) ** 1.5, rel=1e-6)


def test_drift_changes_as_quickly_as_a_smoothed_sigma():
    "Within 4 s in which sigma grows e-fold it is less alike than within 4 s in which it stays"
    share = np.clip((TIME - TIME[40]) / 60.0, 0.0, 1.0)
    sigma = np.repeat(np.hypot(0.02, (4.0 * share * (1.0 - share)) ** 1.5)[:, None], 3, axis=1)
    path = np.array([528000.0, 3379000.0, 20.0]) + np.outer(TIME - TIME[0], [0.0, 10.0, 0.0])
    trajectory = Trajectory(TIME, path, Rotation.identity(len(TIME)), sigma)
    asked = TIME[0] + np.array([24.0, 28.0, 48.0, 52.0])
    stated = stated_sigma(trajectory, Pos(), asked)
    drift = pose_signals(stated, PARAMETERS, partials(4))[0]
    lags = np.diff(drift.clock)[[0, 2]]
    rise = np.log(np.linalg.norm(stated.position[1]) / np.linalg.norm(stated.position[0]))
    assert lags[0] == pytest.approx(4.0 + 30.0 * rise / 3.0, rel=0.05)  # s, of 30 s and 3 e-folds
    assert lags[1] == pytest.approx(4.0, abs=0.2)


def test_drift_that_a_smoother_ties_down_is_a_walk_that_is_known_at_its_end():
    "Its covariance is that of a free walk of 40 s after its end, with its velocity, is known: 0"
    hump = np.clip(TIME - TIME[60], 0.0, 40.0)
    sigma = np.repeat((0.02 + (hump * (40.0 - hump) / 400.0) ** 1.5)[:, None], 3, axis=1)
    path = np.array([528000.0, 3379000.0, 20.0]) + np.outer(TIME - TIME[0], [0.0, 10.0, 0.0])
    trajectory = Trajectory(TIME, path, Rotation.identity(len(TIME)), sigma)
    history = stated_sigma(trajectory, Pos()).history
    asked = np.linspace(history.starts[0], history.returns[0], 9)[1:-1]
    stated = stated_sigma(trajectory, Pos(), asked)
    velocity, walk = pose_signals(stated, replace(PARAMETERS, family=INTEGRATED), partials(7))[:2]
    since = asked - history.starts[0]
    whole = history.returns[0] - history.starts[0]
    s = np.minimum.outer(since, since)
    t = np.maximum.outer(since, since)
    position = s**2 * (3 * t - s) / 6
    at_end = since**2 * (3 * whole - since) / 6
    ends = np.array([[whole**3 / 3, whole**2 / 2], [whole**2 / 2, whole]])
    across = np.column_stack([at_end, since**2 / 2])
    tied = {
        "velocity": (velocity, position - across @ np.linalg.solve(ends, across.T)),
        "walk": (walk, s - np.outer(since, since) / whole),
    }
    for signal, expected in tied.values():
        root = signal.mixing[:, 0, 0]
        lags = signal.covariance(np.subtract.outer(signal.clock, signal.clock))
        covariance = np.outer(root, root) * lags
        scale = covariance[3, 3] / expected[3, 3]
        np.testing.assert_allclose(covariance, scale * expected, rtol=1e-3)
