import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.survey import Trajectory, angles_from_attitude, attitude_from_angles

START = 413_200.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM
EAST, NORTH, UP = np.eye(3)
RIGHT, FORWARD, ABOVE = np.eye(3)


def drive(gps_time, attitude=None, **sigmas):
    "10 m/s to the north, turning by 2 degrees a second"
    elapsed = np.asarray(gps_time) - START
    position = CORNER + np.outer(elapsed, [0.0, 10.0, 0.1])
    if attitude is None:
        attitude = attitude_from_angles(0.01, -0.02, np.radians(2.0) * elapsed)
    return Trajectory(np.asarray(gps_time), position, attitude, **sigmas)


@pytest.mark.parametrize(
    ("angles", "body", "map_axis"),
    [
        ((0, 0, 0), FORWARD, NORTH),
        ((0, 0, 0), RIGHT, EAST),
        ((0, 0, 90), FORWARD, EAST),  # heading clockwise from north
        ((0, 0, 90), RIGHT, -NORTH),
        ((0, 90, 0), FORWARD, UP),  # pitch nose up
        ((90, 0, 0), RIGHT, -UP),  # roll right side down
        ((90, 0, 0), ABOVE, EAST),
    ],
)
def test_attitude_follows_the_interface(angles, body, map_axis):
    "Heading is clockwise from north, positive pitch lifts the nose, positive roll drops the right"
    assert attitude_from_angles(*np.radians(angles)).apply(body) == pytest.approx(map_axis)


def test_attitude_is_the_written_product_of_rotations():
    "R_P^G = Rz(-heading) Rx(pitch) Ry(roll)"
    rng = np.random.default_rng(1)
    for roll, pitch, heading in rng.uniform(-1.5, 1.5, (50, 3)):
        about = [("z", -heading), ("x", pitch), ("y", roll)]
        z, x, y = (Rotation.from_euler(axis, angle).as_matrix() for axis, angle in about)
        assert attitude_from_angles(roll, pitch, heading).as_matrix() == pytest.approx(z @ x @ y)


def test_angles_survive_the_round_trip():
    "Roll, pitch and heading come back from the rotation to 1e-12 rad"
    rng = np.random.default_rng(2)
    roll, heading = rng.uniform(-np.pi, np.pi, 1000), rng.uniform(0, 2 * np.pi, 1000)
    pitch = rng.uniform(-1.5, 1.5, 1000)
    found = angles_from_attitude(attitude_from_angles(roll, pitch, heading))
    assert np.abs(np.subtract(found, [roll, pitch, heading])).max() < 1e-12  # rad


@pytest.mark.parametrize(
    ("gps_time", "sentence"),
    [
        ([START], "needs at least 2 epochs, this one has 1"),
        ([START, START], "1 epochs are duplicates and 0 go back"),
        ([START, START - 1.0, START + 1.0], r"1 go back in time .*413200\.000 s"),
        ([START, np.nan, START + 1.0], "1 of 3 trajectory epochs have a gps_time that is not"),
    ],
)
def test_a_trajectory_refuses_times_it_cannot_be_asked_at(gps_time, sentence):
    "Too few, repeated, reversed or missing epochs are refused, with their number"
    attitude = attitude_from_angles(np.zeros(len(gps_time)), 0.0, 0.0)
    with pytest.raises(ValueError, match=sentence):
        Trajectory(np.array(gps_time), np.zeros((len(gps_time), 3)), attitude)


@pytest.mark.parametrize("name", ["position", "position_sigma", "attitude_sigma"])
def test_a_trajectory_refuses_values_that_are_not_numbers(name):
    "Epochs with NaN are counted and refused"
    values = {"position": np.tile(CORNER, (5, 1)), name: np.full((5, 3), 0.02)}
    values[name][1:3, 2] = np.nan
    attitude = attitude_from_angles(np.zeros(5), 0.0, 0.0)
    with pytest.raises(ValueError, match=f"2 of 5 trajectory epochs have a {name} that is not"):
        Trajectory(START + np.arange(5.0), attitude=attitude, **values)


def test_positions_and_sigmas_are_linear_and_attitudes_turn_evenly():
    "Between epochs of a straight, evenly turning drive the pose is exact: 1e-9 m, 1e-9 rad"
    epochs = START + np.arange(0.0, 20.0, 0.5)
    sigma = np.outer(epochs - START, [0.1, 0.2, 0.3])
    level = attitude_from_angles(0.0, 0.0, np.radians(2.0) * (epochs - START))
    trajectory = drive(epochs, level, position_sigma=sigma, attitude_sigma=sigma / 100)
    asked = START + np.random.default_rng(3).uniform(0.0, 19.5, 200)  # in no order
    found = trajectory.at(asked)
    assert np.abs(found.position - drive(np.sort(asked)).position[_rank(asked)]).max() < 1e-9
    turned = attitude_from_angles(0.0, 0.0, np.radians(2.0) * (asked - START))
    assert (found.attitude * turned.inv()).magnitude().max() < 1e-9  # rad
    assert found.position_sigma == pytest.approx(np.outer(asked - START, [0.1, 0.2, 0.3]))
    assert found.attitude_sigma == pytest.approx(found.position_sigma / 100)


def _rank(values):
    return np.argsort(np.argsort(values))


def test_epochs_return_themselves():
    "Asked at its own epochs a trajectory answers with its own poses"
    trajectory = drive(START + np.arange(0.0, 5.0, 0.1))
    found = trajectory.at(trajectory.gps_time)
    assert np.array_equal(found.position, trajectory.position)
    assert (found.attitude * trajectory.attitude.inv()).magnitude().max() < 1e-12  # rad
    assert found.position_sigma is None and found.attitude_sigma is None


def gappy():
    "Three segments: 0 to 2 s, 5 to 7 s, 20 to 22 s"
    parts = [START + begin + np.arange(0.0, 2.05, 0.1) for begin in (0.0, 5.0, 20.0)]
    return drive(np.concatenate(parts))


def test_gaps_are_steps_of_more_than_ten_medians():
    "Of 0.1 s steps, 1.1 s is a gap and 0.9 s is none"
    assert gappy().gaps - START == pytest.approx(np.array([[2.0, 5.0], [7.0, 20.0]]))
    for step, gaps in ((0.9, 0), (1.1, 1)):
        epochs = np.append(np.arange(0.0, 2.05, 0.1), 2.0 + step + np.arange(0.0, 2.05, 0.1))
        assert len(drive(START + epochs).gaps) == gaps


def test_segments_count_from_zero_and_gaps_belong_to_none():
    "Each time knows its segment, ends included; gaps and the outside give -1"
    asked = START + np.array([-0.1, 0.0, 1.95, 2.0, 2.01, 4.99, 5.0, 6.0, 10.0, 20.0, 22.0, 22.1])
    expected = [-1, 0, 0, 0, -1, -1, 1, 1, -1, 2, 2, -1]
    trajectory = gappy()
    asked[[3, 10]] = trajectory.gps_time[[20, -1]]  # the very ends
    assert trajectory.segment(asked).tolist() == expected


@pytest.mark.parametrize("asked", [-0.001, 3.0, 22.2])
def test_nothing_is_extrapolated_or_carried_over_a_gap(asked):
    "A time before, after or in a gap is refused, with the span and the number of gaps"
    sentence = r"1 of 2 times lie outside the trajectory \[413200.000, 413222.000\] s .* 2 gaps"
    with pytest.raises(ValueError, match=sentence):
        gappy().at(START + np.array([1.0, asked]))
