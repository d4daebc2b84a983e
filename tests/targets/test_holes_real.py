from itertools import combinations

import numpy as np
import open3d as o3d
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.survey import PointCloud, Scanner
from mlscorr.targets import ScannerPath, fit_targets
from tests.beds.shared import shared

SCANNER = Scanner(range_noise=0.015, angle_noise=np.radians(0.02))  # data sheet of its 64 beams
START = 413_200.0  # s
REACH = 1.5  # m of cloud about the board
BOARD = np.array([3.32, 0.67, -0.21])  # m, from the scanner
LIKELY = 0.15, 0.35  # m, diameter of a hole


def frame(path):
    "Points, time and intensity of a frame in the scanner's coordinates"
    point = o3d.t.io.read_point_cloud(str(path)).point
    xyz = point["positions"].numpy().astype(float)
    time = point["timestamp"].numpy().ravel()
    good = np.isfinite(xyz).all(axis=1)
    return xyz[good], START + (time - time.min())[good], point["intensity"].numpy().ravel()[good]


def fit_holes(path, size, turn=None, origin=0.0):
    "Holes of the board in a frame, at most half a metre and a bit from its middle"
    xyz, time, intensity = frame(path)
    near = np.linalg.norm(xyz - BOARD, axis=1) < REACH
    sight = xyz[near] if turn is None else turn.apply(xyz[near])
    cloud = PointCloud(sight + origin, time[near], intensity[near])
    path = ScannerPath(np.array([time.min(), time.max()]), np.zeros((2, 3)) + origin)
    found = fit_targets(cloud, path, [("hole", size)], SCANNER, np.random.default_rng(0))
    board = (BOARD if turn is None else turn.apply(BOARD)) + origin
    return [one for one in found if np.linalg.norm(one.position - board) < 0.7]


@pytest.fixture(scope="module")
def frames():
    "Ten frames of the board that stands still"
    return sorted(shared("data", "circle_boards", "circle_board").glob("*.pcd"))


@pytest.fixture(scope="module")
def size(frames):
    "Diameter of the holes as the fit itself estimates it from three frames"
    sizes = [one.size for path in frames[:3] for one in fit_holes(path, None)]
    likely = [one for one in sizes if LIKELY[0] < one < LIKELY[1]]
    assert len(likely) >= 6
    return float(np.median(likely))


@pytest.fixture(scope="module")
def holes(frames, size):
    "Centres (10, 4, 3) of the four holes in each frame, the lower ones first"
    rows = []
    for path in frames:
        centres = [one.position for one in fit_holes(path, size)]
        assert len(centres) == 4, path
        rows.append(sorted(centres, key=lambda p: (p[2] > BOARD[2], p[1])))
    return np.array(rows)


def test_four_holes_repeat_in_ten_frames(holes):
    "The centres of all four repeat to 5 mm in each axis (1 sigma)"
    assert holes.shape == (10, 4, 3)
    assert holes.std(axis=0, ddof=1).max() < 0.005  # m


def test_the_holes_form_one_square(holes):
    "Their mean centres lie on one square of 0.6 m, to 1.2 cm in each distance"
    centres = holes.mean(axis=0)
    apart = sorted(np.linalg.norm(a - b) for a, b in combinations(centres, 2))
    edge = (sum(apart[:4]) + sum(apart[4:]) / np.sqrt(2)) / 6
    assert edge == pytest.approx(0.6, abs=0.02)  # m
    assert apart[:4] == pytest.approx([edge] * 4, abs=0.012)  # m
    assert apart[4:] == pytest.approx([edge * np.sqrt(2)] * 2, abs=0.012)  # m


@pytest.mark.long
def test_holes_do_not_depend_on_the_axes(frames, size, holes):
    "The first frame turned by 70 degrees and moved to UTM gives the same centres to 3 mm"
    turn = Rotation.from_euler("z", 70, degrees=True)
    origin = np.array([523e3, 3378e3, 40.0])
    found = fit_holes(frames[0], size, turn, origin)
    back = turn.inv().apply([target.position - origin for target in found])
    for centre in holes[0]:
        assert np.linalg.norm(back - centre, axis=1).min() < 0.003  # m
