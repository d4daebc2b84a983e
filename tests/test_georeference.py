from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.georeference import Correction, georeference, pose_partials, skew, to_scanner
from mlscorr.survey import Mounting, PointCloud, Trajectory, attitude_from_angles

START = 413_200.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM
SCALE = np.full(3, 0.001)  # m
MOUNTING = Mounting(np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], True))
OTHER = Mounting(
    np.array([0.13, -0.58, 0.37]), Rotation.from_rotvec([1e-3, -2e-3, 3e-3]) * MOUNTING.boresight
)


def drive(step=0.005, length=20.0, gap=False):
    "A winding drive at 10 m/s, with a gap from 8 to 12 s if asked"
    elapsed = np.arange(0.0, length, step)
    if gap:
        elapsed = elapsed[(elapsed <= 8.0) | (elapsed >= 12.0)]
    wave = np.sin(elapsed[:, None] / [3.0, 5.0, 7.0])
    position = CORNER + np.outer(elapsed, [0.0, 10.0, 0.0]) + 2.0 * wave
    attitude = attitude_from_angles(*(np.array([0.02, 0.03, 0.5]) * wave).T)
    return Trajectory(START + elapsed, position, attitude)


def corrected(trajectory):
    "Slow errors of decimetres and milliradians"
    wave = np.sin((trajectory.gps_time[:, None] - START) / [4.0, 6.0, 9.0] + 1.0)
    return replace(
        trajectory,
        position=trajectory.position + 0.3 * wave,
        attitude=Rotation.from_rotvec(2e-3 * wave) * trajectory.attitude,
    )


def cloud_of(trajectory, points=20_000, seed=1, reach=50.0):
    "Points up to 50 m around the drive, in no order of time"
    rng = np.random.default_rng(seed)
    gps_time = rng.uniform(*trajectory.gps_time[[0, -1]], points)
    gps_time = gps_time[trajectory.segment(gps_time) >= 0]
    arm = rng.uniform(-reach, reach, (len(gps_time), 3))
    return PointCloud(trajectory.at(gps_time).position + arm, gps_time, np.ones(len(gps_time)))


def test_georeferencing_is_equation_1():
    "X_G = T_G + R_P^G (R_L^P X_L + T_L^P), point by point with plain matrices, to 1e-9 m"
    trajectory, rng = drive(), np.random.default_rng(2)
    rows, scanner = rng.integers(len(trajectory), size=50), rng.uniform(-80, 80, (50, 3))
    found = georeference(trajectory, MOUNTING, scanner, trajectory.gps_time[rows])
    for row, beam, point in zip(rows, scanner, found, strict=True):
        body = MOUNTING.boresight.as_matrix() @ beam + MOUNTING.lever_arm
        expected = trajectory.position[row] + trajectory.attitude[row].as_matrix() @ body
        assert np.abs(point - expected).max() < 2e-9  # m; the last bit of UTM northings is 5e-10


def test_the_inverse_returns_the_scanner_coordinates():
    "Map points go back to the scanner and return, to 1e-6 m"
    trajectory, rng = drive(), np.random.default_rng(3)
    gps_time, scanner = START + rng.uniform(0, 19.9, 5000), rng.uniform(-80, 80, (5000, 3))
    xyz = georeference(trajectory, MOUNTING, scanner, gps_time)
    assert np.abs(to_scanner(trajectory, MOUNTING, xyz, gps_time) - scanner).max() < 1e-6  # m


def test_skew_is_the_cross_product():
    "Phi(a) b = a x b (Eq. 4)"
    a, b = np.random.default_rng(4).normal(size=(2, 100, 3))
    assert (skew(a) @ b[:, :, None])[:, :, 0] == pytest.approx(np.cross(a, b))


def test_partials_are_the_numerical_derivatives_of_equation_1():
    "A small pose change moves points as -Phi(G) says (Eq. 9); the printed Eq. 10 turns them round"
    trajectory, rng, small = drive(), np.random.default_rng(5), 1e-4
    gps_time, scanner = START + rng.uniform(0, 19.9, 100), rng.uniform(-80, 80, (100, 3))
    xyz = georeference(trajectory, MOUNTING, scanner, gps_time)
    partials = pose_partials(trajectory, xyz, gps_time)

    def moved(change):
        turned = Rotation.from_rotvec(change[3:]) * trajectory.attitude
        there = replace(trajectory, position=trajectory.position + change[:3], attitude=turned)
        return georeference(there, MOUNTING, scanner, gps_time)

    for column, change in enumerate(small * np.eye(6)):
        numerical = (moved(change) - moved(-change)) / (2 * small)
        assert np.abs(partials[:, :, column] - numerical).max() < 2e-5  # m/m, m/rad
    printed = skew(xyz - trajectory.at(gps_time).position)  # as Eq. 10 prints it
    assert partials[:, :, 3:] == pytest.approx(-printed)


def test_a_turn_to_the_left_moves_what_is_ahead_to_the_west():
    "A turn of 1 mrad about Up carries a point 100 m north of the car 0.1 m to the west"
    trajectory = drive()
    ahead = trajectory.position[:1] + np.array([0.0, 100.0, 0.0])
    partials = pose_partials(trajectory, ahead, trajectory.gps_time[:1])
    assert partials[0] @ [0, 0, 0, 0, 0, 1e-3] == pytest.approx([-0.1, 0.0, 0.0])


@pytest.mark.parametrize(
    ("before", "after"), [(None, None), (MOUNTING, MOUNTING), (MOUNTING, OTHER)]
)
def test_apply_equals_inverse_then_forward_georeferencing(before, after):
    """The kernel equals Eq. 1 backward with the recorded and forward with the corrected pair.

    It interpolates shift and turn, the plain way both poses by slerp: at 200 Hz and up to 50 m
    from a winding car the two agree to 3e-8 m, with a changed mounting too.
    """
    recorded = drive()
    new = corrected(recorded)
    cloud = cloud_of(recorded)
    mine = Correction(recorded, new, before, after).apply(cloud)
    scanner = to_scanner(recorded, before or MOUNTING, cloud.xyz, cloud.gps_time)
    plain = georeference(new, after or MOUNTING, scanner, cloud.gps_time)
    assert np.abs(mine.xyz - cloud.xyz).max() > 0.1  # m; it does something
    assert np.abs(mine.xyz - plain).max() < 3e-8  # m


@pytest.mark.parametrize("gap", [False, True])
def test_order_and_chunks_do_not_matter(gap):
    "Sorted, shuffled and chunked clouds get the same coordinates to the last bit"
    recorded = drive(gap=gap)
    correction, cloud = Correction(recorded, corrected(recorded)), cloud_of(recorded)
    whole = correction.apply(cloud).xyz
    order = np.argsort(cloud.gps_time)
    assert np.array_equal(correction.apply(cloud[order]).xyz, whole[order])
    parts = [correction.apply(cloud[i : i + 777]) for i in range(0, len(cloud), 777)]
    assert np.array_equal(PointCloud.concatenate(parts).xyz, whole)


def test_a_zero_correction_moves_nothing():
    "The recorded pair corrected to itself changes no bit of integers, and floats below 1e-13 m"
    recorded = drive()
    correction, cloud = Correction(recorded, recorded, MOUNTING, MOUNTING), cloud_of(recorded)
    assert np.abs(correction.apply(cloud).xyz - cloud.xyz).max() < 1e-13  # m
    integers = np.rint((cloud.xyz - CORNER) / SCALE).astype(np.int32).T.copy()
    kept = integers.copy()
    assert correction.shift_integers(integers, SCALE, CORNER, cloud.gps_time) == 0
    assert np.array_equal(integers, kept)


def test_points_outside_and_in_gaps_stay_where_they_are():
    "Before, after and inside a gap nothing moves; on its two ends points do"
    recorded = drive(gap=True)
    ends = recorded.gaps[0]
    first, last = recorded.gps_time[[0, -1]]
    gps_time = np.array([first - 1, ends[0] + 1e-3, 10 + START, ends[1] - 1e-3, last + 1e-3, 0.0])
    gps_time = np.append(gps_time, [first, *ends, last])
    cloud = PointCloud(np.tile(CORNER, (10, 1)), gps_time, np.ones(10))
    correction = Correction(recorded, corrected(recorded))
    increments, inside = correction.increments(cloud.xyz, gps_time)
    assert inside.tolist() == [False] * 6 + [True] * 4
    assert not increments[:6].any() and (np.abs(increments[6:]).max(axis=1) > 0).all()
    assert np.array_equal(correction.apply(cloud).xyz[:6], cloud.xyz[:6])
    integers = np.zeros((3, 10), dtype=np.int32)
    assert correction.shift_integers(integers, SCALE, CORNER, gps_time) == 6
    assert not integers[:, :6].any() and integers[:, 6:].any(axis=0).all()


@pytest.mark.parametrize("constant", [0.0, 1_000_000_000.0 - 604_800.0 * 2_230])
def test_integers_get_the_correction_to_half_a_scale_step(constant):
    "Scaled integers end within half a millimetre of the float path, in the file's own time too"
    recorded = drive()
    correction, cloud = Correction(recorded, corrected(recorded)), cloud_of(recorded)
    integers = np.rint((cloud.xyz - CORNER) / SCALE).astype(np.int32).T.copy()
    stored = PointCloud(integers.T * SCALE + CORNER, cloud.gps_time, cloud.intensity)
    expected = correction.apply(stored).xyz
    in_file = cloud.gps_time - constant
    assert correction.shift_integers(integers, SCALE, CORNER, in_file, constant) == 0
    assert np.abs(integers.T * SCALE + CORNER - expected).max() < 0.5005e-3  # m


def test_integers_that_overflow_are_refused():
    "A corrected coordinate beyond 32 bits is an error that names scale and offset"
    recorded = drive()
    correction = Correction(recorded, replace(recorded, position=recorded.position + 1.0))
    integers = np.full((3, 4), 2**31 - 500, dtype=np.int32)
    offset = CORNER - integers[:, 0] * SCALE
    with pytest.raises(ValueError, match="4 corrected points do not fit the file's scale"):
        correction.shift_integers(integers, SCALE, offset, np.full(4, START + 5.0))


def test_trajectories_of_different_epochs_make_no_correction():
    "Recorded and corrected must pair epoch by epoch"
    with pytest.raises(ValueError, match="must have the same epochs"):
        Correction(drive(), drive(step=0.01))
