"""Restarts of drift, and the times at which its growth is stated."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.pos import drift_history
from mlscorr.pos.stated import stated_sigma
from mlscorr.survey import Pos, Trajectory

# s, m
START = 413200.0
CORNER = np.array([528000.0, 3379000.0, 20.0])
TIME = np.arange(0.0, 200.0, 0.1)
OUTAGE = (TIME >= 80.0) & (TIME < 120.0)


def drive(sigma=None, error=None):
    "200 s to the north; sigma (n,) stands for all axes"
    path = CORNER + np.outer(TIME, [0.0, 10.0, 0.0])
    if error is not None:
        path = path - error[:, None] * [1.0, 0.5, -0.5]
    if sigma is None:
        sigma = None
    else:
        sigma = np.repeat(sigma[:, None], 3, axis=1)
    return Trajectory(START + TIME, path, Rotation.identity(len(TIME)), sigma)


def grown(size):
    return np.where(OUTAGE, size * (np.maximum(TIME - 80.0, 0.0) / 40.0) ** 1.5, 0.0)


def test_sigma_tells_start_and_end_of_an_outage():
    "Sigma that grows from 80 s and falls at 120 s, without a step: drift is back here"
    history = drift_history(drive(0.02 + grown(1.0)))
    assert history.is_stated
    assert len(history.restarts) == 0
    assert history.returns == pytest.approx([START + 120.0], abs=0.11)
    assert history.starts[0] == pytest.approx(START + 82.0, abs=2.0)  # s: when it has doubled
    assert np.isinf(history.starts[1])


def test_a_step_and_a_fall_of_sigma_are_one_restart():
    "The path steps when sigma falls: one restart, at the step"
    history = drift_history(drive(0.02 + grown(1.0), grown(0.8)))
    assert len(history.steps) == 1
    assert history.restarts == pytest.approx(history.steps.middle)


def test_without_sigma_each_segment_may_grow_at_once():
    "Steps alone part the drive; nothing says when drift begins"
    history = drift_history(drive(None, grown(0.8)))
    assert not history.is_stated
    assert history.restarts == pytest.approx([START + 119.95], abs=0.11)
    assert history.starts == pytest.approx([START, history.restarts[0]])


def test_a_smoothed_outage_ends_where_sigma_has_sunk():
    "A hump of sigma from 80 to 120 s is back at its end, without a restart; after it none grows"
    time = np.clip(TIME - 80.0, 0.0, 40.0)
    history = drift_history(drive(0.02 + (time * (40.0 - time) / 400.0) ** 1.5))
    assert len(history.restarts) == 0
    assert history.returns == pytest.approx([START + 118.0], abs=2.0)  # s: still twice at 118 s
    assert history.ends == pytest.approx([*history.returns, np.inf])
    assert history.starts == pytest.approx([START + 82.0, np.inf], abs=2.0)
    assert history.growth(START + np.array([10.0, 100.0, 150.0])).tolist() == [0, 0, 1]
    assert history.segment(START + np.array([10.0, 150.0])).tolist() == [0, 0]


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_smoothed_sigma_is_counted_by_how_much_it_rises_and_sinks(noise):
    "From 2 cm to 1 m and back in each of two outages: 4 ln 50, of which noise of 2 % makes no more"
    chance = 1.0 + noise * np.random.default_rng(1).normal(size=len(TIME))
    humps = [np.clip((TIME - begin) / 40.0, 0.0, 1.0) for begin in (30.0, 110.0)]
    size = sum((4.0 * share * (1.0 - share)) ** 1.5 for share in humps)
    history = drift_history(drive(chance * np.hypot(0.02, size)))
    assert len(history.smoothed) == 2
    assert history.folds[-1] == pytest.approx(4.0 * np.log(50.0), rel=0.12)
    assert history.folds[(TIME > 75.0) & (TIME < 105.0)] == pytest.approx(
        history.folds[-1] / 2, 0.05
    )


def test_drift_of_a_filter_keeps_its_clock():
    "Sigma that grows to 1 m and falls at once is no smoother's: nothing is counted"
    history = drift_history(drive(0.02 + grown(1.0)))
    assert len(history.returns) == 1 and len(history.smoothed) == 0
    assert not history.folds.any()


def test_what_grows_until_it_falls_is_not_smoothed():
    "Growth that falls within a second at 120 s, and a hump that a step of the path cuts: none back"
    fall = np.interp(TIME, [119.9, 120.0, 120.4], [1.0, 0.6, 0.0])
    filtered = np.where(TIME < 119.9, grown(1.0), fall)
    assert len(drift_history(drive(0.02 + filtered)).returns) == 0
    time = np.clip(TIME - 80.0, 0.0, 40.0)
    hump = (time * (40.0 - time) / 400.0) ** 1.5
    cut = drift_history(drive(0.02 + hump, np.where(TIME < 100.0, grown(0.8), 0.0)))
    assert len(cut.steps) == 1 and len(cut.returns) == 0


def test_clocks_leap_at_restarts_and_drift_grows_from_zero():
    "Across a restart lags are thousands of correlation times; sigma grows as t^1.5 from a start"
    trajectory = drive(None, grown(0.8))
    starts = np.array([START + 80.0, np.inf])
    stated = stated_sigma(trajectory, Pos(position_sigma=0.5), starts=starts)
    leaps = np.diff(stated.clock)
    assert np.sum(leaps > 1e6) == 1 and np.all(leaps > 0)
    assert np.all(np.diff(stated.growth_clock) > 0)
    sigma = stated.grown(1.5)[:, 0]
    assert not sigma[TIME < 79.9].any() and not sigma[TIME > 120.1].any()
    assert sigma[np.searchsorted(TIME, 110.0)] == pytest.approx(0.5 * 0.5**1.5, rel=0.01)  # m


def test_a_history_is_worked_out_once_for_a_trajectory():
    "As long as somebody holds it"
    trajectory = drive()
    history = drift_history(trajectory)
    assert drift_history(trajectory) is history
    assert drift_history(drive()) is not history


def test_gnss_that_is_not_fixed_holds_the_pos_to_what_it_states():
    "From an outage back to a float solution of 0.5 m for 40 s: nothing grows, and 0.5 m is held"
    floated = (TIME >= 120.0) & (TIME < 160.0)
    history = drift_history(drive(0.02 + grown(3.0) + 0.48 * floated))
    assert history.returns == pytest.approx([START + 120.0, START + 160.0], abs=0.11)
    assert np.isinf(history.starts[1:]).all()
    level = history.solution_sigma[[600, 1000, 1400, 1800], 0]
    assert level == pytest.approx([0.02, 0.02, 0.5, 0.02], abs=0.01)  # m


def test_what_falls_within_some_epochs_is_another_solution():
    "GNSS comes back by 0.3 m and a second later by 2 cm, each spread over 0.1 s: two turns there"
    sigma = np.interp(TIME, [119.9, 120.0, 121.0, 121.1], [1.0, 0.3, 0.3, 0.02])
    sigma[TIME < 119.9] = (0.02 + grown(1.0))[TIME < 119.9]
    history = drift_history(drive(sigma))
    assert history.turns == pytest.approx([START + 120.0, START + 121.0], abs=0.11)
    assert history.solution_sigma[1205, 0] == pytest.approx(0.3)  # m
    assert history.starts[0] == pytest.approx(START + 80.0, abs=5.0) and np.isinf(history.starts[1])


def test_drift_grows_from_what_is_held():
    "A float solution of 0.3 m, lost after a while: drift grows to 3 m, beside what was held"
    floated = 0.28 * (TIME >= 60.0)
    history = drift_history(drive(0.02 + floated + grown(3.0)))
    assert history.starts[0] == pytest.approx(START + 60.0, abs=0.11)
    assert history.solution_sigma[1000, 0] == pytest.approx(0.3)  # m


def test_sigma_that_converges_after_its_fall_is_no_drift():
    "GNSS is back, and sigma sinks from 0.2 m within 30 s: nothing grows there"
    late = np.where(TIME >= 120.0, 0.18 * np.exp(-(TIME - 120.0) / 10.0), 0.0)
    history = drift_history(drive(0.02 + grown(3.0) + late))
    assert history.returns[0] == pytest.approx(START + 120.0, abs=0.11)
    assert np.isinf(history.starts[1:]).all()


def test_heights_that_vary_less_are_held_like_the_rest():
    "Sigma of the plan grows tenfold in an outage, of the height by half: all three are held"
    sigma = np.column_stack([0.02 + grown(0.2), 0.02 + grown(0.2), 0.04 + grown(0.02)])
    trajectory = Trajectory(
        START + TIME, CORNER + np.outer(TIME, [0.0, 10.0, 0.0]), Rotation.identity(len(TIME)), sigma
    )
    stated = stated_sigma(trajectory, Pos())
    assert stated.known_gnss[0] == pytest.approx([0.02, 0.02, 0.04])  # m
    assert stated.gnss[0] == pytest.approx([0.02, 0.02, 0.04])
