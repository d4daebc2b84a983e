from dataclasses import replace

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.pipeline.finding import fit_while_reading
from mlscorr.survey import PointCloud, Trajectory
from mlscorr.targets import Neighbourhoods, collect, search_radius
from mlscorr.targets.candidates import PointsInBalls
from tests.targets.test_extract import ORIGIN, SIZE, START, control_point, survey_of, view


def straight(sigma=None):
    "A drive of 100 s north from the origin at 10 m/s, with a gap from 50 to 60 s"
    elapsed = np.concatenate([np.arange(0, 50.01, 0.05), np.arange(60, 100.01, 0.05)])
    path = ORIGIN + np.outer(elapsed, [0.0, 10.0, 0.0])
    if sigma is None:
        sigmas = None
    else:
        sigmas = np.outer(sigma(elapsed), [1.0, 0.0, 0.0])
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(elapsed)))
    return Trajectory(START + elapsed, path, still, sigmas)


def test_search_radius_is_the_surveys_and_a_diagonal():
    "10 m where survey.toml says nothing, whatever the POS states; 3 m where it says so"
    control = control_point(ORIGIN + np.array([5.0, 100.0, 1.0]), "square")
    survey = survey_of(straight(lambda t: np.full(len(t), 0.01)), control)
    diagonal = SIZE * np.sqrt(2)
    assert search_radius(survey, control) == pytest.approx([10.0 + diagonal])  # m
    assert search_radius(replace(survey, search_radius=3.0), control) == pytest.approx(
        [3.0 + diagonal]
    )


def near(survey, read):
    "Output of collect: Candidates, and points and pass numbers about each surveyed point"
    handed_on = {}
    parts = []
    since = []

    def fit(file, index, cloud):
        handed_on.setdefault(index, []).append((file, cloud))

    candidates = collect(survey, read, fit, parts.append, since.append, lambda _: None)
    assert since[-1] == np.inf
    for index, given in handed_on.items():
        numbers = [
            candidates.passes[file, segment]
            for file, cloud in given
            for segment in survey.trajectory.segment(cloud.gps_time)
        ]
        handed_on[index] = PointCloud.concatenate([cloud for _, cloud in given]), np.array(numbers)
    return candidates, handed_on, sum(map(len, parts))


def test_collect_by_chunks_is_the_whole():
    "Chunks of 700 points hand on what one does; the third ball is in a gap: unplaced"
    rng = np.random.default_rng(1)
    elapsed = np.sort(rng.uniform(0, 100, 20_000))
    xyz = ORIGIN + np.outer(elapsed, [0.0, 10.0, 0.0]) + rng.uniform(-5, 5, (20_000, 3))
    cloud = PointCloud(xyz, START + elapsed, np.arange(20_000.0))
    places = ORIGIN + np.array(
        [[2.0, y, 0.0] for y in (100.0, 112.0, 550.0)]
    )  # the last in the gap
    control = control_point(places[0], "circle")
    control += control_point(places[1], "circle") + control_point(places[2], "circle")
    survey = survey_of(straight(), control, [cloud])

    def read(size):
        return lambda _: (cloud[i : i + size] for i in range(0, len(cloud), size))

    whole, about, count = near(survey, read(len(cloud)))
    parts, about_parts, count_parts = near(survey, read(700))
    expected = np.linalg.norm(xyz[:, None] - control.position, axis=2)
    expected = expected < search_radius(survey, control)
    assert list(about) == list(about_parts) == [0, 1]
    for index in about:
        of, numbers = about[index]
        assert np.array_equal(of.intensity, np.flatnonzero(expected[:, index]))
        assert np.allclose(of.xyz + control.position[index], xyz[expected[:, index]], atol=1e-9)
        assert np.array_equal(of.xyz, about_parts[index][0].xyz)
        assert np.array_equal(numbers, about_parts[index][1])
    assert count == count_parts == expected[:, :2].any(axis=1).sum()  # both balls hold some
    for candidates in (whole, parts):
        assert np.array_equal(candidates.unplaced.intensity, np.flatnonzero(expected[:, 2]))


def test_a_ball_is_passed_by_itself():
    "Of two that overlap the first is handed on with all its points, before the second was passed"
    balls = Neighbourhoods(ORIGIN + np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]]), np.full(2, 2.0))
    north = np.array([-1.0, 1.5, 4.0])
    held = PointsInBalls(balls)
    held.add(PointCloud(ORIGIN + np.outer(north, [0, 1, 0]), START + north, north))
    assert held.passed(START + 2.0).tolist() == [0]
    assert held.take(0).intensity.tolist() == [-1.0, 1.5]
    assert len(held) == 2 and held.since() == START + 1.5  # s
    assert held.passed(START + 2.0).tolist() == [] and held.passed(np.inf).tolist() == [1]
    held.add(
        PointCloud(ORIGIN[None] + np.eye(3)[1:2] * 1.5, np.array([START + 9.0]), np.array([9.0]))
    )
    assert held.passed(np.inf).tolist() == [0, 1]  # with fewest points first
    assert held.take(0).intensity.tolist() == [9.0]  # not again what it was given before
    assert held.take(1).xyz[:, 1] == pytest.approx([-1.5, 1.0, -1.5])  # m, from its middle
    assert len(held) == 0 and held.since() == np.inf


def test_passes_without_a_target_count_too():
    "The pass of a later file is numbered after that of an earlier one that saw no target"
    seen = view("disc on a board", 1)
    early = PointCloud(seen.cloud.xyz + 5000.0, seen.cloud.gps_time - 0.5, seen.cloud.intensity)
    files = {"late": seen.cloud, "early": early}
    survey = survey_of(seen.trajectory, seen.control, files)
    _, about, count = near(survey, lambda name: [files[name]])
    assert count > 0
    assert set(about[0][1]) == {2}


def test_collect_far_from_control_keeps_nothing():
    "A cloud of another street gives no candidates, and extraction no targets"
    seen = view("disc on a board", 1)
    away = replace(seen.control, position=seen.control.position + 5000.0)
    survey = survey_of(seen.trajectory, away)
    candidates, about, count = near(survey, lambda _: [seen.cloud])
    assert len(candidates.unplaced) == len(about) == count == 0
    assert fit_while_reading(survey, lambda _: [seen.cloud]).targets == ()
