"""A vehicle goes as fast as it is asked to, and stands where it stops."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mlscorr.simulate.drive._pace import Pace, smooth_step

ELAPSED = np.arange(0.0, 120.0, 0.01)
FAR = 1e6  # s: no slowdown within the drive


@given(st.floats(0.5, 30.0), st.floats(0.0, 6.3))
def test_cruising_speed_swings_about_its_mean(cruise, phase):
    "By a tenth to both sides, and on average over whole periods not at all"
    pace = Pace(cruise, phase, FAR)
    speed = pace.speed(np.linspace(0.0, 5 * pace.period, 5001))
    assert speed.min() >= 0.9 * cruise * (1 - 1e-9) and speed.max() <= 1.1 * cruise * (1 + 1e-9)
    assert np.mean(speed[:-1]) == pytest.approx(cruise, rel=1e-3)


def test_the_slowdown_is_where_it_is_asked_for():
    "At 50 s 60 % of the speed are gone, 15 s away nothing is"
    with_it, without = (Pace(10.0, 0.3, at).speed(ELAPSED) for at in (50.0, FAR))
    share = with_it / without
    assert ELAPSED[np.argmin(share)] == pytest.approx(50.0, abs=0.02)
    assert share.min() == pytest.approx(0.4, abs=1e-6)
    assert share[np.abs(ELAPSED - 50.0) > 15.0].min() > 0.999


def test_a_stop_is_one():
    "Exactly no speed from 30 to 40 s, no distance either, and full speed well before and after"
    pace = Pace(8.0, 0.0, FAR, stops=((30.0, 10.0),))
    speed = pace.speed(ELAPSED)
    distance = pace.distance(ELAPSED)
    stands = (ELAPSED >= 30.0) & (ELAPSED <= 40.0)
    assert not speed[stands].any() and (speed[~stands][[0, -1]] > 7.0).all()
    assert np.ptp(distance[stands][1:]) == 0.0
    assert np.abs(np.gradient(speed, 0.01)).max() < 3.0  # m/s^2


def test_a_turn_is_slow():
    "At most 3 m/s for its 6 s, whatever the cruise is; a cruise below that is left alone"
    turn = (60.0, 6.0, 3.0)
    inside = np.abs(ELAPSED - 60.0) <= 3.0
    assert Pace(12.0, 0.0, FAR, turn=turn).speed(ELAPSED)[inside].max() <= 3.0 + 1e-9
    slow = [Pace(2.0, 0.0, FAR, turn=each).speed(ELAPSED) for each in (turn, None)]
    np.testing.assert_allclose(*slow)


def test_distance_is_the_integral_of_speed():
    "Its rate is the speed to 1 mm/s, it begins at zero and never falls"
    pace = Pace(9.0, 1.0, 70.0, stops=((20.0, 5.0),))
    distance = pace.distance(ELAPSED)
    assert distance[0] == 0.0 and (np.diff(distance) >= 0).all()
    rate = np.gradient(distance, ELAPSED)[1:-1]
    np.testing.assert_allclose(rate, pace.speed(ELAPSED)[1:-1], atol=1e-3)


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_a_step_is_smooth_and_rises(a, b):
    "0 below 0, 1 above 1, never falling, as far from 0 as from 1 on the other side"
    low, high = sorted((a, b))
    first, second = smooth_step(np.array([low, high]))
    assert 0.0 <= first <= second <= 1.0
    assert smooth_step(np.array(1.0 - a)) == pytest.approx(1.0 - smooth_step(np.array(a)))
