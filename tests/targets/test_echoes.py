import numpy as np
import pytest

from mlscorr.targets import ScannerPath
from mlscorr.targets._echoes import Echoes, beams_at_plane, missed_points
from mlscorr.targets.shapes import BRIGHT, DARK, MISS
from tests.targets.planes import plane_through

FACE = plane_through(np.array([0.0, 5.0, 0.0]), np.array([0.0, -1.0, 0.0]))  # 5 m off


def echoes(xyz, intensity=None, gps_time=None):
    "Points seen from the origin"
    if gps_time is None:
        time = np.arange(len(xyz)) * 1e-5
    else:
        time = gps_time
    if intensity is None:
        intensity = np.ones(len(xyz))
    path = ScannerPath(time[[0, -1]], np.zeros((2, 3)))
    return Echoes(xyz, time, intensity, path, 0.03)


def test_beams_are_bright_dark_or_miss_the_plane():
    "On it by intensity, through it to a point behind, and not those that stopped in front"
    xyz = np.array([[0.1, 5.0, 0.0], [0.2, 5.01, 0.0], [0.2, 10.0, 0.2], [0.1, 4.0, 0.1]])
    points, state, rows = beams_at_plane(
        echoes(xyz, np.array([9, 1, 9, 9])), FACE, np.zeros(2), 1.0, 5
    )
    assert state.tolist() == [BRIGHT, DARK, MISS]
    assert rows.tolist() == [0, 1, 2]
    through = FACE.origin + points[2] @ FACE.axes[:2]
    assert through == pytest.approx([0.1, 5.0, 0.1])  # m


def plate(lines=6, pulses=20):
    "Echoes of a plate in the air that a scanner passes: lines upwards, 5 cm apart, and no others"
    x, z = np.meshgrid(0.05 * np.arange(lines), 0.02 * np.arange(pulses), indexing="ij")
    time = (np.arange(lines)[:, None] * 0.01 + np.arange(pulses) * 1e-5).ravel()
    xyz = np.column_stack([x.ravel(), np.full(x.size, 5.0), z.ravel()])
    return echoes(xyz, gps_time=time)


def test_beams_beside_a_plate_in_the_air_met_nothing():
    "Above and below each line, and beside the first and the last: just off the plate"
    seen = plate()
    missed = missed_points(seen, np.arange(len(seen.xyz)), FACE)
    place = FACE.origin + missed @ FACE.axes[:2]
    inside = (place[:, 0] > -0.01) & (place[:, 0] < 0.26) & (place[:, 2] > -0.01)
    inside &= place[:, 2] < 0.39
    assert not inside.any()
    assert len(missed) == 2 * 6 + 2 * 20


def test_a_single_line_or_shared_times_tell_of_no_misses():
    "One scan line has no neighbours; beams that share their times have no order"
    single = plate(lines=1)
    assert len(missed_points(single, np.arange(len(single.xyz)), FACE)) == 0
    seen = plate()
    flash = echoes(seen.xyz, gps_time=np.repeat(np.arange(6) * 0.01, 20))
    assert len(missed_points(flash, np.arange(len(seen.xyz)), FACE)) == 0
