"""The pair recorded -> corrected: it moves points and integers as Eq. 1 does, by their times."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction, increments_by_scanner
from mlscorr.frames import georeference, to_scanner
from mlscorr.survey import Mounting, PointCloud
from tests.beds.drives import CORNER, MOUNTING, START, cloud_of, drive, with_errors

SCALE = np.full(3, 0.001)  # m
OTHER = Mounting(
    np.array([0.13, -0.58, 0.37]), Rotation.from_rotvec([1e-3, -2e-3, 3e-3]) * MOUNTING.boresight
)


@pytest.mark.parametrize(
    ("before", "after"), [(None, None), (MOUNTING, MOUNTING), (MOUNTING, OTHER)]
)
def test_apply_equals_inverse_then_forward_georeferencing(before, after):
    """The kernel equals Eq. 1 backward with the recorded and forward with the corrected pair.

    It interpolates shift and turn, the plain way both poses by slerp: at 200 Hz and up to 50 m
    from a winding car the two agree to 3e-8 m, with a changed mounting too.
    """
    recorded = drive()
    new = with_errors(recorded)
    cloud = cloud_of(recorded)
    moved = Correction(recorded, new, before, after).apply(cloud)
    scanner = to_scanner(recorded, before or MOUNTING, cloud.xyz, cloud.gps_time)
    plain = georeference(new, after or MOUNTING, scanner, cloud.gps_time)
    assert np.abs(moved.xyz - cloud.xyz).max() > 0.1  # m; it does something
    assert np.abs(moved.xyz - plain).max() < 3e-8  # m


@pytest.mark.parametrize("gap", [False, True])
def test_order_and_chunks_do_not_matter(gap):
    "Sorted, shuffled and chunked clouds get the same coordinates to the last bit"
    recorded = drive(gap=gap)
    correction = Correction(recorded, with_errors(recorded))
    cloud = cloud_of(recorded)
    whole = correction.apply(cloud).xyz
    order = np.argsort(cloud.gps_time)
    assert np.array_equal(correction.apply(cloud[order]).xyz, whole[order])
    parts = [correction.apply(cloud[i : i + 777]) for i in range(0, len(cloud), 777)]
    assert np.array_equal(PointCloud.concatenate(parts).xyz, whole)


def test_a_zero_correction_moves_nothing():
    "The recorded pair corrected to itself changes no bit of integers, and floats below 1e-13 m"
    recorded = drive()
    correction = Correction(recorded, recorded, MOUNTING, MOUNTING)
    cloud = cloud_of(recorded)
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
    correction = Correction(recorded, with_errors(recorded))
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
    correction = Correction(recorded, with_errors(recorded))
    cloud = cloud_of(recorded)
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
    for count, words in ((4, "^4 corrected points can't be"), (1, "^1 corrected point can't be")):
        some = integers[:, :count].copy()
        with pytest.raises(ValueError, match=words):
            correction.shift_integers(some, SCALE, offset, np.full(count, START + 5.0))


def test_trajectories_of_different_epochs_make_no_correction():
    "Recorded and corrected must pair epoch by epoch"
    with pytest.raises(ValueError, match="must have the same epochs"):
        Correction(drive(), drive(step=0.01))


def test_points_of_two_scanners_move_by_the_mounting_of_theirs():
    "Both views of things in one array: each point gets what its scanner's correction adds"
    recorded = drive()
    cloud = cloud_of(drive())
    new = with_errors(recorded)
    n = len(cloud) // 2 * 2
    corrections = [Correction(recorded, new), Correction(recorded, new, MOUNTING, OTHER)]
    xyz = cloud.xyz[:n].reshape(-1, 2, 3)
    gps_time = cloud.gps_time[:n].reshape(-1, 2)
    scanner = np.tile([0, 1], (n // 2, 1))
    moved = increments_by_scanner(corrections, xyz, gps_time, scanner)
    for number, correction in enumerate(corrections):
        alone = correction.increments(xyz[:, number], gps_time[:, number])[0]
        assert np.array_equal(moved[:, number], alone)


@pytest.mark.parametrize(("points", "times"), [(3, 200_000), (5, 3), (3, 1)])
def test_points_without_a_time_each_are_refused(points, times):
    """Fewer points than times, or more, are refused: foreign memory is no correction."""
    recorded = drive()
    correction = Correction(recorded, with_errors(recorded))
    xyz = np.zeros((points, 3))
    gps_time = np.full(times, START + 1.0)
    integers = np.zeros((3, points), np.int32)
    for move in (
        lambda: correction.increments(xyz, gps_time),
        lambda: correction.shift_integers(integers, SCALE, CORNER, gps_time),
    ):
        with pytest.raises(ValueError, match=f"^{points} points came with {times} times"):
            move()
