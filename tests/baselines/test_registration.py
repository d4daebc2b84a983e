"""ICP: a small motion is found, and where it fails it says so."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.baselines import Undetermined, fit_icp
from mlscorr.evaluate import misclosures
from mlscorr.survey import PointCloud
from tests.beds.streets import SHIFT, START, TIME, observed, on_a_line, targets


def surface_points(rng, observations, density=400):
    "Points on the discs of observed targets, with 3 mm of noise: (PointCloud, pass numbers)"
    xyz = []
    time = []
    for i in range(len(observations)):
        normal = observations.normal[i]
        level = np.cross([0.0, 0.0, 1.0], normal)
        radius = 0.3 * np.sqrt(rng.uniform(0, 1, density))
        angle = rng.uniform(0, 2 * np.pi, density)
        local = np.outer(radius * np.cos(angle), level)
        local += np.outer(radius * np.sin(angle), np.cross(normal, level))
        local += np.outer(rng.normal(0, 0.003, density), normal)
        xyz.append(observations.position[i] + local)
        time.append(np.full(density, observations.gps_time[i]))
    count = len(observations) * density
    cloud = PointCloud(np.vstack(xyz), np.concatenate(time), np.full(count, 60000))
    return cloud, np.ones(count, int)


def icp_case(rng, surveyed, n=12):
    place, time = targets(rng, n)
    matched = observed(place, time, surveyed(place, time))
    turn = rng.uniform(0, 2 * np.pi, n)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    return replace(matched, observations=replace(matched.observations, normal=normal))


def test_icp_finds_a_small_motion():
    "A shift of 4 cm and a turn of 0.2 mrad are found within a centimetre at every target"
    rng = np.random.default_rng(8)
    change = Rotation.from_rotvec([0.0, 0.0, 0.0002]).as_matrix() - np.eye(3)
    centre = START + np.array([173.0, 100.0, 0.0])
    case = icp_case(rng, lambda p, _: p + [0.03, -0.02, 0.02] + (p - centre) @ change.T)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fit_icp(case, *surface_points(rng, case.observations))
    assert np.abs(misclosures(case, found)).max() < 0.010
    assert found.fitness > 0.95
    assert found.inlier_rmse < 0.02
    assert found.control_after < 0.010 < found.control_before


def test_icp_comes_close_from_a_metre_away():
    "Coarse to fine, discs 1.1 m away from where they were surveyed come within 1 cm of it"
    rng = np.random.default_rng(12)
    case = icp_case(rng, lambda p, _: p + np.array([0.8, -0.6, 0.4]))
    found = fit_icp(case, *surface_points(rng, case.observations))
    assert found.control_before > 1.0
    assert np.abs(misclosures(case, found)).max() < 0.010


def test_icp_says_loudly_that_it_failed():
    "With a POS drift of 1 m, ICP reports fitness and RMSE, and that it moved away from control"
    rng = np.random.default_rng(9)
    # alternately to the left and to the right: ICP takes partners on the wrong side
    case = icp_case(rng, lambda p, t: p + np.outer(np.sin((t - TIME) / 5.0), [1.0, 0.8, 0.3]))
    with pytest.warns(UserWarning, match="brings only .* % of the targets' points") as caught:
        found = fit_icp(case, *surface_points(rng, case.observations))
    assert found.fitness < 0.5
    is_worse = found.control_after > found.control_before + 0.001
    assert is_worse == any("to the control worse" in str(one.message) for one in caught)


def test_icp_warns_when_it_moved_away_from_control():
    "Discs of which one side was scanned draw ICP off their centres, and it says by how much"
    rng = np.random.default_rng(10)
    case = icp_case(rng, lambda p, _: p)
    cloud, passes = surface_points(rng, case.observations)
    beside = replace(cloud, xyz=cloud.xyz + np.array([0.2, 0.2, 0.0]))
    with pytest.warns(UserWarning, match="the control worse: 3D RMSE 0.0000 m"):
        fit_icp(case, beside, passes)


def test_icp_is_refused_for_targets_on_a_line():
    "The turn about a line of targets can't be told from their centres"
    place, time = on_a_line(6, None)
    matched = observed(place, time, place + SHIFT)
    with pytest.raises(Undetermined, match=r"do not lie on one line|from one line by only"):
        fit_icp(matched, *surface_points(np.random.default_rng(1), matched.observations))
