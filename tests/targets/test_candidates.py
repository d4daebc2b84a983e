from dataclasses import replace

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import PointCloud, Trajectory
from mlscorr.targets import collect, fit_near_control, search_radius
from tests.targets.test_extract import ORIGIN, SIZE, START, control_point, survey_of, view


def straight(sigma=None):
    "A drive of 100 s north from the origin at 10 m/s, with a gap from 50 to 60 s"
    elapsed = np.concatenate([np.arange(0, 50.01, 0.05), np.arange(60, 100.01, 0.05)])
    path = ORIGIN + np.outer(elapsed, [0.0, 10.0, 0.0])
    sigmas = None if sigma is None else np.outer(sigma(elapsed), [1.0, 0.0, 0.0])
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(elapsed)))
    return Trajectory(START + elapsed, path, still, sigmas)


def test_search_radius_is_the_surveys_and_half_a_diagonal():
    "10 m where survey.toml says nothing, whatever the POS states; 3 m where it says so"
    control = control_point(ORIGIN + np.array([5.0, 100.0, 1.0]), "square")
    survey = survey_of(straight(lambda t: np.full(len(t), 0.01)), control)
    half = SIZE / np.sqrt(2)
    assert search_radius(survey, control) == pytest.approx([10.0 + half])  # m
    assert search_radius(replace(survey, search_radius=3.0), control) == pytest.approx([3.0 + half])


def test_collect_by_chunks_is_the_whole():
    "Chunks of 700 points keep the same points as one; those in a gap are unplaced"
    rng = np.random.default_rng(1)
    elapsed = np.sort(rng.uniform(0, 100, 20_000))
    xyz = ORIGIN + np.outer(elapsed, [0.0, 10.0, 0.0]) + rng.uniform(-5, 5, (20_000, 3))
    cloud = PointCloud(xyz, START + elapsed, np.arange(20_000.0))
    control = control_point(ORIGIN + np.array([2.0, 100.0, 0.0]), "circle")
    control += control_point(ORIGIN + np.array([2.0, 550.0, 0.0]), "circle")  # in the gap
    trajectory = straight()

    def read(size):
        return lambda _: (cloud[i : i + size] for i in range(0, len(cloud), size))

    survey = survey_of(trajectory, control, [cloud])
    whole, parts = collect(survey, read(len(cloud))), collect(survey, read(700))
    expected = np.linalg.norm(xyz[:, None] - control.position, axis=2)
    expected = expected < search_radius(survey, control)
    assert np.array_equal(whole.cloud.intensity, np.flatnonzero(expected[:, 0]))
    assert np.array_equal(whole.unplaced.intensity, np.flatnonzero(expected[:, 1]))
    for name in ("cloud", "unplaced"):
        assert np.array_equal(getattr(parts, name).xyz, getattr(whole, name).xyz)
    assert np.array_equal(parts.pass_number, whole.pass_number)


def test_passes_without_a_target_count_too():
    "The pass of a later file is numbered after that of an earlier one that saw no target"
    seen = view("disc on a board", 1)
    early = PointCloud(seen.cloud.xyz + 5000.0, seen.cloud.gps_time - 0.5, seen.cloud.intensity)
    files = {"late": seen.cloud, "early": early}
    survey = survey_of(seen.trajectory, seen.control, files)
    candidates = collect(survey, lambda name: [files[name]])
    assert len(candidates.cloud) > 0
    assert set(candidates.pass_number) == {2}


def test_collect_far_from_control_keeps_nothing():
    "A cloud of another street gives no candidates, and extraction no targets"
    seen = view("disc on a board", 1)
    away = replace(seen.control, position=seen.control.position + 5000.0)
    survey = survey_of(seen.trajectory, away)
    candidates = collect(survey, lambda _: [seen.cloud])
    assert len(candidates.cloud) == len(candidates.unplaced) == 0
    assert fit_near_control(candidates, survey, np.random.default_rng(0)) == []
