"""The reference surface of a simulated survey, and surveys whose points are moved."""

import numpy as np
import pytest

from mlscorr.io.surveys import read_survey
from mlscorr.simulate import (
    DisplacedSurvey,
    Scenario,
    SceneScenario,
    random_scenario,
    random_survey,
    simulate,
)
from mlscorr.simulate.scene import read_mesh
from mlscorr.simulate.scene.shapes import ray_caster

SHORT = Scenario(
    drive={"duration": 6.0},
    targets={"control": 2, "check": 1},
    scanner=[{"lines_per_second": 50, "points_per_line": 200}],
    scene={"kind": "street", "cars": 20.0},
)
LIFT = np.array([0.0, 0.0, 0.03])


def make(scenario):
    return simulate(scenario, np.random.default_rng(1))


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    "One survey without and one with a reference, and the latter as simulated"
    without, with_ = (tmp_path_factory.mktemp(name) for name in ("without", "with"))
    wanted = SHORT.model_copy(update={"scene": SHORT.scene.model_copy(update={"reference": True})})
    made = make(wanted)
    make(SHORT).write(without)
    made.write(with_)
    return without, with_, made


def distance(triangles, points):
    "Distance of points (n, 3) from triangles, both about one origin. Units: m"
    near = ray_caster(triangles).compute_closest_points(points.astype(np.float32))
    return np.linalg.norm(near["points"].numpy() - points, axis=1)


@pytest.mark.parametrize("file", ["pass-1.laz", "control.csv", "trajectory.csv", "truth.npz"])
def test_a_reference_leaves_all_else_as_it_was(folders, file):
    "The same seed gives the same cloud, control, trajectory and truth with a reference"
    without, with_, _ = folders
    assert (without / file).read_bytes() == (with_ / file).read_bytes()
    assert not (without / "reference.ply").exists()


def test_the_reference_is_where_the_survey_file_says(folders):
    "survey.toml names a small PLY in map coordinates"
    without, with_, made = folders
    survey = read_survey(with_)
    assert survey.reference == with_ / "reference.ply"
    assert read_survey(without).reference is None
    assert survey.reference.stat().st_size < 500_000
    scene = SceneScenario(kind="mesh", file=survey.reference)
    mesh = read_mesh(scene, made.scenario.origin)
    np.testing.assert_allclose(
        np.sort(mesh.triangles.mean(axis=1), axis=0),
        np.sort(made.static_scan.triangles.mean(axis=1), axis=0),
        atol=1e-6,
    )


def test_the_reference_is_ground_and_walls_to_a_millimetre(folders):
    "Points on ground and walls lie on it within 4 mm; those on cars, trees and targets don't"
    _, _, made = folders
    points = made.pulses.point - made.scenario.origin
    triangle = made.pulses.triangle
    fixed = triangle < made.scene.fixed
    away = distance(made.static_scan.triangles, points)
    assert np.quantile(away[fixed], 0.99) < 0.004
    assert np.median(away[fixed]) > 1e-4  # a static scan isn't perfect
    on_things = ~fixed & (made.scene.target[triangle] < 0)
    assert np.median(away[on_things]) > 0.1


def test_moved_points_are_where_they_are_said_to_be():
    "A lift of 30 mm moves the cloud by it, and neither control nor trajectory nor truth"
    plain = make(SHORT)
    lifted = DisplacedSurvey.of(plain, lambda seen: np.tile(LIFT, (len(seen.xyz), 1)))
    np.testing.assert_allclose(lifted.cloud.xyz - plain.cloud.xyz - LIFT, 0.0, atol=1e-6)
    np.testing.assert_array_equal(lifted.pulses.point, plain.pulses.point)
    assert lifted.targets is plain.targets
    assert lifted.trajectory.gps_time is not None
    np.testing.assert_array_equal(lifted.trajectory.position, plain.trajectory.position)


def test_a_varied_survey_with_an_effect_is_the_same_but_for_it():
    "A datum 0.1 m too high lifts the targets by it; drive, drift and scene stay"
    plain = random_survey((7, 1))
    lifted = random_survey((7, 1), effects=[{"name": "vertical_datum", "magnitude": 0.1}])
    moved = lifted.targets.position - plain.targets.position
    np.testing.assert_allclose(moved, np.tile([0.0, 0.0, 0.1], (len(moved), 1)), atol=1e-9)
    np.testing.assert_array_equal(lifted.trajectory.position, plain.trajectory.position)
    np.testing.assert_array_equal(lifted.scene.mesh.triangles, plain.scene.mesh.triangles)


def test_varied_surveys_are_not_alike():
    "Of 300 scenarios two thirds have a reference, half two passes, all 12 to 24 control targets"
    rng = np.random.default_rng(1)
    several = [random_scenario(rng) for _ in range(300)]
    assert len({scenario.origin for scenario in several}) == 300
    assert np.mean([s.scene.reference for s in several]) == pytest.approx(2 / 3, abs=0.1)
    assert np.mean([len(s.drive.passes) == 2 for s in several]) == pytest.approx(0.5, abs=0.1)
    assert {s.scene.kind for s in several} == {"street", "river"}
    assert {s.scanner[0].kind for s in several} == {"line", "spinning"}
    for scenario in several:
        assert 12 <= scenario.targets.control <= 24
        assert 4 <= scenario.targets.check <= 8
        assert 40.0 <= scenario.drive.duration <= 70.0
        assert scenario.scanner[0].lines_per_second <= 150.0
