"""Crossings of scan lines with paint."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.surfaces._paint import find_crossings
from tests.beds import painted_roads as road


def crossings(paint=road.on_paint, seed=1, change=None):
    "Crossings of the first pass, and their places along and left of the middle line"
    cloud = road.cloud(0, np.random.default_rng(seed), paint=paint)
    cloud = cloud if change is None else change(cloud)
    found = find_crossings(cloud, road.survey().trajectory.passes, 5)
    return found, road.along_and_left(found.place)


def lifted(height):
    "Change that lifts points by a function of their places along and left. Units: m"

    def change(cloud):
        up = height(*road.along_and_left(cloud.xyz).T)
        return replace(cloud, xyz=cloud.xyz + up[:, None] * [0.0, 0.0, 1.0])

    return change


def test_crossings_lie_on_the_middle_of_the_paint():
    "Of each line nearly all scan lines tell the middle to a centimetre, within stated sigmas"
    found, (x, y) = crossings()[0], crossings()[1].T
    lines = np.where(y > road.EDGE / 2, road.EDGE, 0.0)
    error = y - lines
    expected = road.LENGTH / road.SPEED * road.LINES * (1 + road.DASH / (road.DASH + road.GAP))
    assert 0.9 * expected < len(found) < 1.02 * expected
    # a scan line 35 deg askew meets the paint at points 3.2 cm apart to the left
    assert np.sqrt(np.mean(error**2)) < 0.01  # m
    sigma = np.sqrt(found.variance) * np.cos(np.radians(35.0))
    assert np.mean(np.abs(error) < 2 * sigma) > 0.93
    assert abs(error.mean()) < 0.001  # m
    assert (found.group == 5).all()
    dashed = lines == 0.0
    assert (x[dashed] % (road.DASH + road.GAP) < road.DASH + 0.1).all()


@pytest.mark.parametrize(
    "paint",
    [
        lambda x, y: np.zeros(len(x), bool),  # asphalt alone
        lambda x, y: y > 2.0,  # a bright pavement
        lambda x, y: np.abs(y - 1.0) < 0.6,  # a patch of another asphalt
    ],
)
def test_what_is_no_paint_is_not_taken_for_it(paint):
    "Texture of 12 %, a bright pavement, and a broad bright strip are crossed nowhere"
    assert len(crossings(paint)[0]) == 0


@pytest.mark.parametrize(
    "height",
    [
        lambda x, y: 0.12 * (y > road.EDGE),  # a kerb, bright on its edge
        lambda x, y: 0.5 * (y - road.EDGE),  # a slope
    ],
)
def test_paint_lies_on_level_ground(height):
    "A bright kerb and a bright strip on a steep slope are no paint"
    found, _ = crossings(lambda x, y: np.abs(y - road.EDGE) < 0.06, change=lifted(height))
    assert len(found) < 0.02 * road.LENGTH / road.SPEED * road.LINES


def test_points_in_no_order_tell_no_paint():
    "Points that are not in the order of scan lines give no crossings"
    rng = np.random.default_rng(2)
    assert len(crossings(change=lambda cloud: cloud[rng.permutation(len(cloud))])[0]) == 0


def test_crossings_scale_with_intensity():
    "Half of all intensities, or ten times as many points at an offset, give the same crossings"
    whole = crossings()[0]
    half = crossings(change=lambda c: replace(c, intensity=c.intensity // 2))[0]
    offset = crossings(change=lambda c: replace(c, intensity=c.intensity + np.uint16(20_000)))[0]
    for other in (half, offset):
        assert abs(len(other) - len(whole)) <= 3


def test_eight_bits_are_enough():
    "Intensities of 0 to 255, or those times 257, tell as much paint; texture of a level is none"
    whole = crossings()[0]
    for factor in (1, 257):
        coarse = crossings(
            change=lambda c, f=factor: replace(
                c, intensity=(c.intensity // 100 * f).astype(np.uint16)
            )
        )[0]
        assert abs(len(coarse) - len(whole)) < 0.02 * len(whole)
    level = crossings(
        lambda x, y: np.zeros(len(x), bool),
        change=lambda c: replace(c, intensity=40 + (c.intensity > 2_300).astype(np.uint16)),
    )[0]
    assert len(level) == 0
