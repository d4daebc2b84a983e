"""Quantities that a picture shows by color."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.report.render import colour_table
from mlscorr.report.render.quantities import (
    COLOURS,
    CloudPair,
    colour_scale,
    paint,
    point_sigma,
)
from mlscorr.survey import PointCloud, Trajectory
from tests.beds.street_of_points import ORIGIN, START


def test_sigma_of_a_point_grows_with_its_distance():
    "Position sigmas of 3, 4, 0 cm and a heading sigma of 1 mrad give 0.05 m near, 0.112 at 100 m"
    time = START + np.arange(3.0)
    trajectory = Trajectory(
        time,
        np.tile(ORIGIN, (3, 1)),
        Rotation.identity(3),
        np.tile([0.03, 0.04, 0.0], (3, 1)),
        np.tile([0.0, 0.0, 1e-3], (3, 1)),
    )
    xyz = ORIGIN + np.array([[0.0, 0, 0], [100.0, 0, 0], [0, 0, 100.0], [0, 0, 0]])
    times = np.array([START, START + 1.2, START + 2.0, START + 9.0])
    cloud = PointCloud(xyz, times, np.zeros(4))
    sigma = point_sigma(trajectory)
    _, after = CloudPair(cloud, cloud, (None, sigma)).values("correction")
    np.testing.assert_allclose(after, [0.05, np.hypot(0.05, 0.1), 0.05, np.nan], atol=1e-7)
    assert point_sigma(None) is None


@pytest.mark.parametrize("colour", COLOURS)
def test_every_colour_has_a_value_before_and_after(colour):
    "A cloud moved by 0.3, 0.4, 0 m was 0.5 m off; what isn't known is grey"
    cloud = PointCloud(ORIGIN + np.zeros((2, 3)), START + np.arange(2.0), np.array([1.0, 3.0]))
    moved = PointCloud(np.add(cloud.xyz, [0.3, 0.4, 0.0]), cloud.gps_time, cloud.intensity)
    before, after = CloudPair(cloud, moved, (None, None)).values(colour)
    expected = {"intensity": [1, 3], "height": [42, 42], "correction": [0.5, 0.5]}
    np.testing.assert_allclose(before, expected.get(colour, [np.nan] * 2))
    scale = colour_scale(colour, before, after)
    pixels = paint(colour, np.array([before]), scale)
    assert pixels.shape == (1, 2, 3) and scale.low < scale.high
    assert (colour == "sigma") == (pixels == 0x76).all()


def test_scales_grow_lighter_and_stay_off_the_paper():
    "From dark to light, never as pale as white"
    for colour in COLOURS:
        light = colour_table(colour).astype(float) @ [0.3, 0.6, 0.1]
        assert np.diff(light).min() > -0.5 and light[-1] < 235
