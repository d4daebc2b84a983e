"""The kernel finds each point's interval and moves it as the formula says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.correction._kernel import fill_increments, locate, move_integers

START = 413_200.0  # s of week
EPOCHS = START + np.arange(200) * 0.005
NO_GAP = np.append(np.zeros(199, bool), True)
LIMIT = 2**31 - 1


def plain(time, epochs, is_gap):
    "Intervals by bisection; both ends of a gap belong to it no more"
    index = np.clip(np.searchsorted(epochs, time, side="right") - 1, 0, len(epochs) - 2)
    inside = (time >= epochs[0]) & (time <= epochs[-1])
    open_gap = is_gap[index] & (time > epochs[index]) & (time < epochs[index + 1])
    return inside & ~open_gap, index


def assert_located(time, epochs, is_gap, step=0.005):
    "Each point's interval holds it, and points without one are those that bisection finds"
    found = locate(time, 0.0, epochs, step, is_gap)
    inside, _ = plain(time, epochs, is_gap)
    np.testing.assert_array_equal(found >= 0, inside)
    at = found[inside]
    assert (epochs[at] <= time[inside]).all() and (time[inside] <= epochs[at + 1]).all()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), order=st.sampled_from(["sorted", "reversed", "random"]))
def test_points_are_found_in_any_order(seed, order):
    "In order of time, against it or shuffled, at irregular epochs with gaps of seconds"
    rng = np.random.default_rng(seed)
    step = rng.choice([0.005, 0.005, 0.0049, 0.0052, 2.0], 150, p=[0.5, 0.3, 0.1, 0.07, 0.03])
    epochs = START + np.cumsum(step)
    is_gap = np.append(np.diff(epochs) > 1.0, True)
    time = rng.uniform(epochs[0] - 1.0, epochs[-1] + 1.0, 300)
    time[:20] = rng.choice(epochs, 20)
    if order != "random":
        time = np.sort(time)[:: 1 if order == "sorted" else -1]
    assert_located(np.ascontiguousarray(time), epochs, is_gap)


@pytest.mark.parametrize("step", [1e-4, 0.005, 0.1, 100.0])
def test_a_wrong_usual_step_costs_time_and_no_point(step):
    "Leaps of a fiftieth or of twenty thousand times the true step end at the same interval"
    time = np.random.default_rng(1).uniform(EPOCHS[0], EPOCHS[-1], 200)
    np.testing.assert_array_equal(
        locate(time, 0.0, EPOCHS, step, NO_GAP), locate(time, 0.0, EPOCHS, 0.005, NO_GAP)
    )


def test_ends_belong_to_the_trajectory():
    "First and last epoch are inside, a nanosecond beyond them and NaN are not"
    time = np.array([EPOCHS[0], EPOCHS[-1], EPOCHS[0] - 1e-9, EPOCHS[-1] + 1e-9, np.nan])
    found = locate(time, 0.0, EPOCHS, 0.005, NO_GAP)
    assert found[0] == 0 and found[1] == len(EPOCHS) - 2
    assert found[2:].tolist() == [-1, -1, -1]


@pytest.mark.parametrize("constant", [-604_800.0, 1e9])
def test_the_files_own_time_is_shifted(constant):
    "Times of another system, less a constant, are found where they belong"
    time = np.random.default_rng(2).uniform(EPOCHS[0], EPOCHS[-1] - 0.01, 100)
    found = locate(time - constant, constant, EPOCHS, 0.005, NO_GAP)
    back = (time - constant) + constant
    assert (EPOCHS[found] <= back).all() and (back <= EPOCHS[found + 1]).all()


def table_of(seed, n=200, size=1e-3):
    "A table of poses, shifts and turns that change from epoch to epoch"
    rng = np.random.default_rng(seed)
    return np.hstack(
        [
            rng.uniform(-500.0, 500.0, (n, 3)),
            rng.normal(size=(n, 3)),
            size * rng.normal(size=(n, 9)),
        ]
    )


def written_out(time, xyz, table):
    "Shift + turn (x - T), all three linear in time between two epochs"
    index = np.clip(np.searchsorted(EPOCHS, time, side="right") - 1, 0, len(EPOCHS) - 2)
    weight = ((time - EPOCHS[index]) / np.diff(EPOCHS)[index])[:, None]
    row = (1 - weight) * table[index] + weight * table[index + 1]
    away = xyz - row[:, :3]
    return row[:, 3:6] + np.einsum("nij,nj->ni", row[:, 6:].reshape(-1, 3, 3), away)


def filled(time, xyz, table, is_gap=NO_GAP):
    increments = np.zeros((len(time), 3))
    inside = np.zeros(len(time), bool)
    fill_increments(time, xyz, EPOCHS, 0.005, is_gap, table, increments, inside)
    return increments, inside


@pytest.mark.parametrize("seed", range(4))
def test_increments_are_those_of_the_formula(seed):
    "To 1e-10 m at 500 m from the origin, at random times and at epochs"
    rng = np.random.default_rng(seed)
    table = table_of(seed)
    time = np.append(rng.uniform(EPOCHS[0], EPOCHS[-1], 200), EPOCHS[::10])
    xyz = rng.uniform(-500.0, 500.0, (len(time), 3))
    increments, inside = filled(time, xyz, table)
    assert inside.all()
    np.testing.assert_allclose(increments, written_out(time, xyz, table), atol=1e-10)


def test_points_without_a_pose_are_left_untouched():
    "Outside, and in a gap between its ends, increments stay what they were; on its ends not"
    is_gap = NO_GAP.copy()
    is_gap[100] = True
    middle = (EPOCHS[100] + EPOCHS[101]) / 2
    time = np.array([START - 1.0, middle, EPOCHS[100], EPOCHS[101], START + 10.0])
    increments = np.full((5, 3), 7.0)
    inside = np.zeros(5, bool)
    fill_increments(time, np.zeros((5, 3)), EPOCHS, 0.005, is_gap, table_of(3), increments, inside)
    assert inside.tolist() == [False, False, True, True, False]
    assert (increments[~inside] == 7.0).all() and (increments[inside] != 7.0).all()


# m
SCALE = np.array([0.001, 0.002, 0.0005])
OFFSET = np.array([10.0, -20.0, 3.0])


def moved(integers, time, table, constant=0.0):
    "Moved integers (n, 3), and numbers outside and beyond 32 bits"
    columns = [np.ascontiguousarray(column) for column in integers.T.astype(np.int32)]
    drive = EPOCHS, 0.005, NO_GAP, table
    counts = move_integers(*columns, SCALE, OFFSET, time, constant, *drive, np.zeros(3))
    return np.column_stack(columns), counts


@pytest.mark.parametrize("seed", range(3))
def test_integers_move_by_the_nearest_whole_increment(seed):
    "Half a scale step from the increment of the floats, each axis with its own scale"
    rng = np.random.default_rng(seed)
    table = table_of(seed)
    time = rng.uniform(EPOCHS[0], EPOCHS[-1], 300)
    integers = rng.integers(-100_000, 100_000, (300, 3))
    after, counts = moved(integers, time, table)
    wanted = written_out(time, integers * SCALE + OFFSET, table)
    error = (after - integers) * SCALE - wanted
    assert counts == (0, 0)
    assert (np.abs(error) <= SCALE / 2 + 1e-9).all()


def test_nothing_to_move_changes_no_integer():
    "A table of poses without shift or turn leaves all bits, also far from the origin"
    table = table_of(1)
    table[:, 3:] = 0.0
    integers = np.array([[LIMIT, -LIMIT, 0], [5, 6, 7]])
    after, counts = moved(integers, EPOCHS[:2].copy(), table)
    np.testing.assert_array_equal(after, integers)
    assert counts == (0, 0)


def test_what_does_not_fit_stays_and_is_counted():
    "A shift of 1 km by steps of 1 mm at the end of 32 bits: that point stays, the other moves"
    table = np.zeros((200, 15))
    table[:, 3] = 1000.0
    integers = np.array([[LIMIT - 10, 1, 2], [0, 1, 2], [0, 0, 0]])
    time = np.array([EPOCHS[3], EPOCHS[4], START - 5.0])
    after, (outside, overflow) = moved(integers, time, table)
    assert (outside, overflow) == (1, 1)
    np.testing.assert_array_equal(after[0], integers[0])
    np.testing.assert_array_equal(after[1], [1_000_000, 1, 2])
    np.testing.assert_array_equal(after[2], integers[2])
