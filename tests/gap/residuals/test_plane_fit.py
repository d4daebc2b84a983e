"""Planes are found with their normal and noise; what is no plane is left."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.residuals.patches import fit_patches
from mlscorr.survey import PointCloud

NOISE = 0.004  # m


def wall(survey, rng, bent=0.0, beyond=0.5):
    """A second of scan lines on a square of 0.8 m, 6 m beside the vehicle, with noise across it

    So far (m) beyond a whole easting it stands.
    """
    start = survey.trajectory.gps_time[0] + 2.0
    start = np.ceil(start)
    pose = survey.trajectory.at([start + 0.5])
    centre = np.floor(pose.position[0] + [6.0, 6.0, 1.0])
    centre += [beyond, 0.2, 0.2]
    u = np.tile(np.linspace(-0.4, 0.4, 60), 50)
    v = np.repeat(np.linspace(-0.4, 0.4, 50), 60)
    away = rng.normal(0.0, NOISE, 3000) + bent * u**2
    xyz = centre + np.column_stack([away, u, v])
    time = start + np.sort(rng.uniform(0.0, 0.999, 3000))
    return PointCloud(xyz, time, np.full(3000, 9000, np.uint16))


def test_a_wall_gives_its_normal_and_its_noise(survey):
    "One patch whose normal is known to 2 mrad, its variance to 10 %, with at most 400 points"
    cloud = wall(survey, np.random.default_rng(1))
    patches = fit_patches(survey, cloud, np.arange(len(cloud)))
    assert len(patches) == 1
    assert np.abs(patches.normal[0] @ [1.0, 0.0, 0.0]) == pytest.approx(1.0, abs=2e-6)
    assert np.sqrt(patches.variance[0]) == pytest.approx(NOISE, rel=0.1)
    assert 300 <= len(patches.cloud[0]) <= 400
    assert patches.ripple[0] == pytest.approx(1.0, abs=0.15)


def test_a_wall_on_a_whole_metre_has_all_of_its_noise(survey):
    "Models have walls and floors there: no cell's face halves their noise"
    cloud = wall(survey, np.random.default_rng(1), beyond=0.0)
    patches = fit_patches(survey, cloud, np.arange(len(cloud)))
    assert np.sqrt(patches.variance) == pytest.approx([NOISE], rel=0.1)
    assert patches.centre[0, 0] == pytest.approx(cloud.xyz[:, 0].mean(), abs=NOISE / 20)  # m


def test_points_in_a_line_are_no_wall(survey):
    "Their least variance is zero, which rounding must not make less"
    cloud = wall(survey, np.random.default_rng(1))
    for seed in range(50):
        along = np.random.default_rng(seed).uniform(-0.3, 0.3, len(cloud))
        place = np.floor(cloud.xyz[:1]) + 0.4 + along[:, None] * [0.36, 0.48, 0.8]
        line = replace(cloud, xyz=place)
        assert fit_patches(survey, line, np.arange(len(line))) is None


def test_a_wall_in_a_face_of_cells_is_left(survey):
    "Both cells would hold half of its noise, 0.8 sigmas off the wall"
    cloud = wall(survey, np.random.default_rng(1), beyond=2.0 / 3.0)
    assert fit_patches(survey, cloud, np.arange(len(cloud))) is None


def test_what_is_bent_is_rougher_than_its_noise(survey):
    "A bow of 5 cm has ten times the variance of the noise, or is no patch at all"
    cloud = wall(survey, np.random.default_rng(1), bent=0.3)
    patches = fit_patches(survey, cloud, np.arange(len(cloud)))
    assert patches is None or patches.ripple[0] > 3
