from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.trajectories import read_poses, write_trajectory_csv
from mlscorr.simulate import SETTINGS, Scenario, SceneScenario
from mlscorr.simulate.drive import drive
from mlscorr.simulate.drive._pace import Pace
from mlscorr.simulate.drive._path import u_turn_path
from mlscorr.simulate.scenario import DriveScenario, PassScenario
from mlscorr.survey import Trajectory
from tests.beds.shared import shared

ORIGIN = np.array(Scenario().origin)
FORWARD = PassScenario(lateral=1.6)
BACK = PassScenario(direction="back", lateral=-1.6, pause=40.0, speed=6.0)
STOPS = ((10.0, 6.0), (40.0, 5.0))


def driven(seed=1, kind="street", **parts):
    scenario = Scenario(scene=SceneScenario(kind=kind), drive=DriveScenario(**parts))
    return drive(scenario, np.random.default_rng(seed))


def speed_and_course(trajectory):
    "Horizontal speed (m/s) and course (rad) between epochs"
    step = np.diff(trajectory.position, axis=0)
    seconds = np.diff(trajectory.gps_time)
    return np.hypot(step[:, 0], step[:, 1]) / seconds, np.arctan2(step[:, 0], step[:, 1])


def turned(a, b):
    "Smallest difference of directions. Units: deg"
    return np.degrees(np.abs(np.mod(a - b + np.pi, 2 * np.pi) - np.pi))


def heading_off_course(trajectory, faster=0.5):
    "Difference of heading and course while the vehicle moves. Units: deg"
    speed, course = speed_and_course(trajectory)
    heading = angles_from_attitude(trajectory.attitude)[2][:-1]
    return turned(heading, course)[speed > faster]


def test_the_speed_profile_integrates_to_the_distance():
    "Path length of the trajectory, integral of the speed and length of the way agree to 0.2 %"
    _, length, (trajectory,) = driven(duration=60.0, stops=STOPS)
    travelled = np.hypot(*np.diff(trajectory.position[:, :2], axis=0).T).sum()
    assert travelled == pytest.approx(length, rel=0.005)  # weaving adds a little
    elapsed = np.arange(6001) / 100.0
    pace = Pace(8.0, 0.3, 30.0, STOPS)
    assert pace.distance(elapsed)[-1] == pytest.approx(pace.speed(elapsed).sum() / 100.0, rel=1e-3)


def test_stops_stand_still():
    "In a stop nothing moves, not even the springs; before and after, braking is comfortable"
    _, _, (trajectory,) = driven(duration=60.0, stops=STOPS)
    elapsed = trajectory.gps_time - trajectory.gps_time[0]
    for start, duration in STOPS:
        rest = (elapsed > start + 0.02) & (elapsed < start + duration - 0.02)
        assert np.ptp(trajectory.position[rest], axis=0).max() == 0.0
        assert (
            trajectory.attitude[rest] * trajectory.attitude[rest][0].inv()
        ).magnitude().max() < (1e-9)
    speed, _ = speed_and_course(trajectory)
    assert np.abs(np.gradient(speed, 0.01)).max() < 1.6 * SETTINGS.comfort  # m/s^2
    moving = np.ones(len(speed), dtype=bool)
    for start, duration in STOPS:
        moving &= (elapsed[:-1] < start - 0.5) | (elapsed[:-1] > start + duration + 0.5)
    assert speed[moving].min() > 0.0


def test_a_first_pass_lasts_as_long_as_asked_at_the_pose_rate():
    "Epochs are even, from start_time for the duration"
    _, _, (trajectory,) = driven(duration=30.0, pose_rate=50.0)
    assert len(trajectory) == 1501
    assert trajectory.gps_time[0] == Scenario().start_time
    np.testing.assert_allclose(np.diff(trajectory.gps_time), 0.02, atol=1e-9)  # s


def test_the_drive_starts_at_the_origin():
    "The first epoch is at the origin horizontally but for the weaving, 1.8 m above the crown"
    _, _, (trajectory,) = driven()
    first = trajectory.position[0] - ORIGIN
    assert np.hypot(*first[:2]) < 0.3  # m
    assert 1.75 < first[2] < 1.95


@pytest.mark.parametrize("turns", [0.0, 15.0, 90.0])
def test_the_way_turns_as_far_as_stated(turns):
    "The line's heading swings to both sides by up to the stated degrees, and never further"
    line, length, _ = driven(turns=turns, duration=240.0)
    east, north, _ = line.curve(np.arange(0.0, length), 1).T
    heading = np.degrees(np.unwrap(np.arctan2(east, north)))
    assert np.ptp(heading) <= 2 * turns + 0.1
    assert np.ptp(heading) >= 1.3 * turns


def test_bends_are_drivable():
    "Sideways acceleration stays below 3 m/s^2 even where the way turns most, and on a motorway"
    for parts in ({"turns": 90.0}, {"speed": 33.0, "turns": 30.0}):
        _, _, (trajectory,) = driven(**parts)
        velocity = np.gradient(trajectory.position[:, :2], 0.01, axis=0)
        speed = np.hypot(*velocity.T)
        course = np.unwrap(np.arctan2(*velocity.T))
        assert np.abs(speed * np.gradient(course, 0.01)).max() < 3.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_vehicles_look_where_they_go(seed):
    "Heading is the course over ground to 1 deg on forward and backward passes, pitch the grade"
    _, _, trajectories = driven(seed, passes=(FORWARD, BACK), turns=30.0)
    for trajectory in trajectories:
        assert heading_off_course(trajectory).max() < 1.0  # deg
        roll, pitch, _ = np.degrees(angles_from_attitude(trajectory.attitude))
        step = np.diff(trajectory.position, axis=0)
        grade = np.degrees(np.arctan2(step[:, 2], np.hypot(step[:, 0], step[:, 1])))
        assert np.sqrt(np.mean((pitch[1:] - grade) ** 2)) < 1.0
        assert np.abs(roll).max() < 4.0


def test_passes_follow_each_other_after_their_pauses():
    "Passes are in time order, apart by their pause, and the second faces the other way"
    line, length, (first, second) = driven(passes=(FORWARD, BACK), turns=20.0)
    assert second.gps_time[0] - first.gps_time[-1] == pytest.approx(40.0)  # s
    ahead = first.attitude[3000].apply([0.0, 1.0, 0.0])
    near = np.argmin(np.linalg.norm(second.position - first.position[3000], axis=1))
    assert ahead @ second.attitude[near].apply([0.0, 1.0, 0.0]) < -0.99
    for trajectory, lateral in ((first, 1.6), (second, -1.6)):
        s = np.linspace(5.0, length - 5.0, 200)
        lane = line.place(s, lateral, 0.0)[:, :2] + ORIGIN[:2]
        distance = np.linalg.norm(trajectory.position[::10, None, :2] - lane[None], axis=2)
        assert distance.min(axis=0).max() < 0.6  # m, with weaving and the spacing of epochs
    assert np.hypot(*(second.position[-1] - ORIGIN)[:2]) < 2.0  # drives all the way back
    np.testing.assert_allclose(np.median(speed_and_course(second)[0]), 6.0, rtol=0.12)


def test_another_pass_leaves_the_first_as_it_was():
    "Each pass has its own random stream"
    _, _, (alone,) = driven(passes=(FORWARD,))
    _, _, (first, _) = driven(passes=(FORWARD, BACK))
    np.testing.assert_array_equal(first.position, alone.position)


@pytest.mark.parametrize("kind", ["street", "river"])
@pytest.mark.parametrize("direction", ["forward", "back"])
def test_a_u_turn_drives_the_way_back_in_the_same_pass(direction, kind):
    "Out and home in one pass with a turn of realistic radius and speed at the way's end"
    one = PassScenario(direction=direction, lateral=1.6 if direction == "forward" else -1.6)
    line, length, (trajectory,) = driven(kind=kind, u_turn=True, duration=100.0, passes=(one,))
    assert len(trajectory) == 10001
    assert np.hypot(*(trajectory.position[-1] - trajectory.position[0])[:2]) < 6.0  # m
    middle = len(trajectory) // 2
    ends = line.curve(np.array([0.0, length]))[:, :2] + ORIGIN[:2]
    away = np.linalg.norm(trajectory.position[:, None, :2] - ends[None], axis=2)
    assert away[:, int(direction == "forward")].min() < 12.0
    velocity = np.gradient(trajectory.position[:, :2], 0.01, axis=0)
    speed = np.hypot(*velocity.T)
    course = np.unwrap(np.arctan2(*velocity.T))
    rate = np.abs(np.gradient(course, 0.01))
    assert np.degrees(abs(course[-1] - course[0])) == pytest.approx(180.0, abs=15.0)
    turning = rate > 0.15  # rad/s
    assert turning.any()
    assert (speed / np.maximum(rate, 1e-9))[turning].min() > 4.0  # m, radius
    assert (speed * rate).max() < 2.0 * SETTINGS.cornering + 1.5
    assert heading_off_course(trajectory).max() < 1.5
    assert abs(int(np.argmax(turning)) - middle) < 2500


@pytest.mark.parametrize("lateral", [-4.0, -1.5, 0.0, 1.5, 9.0])
def test_a_u_turn_ends_in_the_mirrored_lane(lateral):
    "It starts and ends at the way's end, on mirrored sides, and stays within its radius"
    along, right = u_turn_path(lateral, 6.0)
    np.testing.assert_allclose(along[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(right[[0, -1]], [lateral, -lateral], atol=1e-9)
    assert np.abs(right).max() < max(6.0, abs(lateral)) + 0.5
    assert along.min() > -0.1


@pytest.mark.parametrize("kind", ["street", "river"])
def test_attitude_and_velocity_are_continuous(kind):
    "No epoch turns by more than 0.5 deg from the one before, nor accelerates by more than 1 g"
    _, _, trajectories = driven(
        kind=kind, u_turn=True, duration=90.0, stops=((5.0, 5.0),), passes=(FORWARD, BACK)
    )
    for trajectory in trajectories:
        turn = (trajectory.attitude[:-1].inv() * trajectory.attitude[1:]).magnitude()
        assert np.degrees(turn).max() < 0.5
        acceleration = np.diff(trajectory.position, 2, axis=0) / 1e-4
        assert np.abs(acceleration).max() < 9.81  # m/s^2


def test_a_boat_keeps_its_level():
    "On water the height stays within the waves, and the boat rolls more than a car"
    _, _, (boat,) = driven(kind="river", speed=3.0)
    _, _, (car,) = driven()
    assert np.ptp(boat.position[:, 2]) < 0.4  # m
    roll = [np.std(angles_from_attitude(t.attitude)[0]) for t in (boat, car)]
    assert roll[0] > 1.5 * roll[1]


def test_the_same_seed_drives_the_same_way():
    "Every epoch follows from the seed"
    first, again, other = (driven(seed)[2][0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.position, again.position)
    np.testing.assert_array_equal(first.attitude.as_quat(), again.attitude.as_quat())
    assert np.abs(first.position[-1] - other.position[-1]).max() > 1.0


def test_drives_that_contradict_themselves_are_refused():
    "Too short for a U-turn, a stop after the end, a lane off the scene, no pause: one sentence"

    def refused(match, **parts):
        with pytest.raises(ValueError, match=match) as caught:
            driven(**parts)
        assert "\n" not in str(caught.value)

    refused(
        r"A drive of [\d.]+ m in 5.0 s is too short: \d+ m are needed for a U-turn",
        duration=5.0,
        u_turn=True,
    )
    refused(r"is too short", duration=20.0, stops=((0.0, 20.0),))
    refused(
        "A stop of 10.0 s from 55.0 s is outside the first pass of 60.0 s",
        stops=((55.0, 10.0),),
        passes=(FORWARD, BACK),
    )
    refused(
        "500.0 m from the center line is outside the scene", passes=(PassScenario(lateral=500),)
    )
    close = BACK.model_copy(update={"pause": 0.05})
    refused(r"A pause of 0.05 s .* more than 0.1 s", passes=(FORWARD, close))
    refused("fewer than 3 epochs", duration=0.01)
    refused("remove stops, u_turn and passes", file=Path("a.csv"), u_turn=True)


# A given path


def followed(path, kind="street", **parts):
    scenario = Scenario(scene=SceneScenario(kind=kind), drive=DriveScenario(file=path, **parts))
    return drive(scenario, np.random.default_rng(1))


def misfit(path, trajectories):
    "Distance (n, 3) of the trajectories from the file's positions, moved to the origin. Units: m"
    poses = read_poses(path)
    elapsed = poses.gps_time - poses.gps_time[0] + Scenario().start_time
    position = poses.position - poses.position[0] + ORIGIN
    rows = []
    for trajectory in trajectories:
        span = trajectory.gps_time[[0, -1]]
        inside = (elapsed >= span[0]) & (elapsed <= span[1])
        rows.append(trajectory.at(elapsed[inside]).position - position[inside])
    rows = np.vstack(rows)
    return rows - [0.0, 0.0, rows[0, 2]]


@pytest.mark.parametrize(
    "parts, horizontal, vertical",  # m, RMS
    [
        (("data", "vehicle_poses", "novatel-enu.csv"), 0.01, 0.02),
        (("data", "vehicle_poses", "boreas-2021-08-05-13-34_lidar_poses.csv"), 0.01, 0.03),
        (("data", "real_pos_error", "GNSS_RTK.pos"), 0.04, 0.10),  # its own noise
        (("surveys", "wuhan_drive", "trajectory.csv"), 0.02, 0.03),
    ],
)
def test_given_paths_are_followed_within_centimetres(parts, horizontal, vertical):
    "Real drives keep their shape and timing; the line follows them; the attitude is continuous"
    path = shared(*parts)
    line, length, trajectories = followed(path)
    error = misfit(path, trajectories)
    assert np.sqrt((error[:, :2] ** 2).sum(axis=1).mean()) < horizontal
    assert error[:, 2].std() < vertical
    first = trajectories[0]
    assert first.gps_time[0] == Scenario().start_time
    np.testing.assert_allclose(first.position[0, :2], ORIGIN[:2], atol=1e-6)
    s = np.arange(0.0, length, 0.5)
    assert np.abs(np.linalg.norm(line.curve(s, 1)[:, :2], axis=1) - 1.0).max() < 0.05
    for trajectory in trajectories:
        assert line.distance(trajectory.position[::50] - ORIGIN).max() < 3.0  # m, cut corners
        turn = (trajectory.attitude[:-1].inv() * trajectory.attitude[1:]).magnitude()
        assert np.degrees(turn).max() < 3.0
        assert np.median(heading_off_course(trajectory, 3.0)) < 3.0


def test_an_sbet_is_followed_in_its_own_zone():
    "An airborne SBET of another UTM zone moves to the origin with its attitude"
    path = shared("data", "leeward_sbet", "sbet.out")
    _, length, (trajectory,) = followed(path)
    poses = read_poses(path)
    assert length > 50.0  # m in 1 s
    moved = poses.position[-1] - poses.position[0]
    last = trajectory.at(trajectory.gps_time[-1:]).position[0] - trajectory.position[0]
    np.testing.assert_allclose(last, moved, atol=0.6)  # m, to the last epoch of the pose rate
    assert (trajectory.attitude[0].inv() * poses.attitude[0]).magnitude() < 1e-6


def own_csv(path, gap=0.0, speed=8.0):
    "A drive with a stop, as our own CSV; with a gap it has two passes"
    elapsed = np.arange(0.0, 40.0, 0.05)
    distance = speed * np.where(elapsed < 15, elapsed, np.maximum(15.0, elapsed - 5.0))
    place = np.column_stack([60 * np.sin(distance / 60), 60 - 60 * np.cos(distance / 60)])
    heading = np.pi / 2 - distance / 60
    times = 200_000.0 + elapsed + np.where(elapsed > 20, gap, 0.0)
    position = np.column_stack([4e5 + place[:, 0], 5e6 + place[:, 1], 100 + 0.01 * distance])
    attitude = attitude_from_angles(0.02 * np.sin(elapsed), 0.01, heading)
    write_trajectory_csv(path, Trajectory(times, position, attitude))
    return path


def test_a_csv_keeps_its_attitude(tmp_path):
    "With a known convention roll, pitch and heading are used as given"
    path = own_csv(tmp_path / "own.csv")
    _, _, (trajectory,) = followed(path)
    poses = read_poses(path)
    elapsed = poses.gps_time - poses.gps_time[0] + Scenario().start_time
    inside = elapsed <= trajectory.gps_time[-1]
    same = trajectory.at(elapsed[inside]).attitude.inv() * poses.attitude[inside]
    assert isinstance(same, Rotation)
    assert np.degrees(same.magnitude()).max() < 1e-3


def test_gaps_of_a_given_file_separate_passes(tmp_path):
    "A pause in the file is a gap between two trajectories, which follow each other in time"
    _, length, (first, second) = followed(own_csv(tmp_path / "own.csv", gap=30.0))
    assert second.gps_time[0] - first.gps_time[-1] == pytest.approx(30.05, abs=0.02)  # s
    assert length == pytest.approx(8.0 * 34.95, rel=0.02)


def test_a_stop_in_a_given_path_adds_no_length(tmp_path):
    "The centre line drops the standing still, and the course of a path without attitude holds"
    path = tmp_path / "course.csv"
    elapsed = np.arange(0.0, 60.0, 0.1)
    north = 8.0 * np.where(elapsed < 20, elapsed, np.maximum(20.0, elapsed - 20.0))
    jitter = 0.005 * np.random.default_rng(4).standard_normal((len(elapsed), 2))
    rows = ["GPSTime,easting,northing,altitude"]
    rows += [
        f"{int(1e6 * (1.6e9 + t))},{4e5 + x:.4f},{5e6 + y + n:.4f},100.0"
        for t, n, (x, y) in zip(elapsed, north, jitter, strict=True)
    ]
    path.write_text("\n".join(rows) + "\n")
    _, length, (trajectory,) = followed(path)
    assert length == pytest.approx(north[-1], abs=1.5)  # m
    heading = angles_from_attitude(trajectory.attitude)[2]
    assert turned(heading, 0.0).max() < 3.0  # deg


@pytest.mark.parametrize(
    "name, text, match",
    [
        ("a.txt", "x", "unknown suffix"),
        ("a.pos", "hello world\n", "not a table of time, latitude"),
        ("b.pos", "1 532000 3374000 40\n2 532000 3374000 40\n", "not latitude and longitude"),
        ("c.pos", "1 30 114 40\n1 30 114 40\n2 30 114 40\n", "must increase"),
        ("d.pos", "1 30 114 40\n", "needs at least 2"),
        (
            "a.csv",
            "gps_time,x,y,z\n1,2,three,4\n",
            r"Line 2 of .*a.csv has 'three' where .*column 3",
        ),
        (
            "b.csv",
            "gps_time,x,y,z\n1,2,3,4\n2,2,3,nan\n",
            "1 of 2 epochs of .* are not numbers",
        ),
        ("c.csv", "t,a,b\n1,2,3\n", "has no column easting"),
    ],
)
def test_files_that_are_no_path_are_refused(name, text, match, tmp_path):
    "Each refusal is one sentence that names the file"
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=match):
        read_poses(tmp_path / name)


def test_a_path_that_stands_still_is_refused(tmp_path):
    "Without movement there is no way to build a scene along"
    rows = [f"{t},30.0,114.0,40.0".replace(",", " ") for t in range(60)]
    (tmp_path / "still.pos").write_text("\n".join(rows) + "\n")
    with pytest.raises(ValueError, match=r"0\.0 m long"):
        followed(tmp_path / "still.pos")
