"""Trajectories: refused where they can't be asked, interpolated between epochs, with gaps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Trajectory, control_epochs

START = 413_200.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM


def drive(gps_time, attitude=None, **others):
    "10 m/s to the north, turning by 2 degrees a second"
    elapsed = np.asarray(gps_time) - START
    position = CORNER + np.outer(elapsed, [0.0, 10.0, 0.1])
    if attitude is None:
        attitude = attitude_from_angles(0.01, -0.02, np.radians(2.0) * elapsed)
    return Trajectory(np.asarray(gps_time), position, attitude, **others)


@pytest.mark.parametrize(
    ("gps_time", "sentence"),
    [
        ([START], "needs at least 2 epochs.*this one has 1"),
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
    sentence = r"1 of 2 times are outside the trajectory \[413200.000, 413222.000\] s .* 2 gaps"
    with pytest.raises(ValueError, match=sentence):
        gappy().at(START + np.array([1.0, asked]))


def test_passes_are_what_lies_between_the_gaps():
    "Three segments have three spans, whose times add up to what was recorded"
    passes = gappy().passes
    assert passes - START == pytest.approx(np.array([[0.0, 2.0], [5.0, 7.0], [20.0, 22.0]]))
    assert gappy().recorded_time(START, START + 22.0) == pytest.approx(6.0)  # s
    assert gappy().recorded_time(START + 1.0, START + 6.0) == pytest.approx(2.0)


def test_a_gap_counts_only_where_it_lies_whole_in_the_time_asked():
    "From inside of a gap on the time runs on"
    assert gappy().recorded_time(START + 3.0, START + 7.0) == pytest.approx(4.0)  # s


@pytest.mark.parametrize(
    ("times", "interval"), [([2.0, 5.0], 6.0), ([2.0, 20.0], 2.0), ([6.0], 6.0)]
)
def test_epochs_with_nothing_recorded_between_them_are_as_good_as_one(times, interval):
    """From the end of one pass to the start of the next there is no interval but all the drive,
    whose gaps count no more than those between two points.
    """
    assert gappy().control_interval(START + np.array(times)) == pytest.approx(interval)  # s


def test_targets_within_a_second_share_an_epoch():
    "Of times in any order those within a second of the last one kept are left out"
    epochs = control_epochs(START + np.array([5.0, 0.0, 0.9, 1.5, 9.0, 5.5]))
    assert epochs - START == pytest.approx([0.0, 1.5, 5.0, 9.0])  # s


def test_sessions_part_a_trajectory_where_steps_do_not():
    "From one session to the next is a gap of 0.1 s; the median of each says what a gap in it is"
    time = START + np.concatenate([np.arange(0.0, 10.0, 0.1), np.arange(10.0, 60.0, 2.0)])
    session = np.repeat([3, 1], [100, 25])
    whole = drive(time, session=session)
    assert whole.passes == pytest.approx(START + np.array([[0.0, 9.9], [10.0, 58.0]]))
    assert len(drive(time).passes) == 25  # each step of 2 s is twenty median ones
    assert whole.at(START + np.array([9.85, 11.0])).session.tolist() == [3, 1]
    with pytest.raises(ValueError, match="1 of 1 times are outside the trajectory"):
        whole.at(START + 9.95)


def test_some_epochs_keep_all_that_is_known_of_them():
    "Position, attitude, sigmas and session of chosen epochs are theirs; what isn't known stays so"
    gps_time = START + np.arange(6.0)
    sigma = np.linspace(0.01, 0.06, 18).reshape(6, 3)
    whole = drive(gps_time, position_sigma=sigma, session=np.array([0, 0, 0, 1, 1, 1]))
    for rows in (slice(1, 4), np.array([0, 2, 5]), gps_time > START + 2.5):
        part = whole.select(rows)
        assert np.array_equal(part.gps_time, gps_time[rows])
        assert np.array_equal(part.position, whole.position[rows])
        assert np.array_equal(part.attitude.as_quat(), whole.attitude[rows].as_quat())
        assert np.array_equal(part.position_sigma, sigma[rows])
        assert np.array_equal(part.session, whole.session[rows])
        assert part.attitude_sigma is None


@pytest.mark.parametrize(
    ("positions", "attitudes", "counts"),
    [
        (2, Rotation.identity(3), "gps_time 3, position 2, attitude 3"),
        (3, Rotation.identity(2), "gps_time 3, position 3, attitude 2"),
        (3, Rotation.identity(), "gps_time 3, position 3, attitude 1"),
    ],
)
def test_each_epoch_has_a_pose(positions, attitudes, counts):
    """Three times with two positions or attitudes are no trajectory."""
    with pytest.raises(ValueError, match=counts):
        Trajectory(np.arange(3.0), np.zeros((positions, 3)), attitudes)


def test_epochs_with_points_about_them_are_known_by_seconds():
    "20 s of points in the first of two passes: to the next epoch on both sides, and kept by select"
    time = 413_200.0 + np.concatenate([np.arange(0.0, 100.0, 0.1), np.arange(150.0, 200.0, 0.1)])
    place = np.tile([528_000.0, 3_379_000.0, 20.0], (len(time), 1))
    trajectory = Trajectory(time, place, Rotation.identity(len(time)))
    assert trajectory.scanned_passes == pytest.approx(trajectory.passes)
    scanned = trajectory.scanned_at(np.arange(413_210, 413_230))
    assert scanned.scanned_passes - 413_200.0 == pytest.approx(np.array([[9.9, 30.0]]), abs=1e-6)
    assert scanned.select(slice(150, None)).scanned_passes[0, 0] == pytest.approx(413_215.0)
    end = trajectory.scanned_at(np.array([413_299])).scanned_passes - 413_200.0
    assert end == pytest.approx(np.array([[98.9, 99.9]]), abs=1e-6)


def test_duration_and_length_leave_gaps_out():
    "Two drives of 10 s at 10 m/s, 50 s apart: 20 s and 200 m, to the last epoch of each"
    time = np.concatenate([np.arange(0.0, 10.05, 0.1), np.arange(60.0, 70.05, 0.1)])
    recorded = drive(START + time)
    assert recorded.duration == pytest.approx(20.0, abs=1e-6)  # s
    assert recorded.length == pytest.approx(200.0, abs=0.1)  # m


def test_tiles_of_one_drive_are_one_pass():
    """Files that go on where another ends are one pass, in any order of their points; a gap of
    the trajectory and a pause of a minute each start another
    """
    rng = np.random.default_rng(3)
    first = np.arange(0.0, 100.05, 0.1)
    second = np.arange(160.0, 400.05, 0.1)
    recorded = drive(START + np.concatenate([first, second]))

    def tile(begin, end):
        return START + rng.uniform(begin, end, 65)

    tiles = [tile(20 * i, 20 * i + 20) for i in range(5)]
    assert recorded.count_passes(tiles, 2.0) == 1
    assert recorded.count_passes(tiles[::-1], 2.0) == 1
    assert recorded.count_passes([*tiles, tile(160, 200)], 2.0) == 2  # beyond the gap
    both = np.concatenate([tile(80, 100), tile(160, 180)])  # a tile that both drives cross
    assert recorded.count_passes([*tiles[:4], both, tile(180, 200)], 2.0) == 2
    assert recorded.count_passes([tile(160, 200), tile(260, 300)], 2.0) == 2  # a pause of 60 s
    assert recorded.count_passes([tile(160, 200), tile(160, 200)], 2.0) == 1  # two scanners
    assert recorded.count_passes([tile(120, 140)], 2.0) == 0  # in the gap
