"""Planes that lie in the face between two cells."""

import numpy as np
import pytest

from mlscorr.surfaces import CellTable
from mlscorr.surfaces._shapes import join_across_faces
from mlscorr.survey import PointCloud

# m, s
ORIGIN = np.array([447_000.0, 5_410_000.0, 120.0])
START = 413_200.0
PASSES = np.array([[START, START + 10.0]])
# m
NOISE = 0.02
POINTS = 3000


def joined(axis, side=0.0):
    "Points on a plane across an axis in the face of two cells, and the moments of these"
    rng = np.random.default_rng(axis)
    place = rng.uniform(0.0, 1.0, (POINTS, 3))
    place[:, axis] = side + NOISE * rng.normal(size=POINTS)
    time = np.sort(START + rng.uniform(0.0, 1.0, POINTS))
    table = CellTable(ORIGIN, START)
    table.add(PointCloud(ORIGIN + place, time, np.ones(POINTS)), PASSES, 4, np.full(1, np.inf))
    cells, _ = join_across_faces(table.of())
    return ORIGIN + place, time, cells.middle, cells.moments


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_plane_in_a_face_is_as_wide_as_its_noise(axis):
    "All of its points stand in one cell, their mean in the face to 2 mm, their scatter to 5 %"
    place, time, middle, moments = joined(axis)
    row = np.argmax(moments[:, 0])
    assert moments[:, 0].sum() == moments[row, 0] == POINTS
    local = place - middle[row]
    rows, columns = np.triu_indices(3)
    assert moments[row, 2:5] == pytest.approx(local.sum(axis=0), abs=1e-6)
    assert moments[row, 5:11] == pytest.approx((local.T @ local)[rows, columns], abs=1e-6)
    assert moments[row, 18:21] == pytest.approx((time - START) @ local, abs=1e-6)
    mean = moments[row, 2 + axis] / POINTS
    assert middle[row, axis] + mean == pytest.approx(ORIGIN[axis], abs=0.002)  # m
    variance = moments[row, [5, 8, 10][axis]] / POINTS - mean**2
    assert np.sqrt(variance) == pytest.approx(NOISE, rel=0.05)


def test_planes_away_from_faces_stay_as_they_are():
    "In the middle of its cell a plane is whole, and its moments are its own"
    *_, moments = joined(2, side=0.5)
    assert moments[:, 0].tolist() == [POINTS]
