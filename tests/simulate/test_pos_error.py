from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.trajectories import PosErrorSeries, read_pos_error_series
from mlscorr.simulate.pos import _gnss as gnss
from mlscorr.simulate.pos import _inertial as inertial
from mlscorr.simulate.pos import _kalman as kalman
from mlscorr.simulate.pos import given_error, navigation, pos_error, record
from mlscorr.simulate.pos._inertial import GRADES, GRAVITY, MEMS, TACTICAL
from mlscorr.simulate.pos._kalman import Measurement
from mlscorr.simulate.pos.navigation import aligned_poses
from mlscorr.simulate.scenario import PosScenario
from mlscorr.survey import Trajectory
from tests.beds.shared import shared

pytestmark = pytest.mark.long

START = 357_700.0  # s of the week
ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m
# s, an outage of 60 s
LOST = 20.0
BACK = 80.0
SEEDS = range(30)
REAL_TIME = {"processing": "filtered", "odometer": True}  # as the real series was made


def drive(duration, rate=100.0):
    "A bent street, speed 6 to 10 m/s, a car that rolls a little"
    elapsed = np.arange(round(duration * rate) + 1) / rate
    speed = 8 + 2 * np.sin(2 * np.pi * elapsed / 23)
    heading = 0.7 + 0.3 * np.sin(2 * np.pi * elapsed / 50)
    course = np.column_stack([np.sin(heading), np.cos(heading), 0 * heading + 0.02])
    way = ORIGIN + np.cumsum(speed[:, None] * course, axis=0) / rate
    attitude = attitude_from_angles(0.01 * np.sin(elapsed), 0.02, heading)
    return Trajectory(START + elapsed, way, attitude)


SHORT = drive(30.0)
LONG = drive(100.0)
ELAPSED = np.arange(len(LONG)) / 100.0
IN_OUTAGE = (ELAPSED > LOST) & (ELAPSED < BACK)


def errors(grade, **more):
    scenario = PosScenario(grade=grade, outages=((LOST, BACK - LOST),), **more)
    return [pos_error(LONG, scenario, np.random.default_rng(seed)) for seed in SEEDS]


@pytest.fixture(scope="module")
def mems():
    return errors("mems")


@pytest.fixture(scope="module")
def tactical():
    return errors("tactical")


@pytest.fixture(scope="module")
def real_time():
    return errors("mems", **REAL_TIME)


def largest(drives):
    "Largest 3D position error in the outage of each drive, m"
    return np.array([np.linalg.norm(d.position[IN_OUTAGE], axis=1).max() for d in drives])


def squared(drives):
    "Normalised error squared of the position (drives, epochs), from the reported sigmas"
    return np.array([((d.position / d.position_sigma) ** 2).sum(axis=1) for d in drives])


def test_motion_of_a_circle_is_as_the_textbook_says():
    "At 10 m/s on a circle of 50 m a car feels 2 m/s^2 inward, gravity, and turns by 0.2 rad/s"
    angle = 0.2 * np.arange(101) / 10.0
    position = 50.0 * np.column_stack([-np.cos(angle), np.sin(angle), 0 * angle])
    moved = inertial.motion(0.1, position, attitude_from_angles(0.0, 0.0, angle))
    inner = slice(1, -1)
    force = moved.attitude.inv().apply(moved.force)[inner]
    np.testing.assert_allclose(force, np.tile([2.0, 0.0, GRAVITY], (98, 1)), atol=0.002)  # m/s^2
    np.testing.assert_allclose(moved.rate, np.tile([0.0, 0.0, -0.2], (100, 1)), atol=1e-9)


def test_biases_grow_as_powers_of_time():
    "b t^2 / 2 for an accelerometer, g b t^3 / 6 for a level gyro, to 0.5 % after 60 s"
    epochs = 601
    still = inertial.motion(0.1, np.zeros((epochs, 3)), Rotation.identity(epochs))
    start = np.zeros(15)
    # m/s^2 to the right; rad/s about the right axis
    start[12] = 1e-3
    start[9] = 1e-5
    state = inertial.propagate(inertial.transitions(still), np.zeros((epochs - 1, 15)), start)
    east, north, _ = state[-1, :3]
    assert east == pytest.approx(1e-3 * 60**2 / 2, rel=0.005)
    assert north == pytest.approx(-GRAVITY * 1e-5 * 60**3 / 6, rel=0.005)  # nose up: backward


def test_an_attitude_error_tilts_the_specific_force_the_right_way():
    "The recorded force is R_rec f: the velocity error follows from R_rec = Exp(turn) R alone"
    rng = np.random.default_rng(1)
    turn = 1e-4 * rng.standard_normal(3)
    attitude = Rotation.from_rotvec([0.1, -0.2, 2.0])
    moved = inertial.Motion(
        0.01, np.array([[1.0, 2.0, 9.8]]), np.zeros((1, 3)), Rotation.concatenate([attitude])
    )
    start = np.zeros(15)
    start[6:9] = turn
    state = inertial.propagate(inertial.transitions(moved), np.zeros((1, 15)), start)
    felt = attitude.inv().apply(moved.force[0])
    wrong = (Rotation.from_rotvec(turn) * attitude).apply(felt) - moved.force[0]
    np.testing.assert_allclose(state[1, 3:6], 0.01 * wrong, atol=1e-8)  # m/s


def test_the_smoother_equals_dense_least_squares():
    "Filter and smoother give what conditioning the joint Gaussian of all epochs gives"
    rng = np.random.default_rng(2)
    epochs = 12
    moved = inertial.motion(0.5, SHORT.position[:600:50] - ORIGIN, SHORT.attitude[:600:50])
    transition = inertial.transitions(moved)
    noise = MEMS.densities**2 * 0.5 + 1e-12
    start = inertial.start_sigma(MEMS) ** 2
    design = np.eye(3, 15)
    covariance = 0.02**2 * np.eye(3)
    seen = {k: rng.standard_normal(3) * 0.05 for k in (0, 3, 7, 11)}
    given = {k: (Measurement(design, v, covariance),) for k, v in seen.items()}
    filtered, predicted = kalman.kalman_filter(transition, noise, start, given)
    smoothed = kalman.smooth(transition, filtered, predicted)

    joint = np.zeros((epochs, 15, epochs, 15))
    joint[0, :, 0] = np.diag(start)
    for k in range(1, epochs):
        for j in range(k):
            joint[k, :, j] = transition[k - 1] @ joint[k - 1, :, j]
            joint[j, :, k] = joint[k, :, j].T
        joint[k, :, k] = transition[k - 1] @ joint[k - 1, :, k - 1] @ transition[k - 1].T
        joint[k, :, k] += np.diag(noise)
    joint = joint.reshape(15 * epochs, -1)
    rows = np.concatenate([15 * k + np.arange(3) for k in seen])
    gain = np.linalg.solve(joint[np.ix_(rows, rows)] + 0.02**2 * np.eye(len(rows)), joint[rows]).T
    state = (gain @ np.concatenate(list(seen.values()))).reshape(epochs, 15)
    variance = np.diag(joint - gain @ joint[rows]).reshape(epochs, 15)
    sigma = np.sqrt(variance)
    assert np.abs((smoothed.state - state) / sigma).max() < 1e-5
    ratio = np.diagonal(smoothed.covariance, axis1=1, axis2=2) / variance
    np.testing.assert_allclose(ratio, 1.0, atol=1e-5)


@pytest.mark.parametrize("grade", ["tactical", "mems"])
def test_the_sigmas_are_right_when_filter_and_truth_agree(grade, monkeypatch):
    "Open sky, figures known: normalised errors squared lie within their 95 % band over seeds"
    known = {"reflected": 0.0, "suspect": np.inf, "caution": 1.0, "doubt": 1.0}  # white errors
    monkeypatch.setattr(gnss, "RECEIVER", replace(gnss.RECEIVER, **known))
    tuned = replace(navigation.SETTINGS, mistuning=1.0, unmodelled=1.0)
    monkeypatch.setattr(navigation, "SETTINGS", tuned)
    imu = replace(GRADES[grade], gyro_scale=0.0, accelerometer_scale=0.0, misalignment=0.0)
    position = []
    attitude = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        navigated = navigation.navigate(SHORT, PosScenario(grade=grade), imu, rng)
        error = navigated.at([START + 15.0])
        position.append(((error.position / error.position_sigma) ** 2).sum())
        attitude.append(((error.attitude / error.attitude_sigma) ** 2).sum())
    low, high = chi2.interval(0.95, 3 * 40)
    for square in (position, attitude):
        assert low < np.sum(square) < high


@pytest.mark.parametrize("grade", ["tactical", "mems"])
def test_mistuned_software_is_nearly_right_in_open_sky(grade):
    "With its own figures and slow GNSS errors, 90 % of the epochs lie within the 95 % band"
    drives = [
        pos_error(SHORT, PosScenario(grade=grade), np.random.default_rng(seed)) for seed in SEEDS
    ]
    square = squared(drives)
    low, high = chi2.interval(0.95, 3)
    assert 1.5 < square.mean() < 4.5  # 3 would be perfect
    assert ((square > low) & (square < high)).mean() > 0.9


def test_a_mems_unit_in_real_time_drifts_as_the_real_one_did(real_time):
    "60 s without GNSS, with an odometer: 0.5 to 3 m at the end, as the real series' 0.7 to 3.0"
    assert 0.5 < np.median(largest(real_time)) < 3.0  # m
    at_end = np.array([np.linalg.norm(d.position[ELAPSED == 79.9]) for d in real_time])
    assert np.median(at_end / largest(real_time)) > 0.9  # a filter is worst when GNSS comes back


def test_smoothing_bridges_an_outage_and_ties_both_ends(mems):
    "Smoothed, 60 s leave decimetres, most in the middle, and sigmas honest within a factor of 2"
    assert 0.1 < np.median(largest(mems)) < 0.5  # m
    size = np.sqrt(np.mean([(d.position**2).sum(axis=1) for d in mems], axis=0))
    middle = LOST + 15 < ELAPSED[np.argmax(size)] < BACK - 15
    assert middle
    rms = np.sqrt(squared(mems)[:, IN_OUTAGE].mean() / 3)
    assert 0.5 < rms < 2.0


def test_after_an_outage_the_error_is_back_at_centimetres(mems, real_time):
    "1 s after GNSS is back the position holds to 2 cm RMS on each axis, and the filter's too"
    after = ELAPSED > BACK + 1.0
    for drives in (mems, real_time):
        rms = np.sqrt(np.mean([d.position[after] ** 2 for d in drives], axis=(0, 1)))
        assert (rms < [0.02, 0.02, 0.04]).all()  # m


def test_a_tactical_unit_drifts_clearly_less(mems, tactical):
    "A fibre-optic unit loses at most 0.7 of what a MEMS unit loses; in real time half"
    assert np.median(largest(tactical)) < 0.7 * np.median(largest(mems))
    filtered = [np.median(largest(errors(g, processing="filtered"))) for g in GRADES]
    assert filtered[0] < 0.5 * filtered[1]


def test_errors_have_zero_mean_over_seeds(mems):
    "No axis leans to one side, in the outage or outside: within 3 sigma of the mean of 30 drives"
    for epoch in (10.0, 50.0, 95.0):
        k = np.searchsorted(ELAPSED, epoch)
        for value in ("position", "attitude"):
            sample = np.array([getattr(d, value)[k] for d in mems])
            assert (np.abs(sample.mean(0)) < 3 * sample.std(0, ddof=1) / np.sqrt(len(mems))).all()


def test_attitudes_are_as_good_as_such_units_are(mems, tactical):
    "Roll and pitch 0.005 deg tactical, 0.015 deg MEMS; heading 0.02 and 0.06 deg; within twice"
    for drives, expected in ((tactical, [0.005, 0.005, 0.02]), (mems, [0.015, 0.015, 0.06])):
        rms = np.degrees(np.sqrt(np.mean([d.attitude**2 for d in drives], axis=(0, 1))))
        assert (rms > np.array(expected) / 2).all()
        assert (rms < np.array(expected) * 2).all()


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not(mems):
    "Every number follows from the seed"
    scenario = PosScenario(grade="mems", outages=((LOST, BACK - LOST),))
    again = pos_error(LONG, scenario, np.random.default_rng(0))
    for name in ("position", "attitude", "position_sigma", "attitude_sigma"):
        np.testing.assert_array_equal(getattr(again, name), getattr(mems[0], name))
    assert np.abs(mems[0].position - mems[1].position).max() > 0.01  # m


def test_an_outage_changes_neither_sensors_nor_satellites():
    "Free inertial navigation and the remaining fixes stay bit for bit what they were"
    lost = PosScenario(outages=((5.0, 10.0),))
    a, b = (
        navigation.navigate(SHORT, s, TACTICAL, np.random.default_rng(3), start=START)
        for s in (PosScenario(), lost)
    )
    np.testing.assert_array_equal(a.error, b.error)
    np.testing.assert_array_equal(a.fixes.error, b.fixes.error)
    assert (a.fixes.valid & ~b.fixes.valid).sum() == 10


def test_outages_count_from_the_start_of_the_drive():
    "A later pass is told when the drive began, and loses GNSS at its own time"
    scenario = PosScenario(grade="mems", outages=((500.0, 20.0),))
    error = pos_error(SHORT, scenario, np.random.default_rng(1), start=START - 495.0)
    elapsed = SHORT.gps_time - START
    sigma = error.position_sigma[:, 0]
    assert elapsed[np.argmax(sigma)] == pytest.approx(15.0, abs=5.0)
    assert sigma.max() > 2 * sigma[0]


def test_walls_take_satellites_away():
    "Fewer satellites, larger sigmas, and below four no fix"
    times = START + np.arange(60.0)
    heading = np.full(60, 0.7)
    hidden = (np.full((60, 2), np.radians(walls)) for walls in (0.0, 55.0, 85.0))
    open_, canyon, slot = (
        [gnss.gnss_fixes(times, heading, walls, np.random.default_rng(s)) for s in range(20)]
        for walls in hidden
    )
    assert np.median([f.satellites for f in open_]) > 9
    assert 3 < np.median([f.satellites for f in canyon]) < 8
    assert np.mean([f.valid for f in slot]) < 0.2
    for fixes in open_ + canyon + slot:
        assert not (fixes.valid & (fixes.satellites < 4)).any()
        assert (fixes.error[~fixes.valid] == 0).all()
    open_error, canyon_error = (
        np.sqrt(np.mean(np.vstack([f.error[f.valid] for f in fixes]) ** 2))
        for fixes in (open_, canyon)
    )
    assert open_error < 0.02  # m
    assert 0.03 < canyon_error < 0.5  # m


def test_sigmas_in_a_canyon_are_optimistic_within_a_factor_of_two():
    "Slow multipath deceives software that takes it for noise, but not beyond reason"
    scenario = PosScenario(canyons=((10.0, 50.0),))
    drives = [pos_error(LONG, scenario, np.random.default_rng(seed)) for seed in SEEDS]
    rms = np.sqrt(squared(drives)[:, (ELAPSED > 10.0) & (ELAPSED < 60.0)].mean(axis=1) / 3)
    assert 0.5 < np.median(rms) < 2.0


def test_the_sky_between_walls_is_used():
    "A pass between high walls has more error, the alignment before it open sky"
    scenario = PosScenario(sky_view=True)
    low, high = (np.full((len(SHORT), 2), np.radians(v)) for v in (5.0, 60.0))
    sigma = [
        [
            pos_error(SHORT, scenario, np.random.default_rng(s), sky).position_sigma.mean()
            for s in range(5)
        ]
        for sky in (low, high)
    ]
    assert np.median(sigma[1]) > 2 * np.median(sigma[0])
    with pytest.raises(ValueError, match="sky_view needs"):
        pos_error(SHORT, scenario, np.random.default_rng(1))


def test_the_alignment_joins_the_pass_smoothly():
    "Before and after a pass a vehicle moves on without a jump, below 4 m/s^2"
    times = np.arange(START - 120.0, START + 90.0, 0.1)
    position, attitude = aligned_poses(SHORT, times)
    acceleration = np.diff(position, 2, axis=0) / 0.01
    assert np.abs(acceleration).max() < 4.0  # m/s^2
    turn = (attitude[:-1].inv() * attitude[1:]).magnitude() / 0.1
    assert np.degrees(turn.max()) < 15.0  # deg/s


def test_a_standing_vehicle_can_be_recorded():
    "A stop at either end is no special case: centimetres as elsewhere"
    still = Trajectory(SHORT.gps_time, 0 * SHORT.position + ORIGIN, SHORT.attitude)
    error = pos_error(still, PosScenario(), np.random.default_rng(1))
    assert np.abs(error.position).max() < 0.1  # m


def test_errors_of_angles_match_the_rotation():
    "Roll, pitch and heading errors of a small turn are those of the turned attitude, to 1e-7 rad"
    rng = np.random.default_rng(5)
    angles = np.column_stack([rng.uniform(-0.2, 0.2, (50, 2)), rng.uniform(0.1, 6.1, 50)])
    attitude = attitude_from_angles(*angles.T)
    turn = 1e-4 * rng.standard_normal((50, 3))
    turned = np.column_stack(angles_from_attitude(Rotation.from_rotvec(turn) * attitude))
    error, sigma = navigation.angle_errors(attitude, turn, np.tile(1e-8 * np.eye(3), (50, 1, 1)))
    np.testing.assert_allclose(error, turned - angles, atol=1e-7)  # rad
    assert (sigma > 0.99e-4).all()


def test_what_is_recorded_differs_from_the_truth_by_the_error(mems):
    "record adds the error, at UTM coordinates to 1e-9 m and 1e-9 rad"
    recorded = record(LONG, mems[0])
    np.testing.assert_allclose(recorded.position - LONG.position, mems[0].position, atol=1e-9)
    angles = (np.column_stack(angles_from_attitude(t.attitude)) for t in (recorded, LONG))
    change = np.subtract(*angles)
    np.testing.assert_allclose(change, mems[0].attitude, atol=1e-9)
    np.testing.assert_array_equal(recorded.position_sigma, mems[0].position_sigma)


def test_a_trajectory_with_gaps_is_refused():
    "Passes are navigated one by one"
    broken = Trajectory(
        np.append(SHORT.gps_time[:-1], SHORT.gps_time[-1] + 60), SHORT.position, SHORT.attitude
    )
    with pytest.raises(ValueError, match="1 gaps"):
        pos_error(broken, PosScenario(), np.random.default_rng(1))


def test_a_given_series_is_taken_as_it_is():
    "A window of the series itself, its sigma of the same size, and refusal when it is too short"
    times = np.arange(0.0, 200.0, 0.1)
    position = np.column_stack([times, 2 * times, -times]) * 1e-3
    series = PosErrorSeries(times, position, 1e-4 * position)
    error = given_error(SHORT, series, np.random.default_rng(1))
    slope = np.diff(error.position, axis=0) / np.diff(SHORT.gps_time)[:, None]
    np.testing.assert_allclose(slope, np.tile([1e-3, 2e-3, -1e-3], (len(slope), 1)), rtol=1e-3)
    other = given_error(SHORT, series, np.random.default_rng(2))
    assert abs(error.position[0, 0] - other.position[0, 0]) > 0.01  # m: another window
    rms = np.sqrt((error.position[:, :2] ** 2).mean(axis=1))
    np.testing.assert_allclose(error.position_sigma[:, 0], rms, rtol=0.3)
    with pytest.raises(ValueError, match=r"lasts 199\.9 s, the pass 300\.0 s"):
        given_error(drive(300.0, rate=10.0), series, np.random.default_rng(1))


def test_the_real_series_can_drive_a_simulation():
    "The OB_GINS error: N, E, D become E, N, H; 2.9 m in outages, centimetres outside"
    path = shared("data", "real_pos_error", "OB_GINS_TXT.err")
    series = read_pos_error_series(path)
    first = np.loadtxt(path, max_rows=1)
    np.testing.assert_allclose(series.position[0], [first[2], first[1], -first[3]])
    np.testing.assert_allclose(np.degrees(series.attitude[0]), first[7:])
    error = pos_error(LONG, PosScenario(error_file=path), np.random.default_rng(4))
    assert 0.01 < np.abs(error.position).max() < 3.0  # m
    ratio = (error.position / error.position_sigma)[:, :2]
    assert 0.3 < np.sqrt((ratio**2).mean()) < 2.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3\n4 5 6\n", "2 rows of 3 columns"),
        ("a b c\n", "not a table of numbers"),
        ("1" + 9 * " 0" + "\n1" + 9 * " 0" + "\n", r"must increase.* \(first: row 2\)"),
        ("1" + 9 * " 0" + "\n2" + 8 * " 0" + " nan\n", "1 of 2 rows"),
    ],
)
def test_a_bad_series_is_refused(text, message, tmp_path):
    "One sentence says what is wrong with the file"
    path = tmp_path / "bad.err"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_pos_error_series(path)
