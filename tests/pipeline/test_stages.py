"""The stages of a correction by themselves: find, match, estimate, score."""

from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import PointCloud


@pytest.fixture(scope="module")
def survey(street):
    return mlscorr.read_survey(street)


@pytest.fixture(scope="module")
def targets(survey):
    return mlscorr.find_targets(survey)


@pytest.fixture(scope="module")
def matches(survey, targets):
    return mlscorr.match_targets(targets, survey)


@pytest.fixture(scope="module")
def estimate(survey, matches):
    return mlscorr.estimate_pos_error(survey, matches)


def without_first(survey, targets):
    "Targets found, but for that of the first control point"
    away = np.linalg.norm(targets.observations.position - survey.control.position[0], axis=1)
    return targets[away > 5.0]  # m


@pytest.mark.long
def test_stages_equal_the_command(survey, matches):
    "Stages by hand, ties with their own reading of the clouds, move points as correct does"
    with pytest.warns(UserWarning, match="No tie was found"):  # in one pass
        ties = mlscorr.find_ties(survey)
    by_hand = mlscorr.estimate_pos_error(survey, matches, ties).correction
    by_command = mlscorr.correct(survey).estimate.correction
    for cloud in mlscorr.read_cloud(survey.clouds[0]):
        apart = by_hand.apply(cloud).xyz - by_command.apply(cloud).xyz
        assert np.abs(apart).max() < 1e-4  # m


def test_targets_are_found_without_names(survey, targets):
    "All five targets of the street are there, 4 mm from their places in the cloud"
    assert len(targets) == 5
    assert set(targets.observations.name) == {None}
    assert len(targets.cloud) == targets.observations.points.sum()
    frame = targets.to_frame()
    assert len(frame) == 5 and frame["score"].between(0, 1).all()
    assert "targets" in repr(targets) and targets._repr_html_().startswith("<table>")


def test_a_filter_between_the_stages_leaves_targets_out(survey, targets):
    "A control point whose target was filtered away has no observation, and a reason says so"
    name = survey.control.name[0]
    matches = mlscorr.match_targets(without_first(survey, targets), survey)
    assert name not in matches.control.name
    assert name in [refusal.name for refusal in matches.refused]
    (reason,) = (reason for refused, reason in matches.refused if refused == name)
    assert reason.endswith(".")


def test_nothing_found_is_said_by_the_match(survey, targets):
    "A match without targets says how many were surveyed, and what to check"
    with pytest.raises(ValueError, match="None of the 5 surveyed targets was found among"):
        mlscorr.match_targets(targets[[]], survey)


def test_matches_have_misclosures_by_role(survey, matches):
    "Four control points and one check point, each with surveyed - observed"
    assert len(matches.control) == 4 and len(matches.check) == 1 and len(matches) == 5
    frame = matches.to_frame().set_index("name")
    assert set(frame["role"]) == {"control", "check"}
    for name, misclosure in zip(matches.matched.name, matches.matched.misclosure, strict=True):
        columns = [f"misclosure_{axis}" for axis in ("easting", "northing", "height")]
        assert np.allclose(frame.loc[name, columns].astype(float), misclosure)


@pytest.mark.long
def test_scores_are_those_of_the_result(survey, matches, estimate):
    "Without ties, score and CorrectedSurvey state the same RMSE, over all and by kind"
    result = mlscorr.correct(survey, ties="off")
    scores = mlscorr.score(estimate, matches)
    assert np.allclose(scores.check.after.rmse[:3], result.check["after"]["rmse"])
    assert np.allclose(scores.control.left_out.rmse[:3], result.control["leave_one_out"]["rmse"])
    kinds = [score for (role, _), score in scores.by_kind.items() if role == "control"]
    squares = sum(score.after.n * score.after.rmse**2 for score in kinds)
    assert np.allclose(np.sqrt(squares / scores.control.after.n), scores.control.after.rmse)


def test_a_score_of_other_matches_is_refused(survey, targets, estimate):
    "The estimate and the matches must be of the same control observations"
    with pytest.raises(ValueError, match="uses 4 control observations, but the matches have 3"):
        mlscorr.score(estimate, mlscorr.match_targets(without_first(survey, targets), survey))


def test_an_estimate_needs_something_to_rest_on(survey, matches):
    "Without a control point and without ties nothing tells the POS error"
    is_check = np.isin(matches.matches.matched.name, survey.check.name)
    alone = replace(
        matches.matches,
        matched=matches.matches.matched[is_check],
        probability=matches.matches.probability[is_check],
    )
    with pytest.raises(ValueError, match="No control point was matched"):
        mlscorr.estimate_pos_error(survey, replace(matches, matches=alone))


def test_the_estimate_says_its_size(estimate):
    "The frame holds corrected - recorded of each epoch, within 1e-9 m"
    frame = estimate.to_frame()
    correction = estimate.correction
    moved = correction.corrected.position - correction.recorded.position
    columns = ["shift_easting", "shift_northing", "shift_height"]
    assert np.abs(frame[columns].to_numpy() - moved).max() < 1e-9
    assert "control observations" in repr(estimate)


@pytest.mark.parametrize("stage", ["targets", "matches", "estimate", "scores"])
def test_each_stage_has_its_figure(stage, survey, targets, matches, estimate):
    "plot() gives a figure with axes, whose picture a notebook shows"
    values = {"targets": targets, "matches": matches, "estimate": estimate}
    values["scores"] = mlscorr.score(estimate, matches)
    figure = values[stage].plot()
    assert figure.axes
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_geometries_lie_where_their_stages_say(survey, targets, matches, estimate):
    "Lines of all stages about one origin meet the places of targets and trajectory, within 1 mm"
    origin = survey.control.position[0].round()
    pairs = matches.to_open3d(origin)
    ends = pairs.point["positions"].numpy() + origin
    assert len(ends) == 2 * len(matches)
    assert np.abs(ends[len(matches) :] - matches.control.surveyed.position[0]).sum(1).min() < 1e-3
    path = estimate.to_open3d(origin, color="sigma")
    assert np.allclose(
        path.point["positions"].numpy() + origin, estimate.correction.corrected.position, atol=1e-6
    )
    assert path.line["sigma"].numpy().min() > 0
    outline = targets.to_open3d(origin).point["positions"].numpy() + origin
    near = np.linalg.norm(outline[:, None] - targets.observations.position, axis=2).min(axis=1)
    assert near.max() < 2.0  # m, half a target, and its ellipsoid a hundred times enlarged
    with pytest.raises(ValueError, match="'correction' or 'sigma'"):
        estimate.to_open3d(origin, color="red")


@pytest.mark.long
def test_a_survey_of_arrays_is_corrected_as_its_files(survey, tmp_path):
    "The same points from memory give the same trajectory, and a LAZ with the corrected points"
    cloud = PointCloud.concatenate(list(mlscorr.read_cloud(survey.clouds[0])))
    path = survey.trajectory
    of_arrays = mlscorr.Survey.from_arrays(
        [cloud], path, survey.control, survey.check, survey.mounting, survey.crs
    )
    from_files = mlscorr.correct(survey)
    result = mlscorr.correct(of_arrays)
    apart = result.trajectory.position - from_files.trajectory.position
    assert np.abs(apart).max() < 1e-9
    document = result.write(tmp_path / "out", page=False)
    assert [file["points"] for file in document["files"]] == [len(cloud)]
    written = mlscorr.read_cloud(tmp_path / "out" / document["files"][0]["name"])
    xyz = PointCloud.concatenate(list(written)).xyz
    moved = from_files.estimate.correction.apply(cloud).xyz
    assert np.abs(xyz - moved).max() <= 0.0005 + 1e-6  # m, half a step of the file


def test_arrays_of_another_time_system_are_refused(survey):
    "Times a week off: the numbers, and the way out"
    cloud = next(iter(mlscorr.read_cloud(survey.clouds[0])))
    late = replace(cloud, gps_time=cloud.gps_time + 604_800.0)
    with pytest.raises(ValueError, match="different time systems"):
        mlscorr.Survey.from_arrays(late, survey.trajectory, survey.control)


def test_a_cloud_is_read_whole(street, survey):
    "read_cloud gives every point once, in the file's order, with dimensions by their names"
    parts = list(mlscorr.read_cloud(survey.clouds[0], ["return_number"], chunk_points=10_000))
    assert sum(map(len, parts)) == survey.points and len(parts) > 10
    assert {name for part in parts for name in part.attributes} == {"return_number"}
    by_path = next(iter(mlscorr.read_cloud(survey.clouds[0].path)))
    assert np.array_equal(by_path.xyz[: len(parts[0])], parts[0].xyz)
    with pytest.raises(ValueError, match="no dimension 'colour'"):
        next(iter(mlscorr.read_cloud(survey.clouds[0], ["colour"])))


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stages_equal_the_command_where_passes_are_tied(seed, tmp_path):
    "There and back again: ties collected while targets are found are those of find_ties"
    scenario = Scenario(
        drive={"duration": 5.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 3, "check": 1},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(seed)).write(tmp_path / "survey")
    survey = mlscorr.read_survey(tmp_path / "survey")
    targets = mlscorr.find_targets(survey, with_ties=True)
    matches = mlscorr.match_targets(targets, survey)
    at_once = mlscorr.estimate_pos_error(survey, matches, targets.features)
    apart = mlscorr.estimate_pos_error(survey, matches, mlscorr.find_ties(survey))
    by_command = mlscorr.correct(survey).estimate
    position = by_command.correction.corrected.position
    for estimate in (at_once, apart):
        assert np.abs(estimate.correction.corrected.position - position).max() < 1e-4  # m
