"""Files in, files out: a survey folder is corrected, and what is promised lies in the folder."""

import csv
import hashlib
import json
import math
import shutil
import warnings
from dataclasses import replace
from functools import cache

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.io.store import output_folder
from mlscorr.io.trajectories import read_trajectory
from mlscorr.survey import PointCloud
from tests.beds.shared import shared

THREE = [float, float, float]
STATISTICS = {"rmse": THREE, "mean": THREE, "min": THREE, "max": THREE}
REPORT = {  # a list of one holds any number of its kind
    "schema": str,
    "targets": [
        {
            "name": str,
            "pass": int,
            "gps_time": float,
            "role": str,
            "surveyed": THREE,
            "observed": THREE,
            "sigma": THREE,
            "before": THREE,
            "after": THREE,
            "used": bool,
            "reason": str,
        }
    ],
    "control": {
        "n": int,
        "before": STATISTICS,
        "after": STATISTICS,
        "leave_one_out": {"rmse": THREE},
    },
    "check": {"n": int, "before": STATISTICS, "after": STATISTICS},
    "model": {
        "method": str,
        "order": int,
        "covariance": {"family": str, "correlation_time": float, "scale": float},
        "estimated_by": str,
        "sigma0": float,
        "outliers": [{"name": str, "statistic": float, "critical": float}],
    },
    "coverage": {
        "control_span": [float, float],
        "longest_gap_s": float,
        "points_outside_trajectory": int,
        "points_outside_control": int,
    },
    "files": [{"name": str, "points": int, "sha256": str}],
}


@pytest.fixture(scope="module")
def corrected(street, tmp_path_factory):
    "The simulated street, corrected: (result, output folder, report.json)"
    out = tmp_path_factory.mktemp("corrected") / "out"
    result = mlscorr.correct(mlscorr.read_survey(street))
    result.write(out)
    return result, out, read_json(out)


@pytest.fixture
def copy(street, tmp_path):
    "A copy of the street's survey folder, to be changed"
    return shutil.copytree(street, tmp_path / "survey")


def read_json(out):
    return json.loads((out / "report.json").read_text(encoding="utf-8"))


def read_rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def check_schema(value, schema, where="report"):
    "Every promised key is there and of its type; None stands where there is no number"
    if isinstance(schema, dict):
        assert isinstance(value, dict), where
        for key, inner in schema.items():
            assert key in value, f"{where}.{key} is missing"
            check_schema(value[key], inner, f"{where}.{key}")
    elif isinstance(schema, list) and value is not None:
        assert isinstance(value, list), where
        if len(schema) > 1:
            assert len(value) == len(schema), where
        for i, item in enumerate(value):
            check_schema(item, schema[min(i, len(schema) - 1)], f"{where}[{i}]")
    elif value is not None:
        kinds = (int, float) if schema is float else (schema,)
        assert type(value) in kinds, f"{where} is {value!r}, not {schema.__name__}"
        assert not isinstance(value, float) or math.isfinite(value), where


def test_a_verdict_knows_the_sigma_of_what_it_rests_on(corrected):
    "Of check points that of targets and corrected position, of those left out that of their tests"
    result = corrected[0]
    check = result.matched_check
    there = result.trajectory.at(result.matched_check.gps_time)
    variance = check.variance + there.position_sigma**2
    np.testing.assert_allclose(result._check.sigma, np.sqrt(variance.mean(axis=0)))
    sigma = np.vstack([test.sigma for test in result.estimate.tests])
    np.testing.assert_allclose(result._control.sigma, np.sqrt((sigma**2).mean(axis=0)))


def test_before_and_after_are_of_the_same_control_points(corrected):
    "A point that was refused, 2 m off, counts neither before, nor after, nor left out in turn"
    result = corrected[0]
    matched = result.matched_control
    estimate = result.estimate
    used = np.arange(len(matched)) != 1
    surveyed = matched.surveyed.position + np.where(used[:, None], 0.0, 2.0)
    wrong = replace(matched, surveyed=replace(matched.surveyed, position=surveyed))
    left_out = np.where(used[:, None], estimate.left_out, np.nan)
    without = replace(estimate, used=used, left_out=left_out)
    control = replace(result, matched_control=wrong, estimate=without)._control
    assert control.before.n == control.after.n == control.left_out.n == len(matched) - 1
    np.testing.assert_allclose(control.before.mean[:3], wrong[used].misclosure.mean(axis=0))


@pytest.mark.long
def test_points_that_are_control_and_check_at_once_are_no_matter_of_the_crs(copy):
    "Each place has two names, so neither is believed: the way out is to leave one of them out"
    header, *lines = (copy / "control.csv").read_text(encoding="utf-8").splitlines()
    others = {"control": "check", "check": "control"}
    twice = [line.rsplit(",", 1) for line in lines]
    lines += [f"K{start},{others[role]}" for start, role in twice]
    (copy / "control.csv").write_text("\n".join([header, *lines, ""]), encoding="utf-8")
    with warnings.catch_warnings(action="ignore"), pytest.raises(ValueError) as caught:
        mlscorr.correct(mlscorr.read_survey(copy))
    assert str(caught.value).endswith("each point is listed twice")
    assert "CRS" not in str(caught.value)


# ---- what is written


def test_check_points_fit_better_after_the_correction(corrected):
    "The check point's misclosure shrinks on every axis, to a centimetre or less"
    check = corrected[2]["check"]
    assert check["n"] == 1
    assert np.all(np.array(check["after"]["rmse"]) < check["before"]["rmse"])
    assert max(check["after"]["rmse"]) < 0.010


def test_the_report_has_every_key_that_is_promised(corrected):
    "report.json holds to its promise: the schema first, then every key with its type"
    report = corrected[2]
    assert next(iter(report)) == "schema"
    assert report["schema"] == "mlscorr.report/1"
    check_schema(report, REPORT)
    assert report["targets"] and report["files"]


def test_numbers_in_the_report_are_finite(corrected):
    "No NaN and no infinity, which are not JSON, stand anywhere in report.json"

    def refuse(constant):
        raise AssertionError(constant)

    json.loads((corrected[1] / "report.json").read_text(), parse_constant=refuse)


def test_misclosures_are_surveyed_minus_observed(corrected):
    "before is surveyed - observed, and after is what remains of it at the corrected place"
    result, _, report = corrected
    correction = result.estimate.correction
    for target in report["targets"]:
        observed = np.array(target["observed"])
        before = np.array(target["surveyed"]) - observed
        assert target["before"] == pytest.approx(before, abs=1e-9)
        centre = PointCloud(observed[None], np.array([target["gps_time"]]), np.zeros(1))
        after = np.array(target["surveyed"]) - correction.apply(centre).xyz[0]
        assert target["after"] == pytest.approx(after, abs=1e-9)


def is_scored(row, role):
    return row["role"] == role and row["observed"] and (row["used"] or role == "check")


@pytest.mark.parametrize("role", ["control", "check"])
@pytest.mark.parametrize("when", ["before", "after"])
def test_statistics_follow_from_the_targets(corrected, role, when):
    "RMSE, mean, least and largest are those of the targets listed, in m"
    report = corrected[2]
    rows = np.array([row[when] for row in report["targets"] if is_scored(row, role)])
    group = report[role]
    assert group["n"] == len(rows)
    assert group[when]["rmse"] == pytest.approx(np.sqrt((rows**2).mean(axis=0)))
    assert group[when]["mean"] == pytest.approx(rows.mean(axis=0))
    assert group[when]["min"] == pytest.approx(rows.min(axis=0))
    assert group[when]["max"] == pytest.approx(rows.max(axis=0))


def test_check_points_are_listed_as_not_used(corrected):
    "Control points are used without a reason; check points are not, and say why"
    for target in corrected[2]["targets"]:
        assert target["used"] == (target["role"] == "control")
        assert target["reason"] == (None if target["used"] else "check point")


def test_coverage_is_the_span_of_the_control_points(corrected):
    "control_span, longest gap (ends of the pass too) and the points beyond follow from the files"
    result, _, report = corrected
    times = sorted(t["gps_time"] for t in report["targets"] if t["used"])
    coverage = report["coverage"]
    assert coverage["control_span"] == pytest.approx([times[0], times[-1]])
    (ends,) = result.trajectory.scanned_passes
    longest = np.diff([ends[0], *times, ends[1]]).max()
    assert coverage["longest_gap_s"] == pytest.approx(longest)
    assert np.ptp(report["model"]["longest_gap"]) == pytest.approx(longest)
    points = laspy.read(result.survey.clouds[0].path).gps_time
    outside = (points < times[0]) | (points > times[-1])
    assert coverage["points_outside_control"] == outside.sum()
    assert coverage["points_outside_trajectory"] == 0


def test_the_cloud_keeps_all_but_its_coordinates(corrected):
    "Same number and order of points, every other field untouched, header scale and CRS as well"
    result, out, report = corrected
    source = result.survey.clouds[0].path
    before = laspy.read(source)
    after = laspy.read(out / source.name)
    assert len(after) == len(before) == report["files"][0]["points"]
    for name in before.point_format.dimension_names:
        if name not in ("X", "Y", "Z"):
            assert np.array_equal(before[name], after[name]), name
    assert np.array_equal(before.header.scales, after.header.scales)
    assert after.header.parse_crs() == before.header.parse_crs()


def test_the_points_move_as_the_correction_says(corrected):
    "The written coordinates are Correction.apply of the read ones, to the file's rounding"
    result, out, _ = corrected
    source = result.survey.clouds[0].path
    before = laspy.read(source)
    after = laspy.read(out / source.name)
    cloud = PointCloud(before.xyz, np.asarray(before.gps_time), np.asarray(before.intensity))
    expected = result.estimate.correction.apply(cloud).xyz
    assert np.abs(after.xyz - expected).max() < 0.6e-3
    assert np.abs(after.xyz - before.xyz).max() > 5e-3


def test_files_are_listed_with_their_digest(corrected):
    "sha256 is that of the corrected file"
    _, out, report = corrected
    for file in report["files"]:
        digest = hashlib.sha256((out / file["name"]).read_bytes()).hexdigest()
        assert file["sha256"] == digest


def test_the_corrected_trajectory_can_be_read_again(corrected):
    "trajectory.csv is a trajectory with sigma columns, equal to the result's to its rounding"
    result, out, _ = corrected
    written = read_trajectory(out / "trajectory.csv")
    assert written.gps_time == pytest.approx(result.trajectory.gps_time, abs=1e-6)
    assert np.abs(written.position - result.trajectory.position).max() < 1e-5
    assert np.abs(written.position_sigma - result.trajectory.position_sigma).max() < 1e-5
    assert written.attitude_sigma.min() > 0
    turned = (written.attitude * result.trajectory.attitude.inv()).magnitude()
    assert np.degrees(turned.max()) < 1e-6


@pytest.mark.long
def test_further_files_hold_the_corrected_trajectory(commanded, corrected):
    "--trajectory writes an SBET with its smrmsg and TUM's quaternions, and the report lists them"
    out = commanded[1]
    expected = corrected[0].trajectory
    outputs = [file["name"] for file in read_json(out)["outputs"]]
    names = ["drive.sbet", "smrmsg_drive.out", "drive.tum"]
    assert outputs == ["trajectory.csv", *names, "targets.csv", "weak.csv", "weak.geojson"]
    sbet = read_trajectory(out / names[0], corrected[0].survey.crs, out / names[1])
    for written in (sbet, read_trajectory(out / names[2])):
        assert np.abs(written.position - expected.position).max() < 2e-5
        assert np.degrees((written.attitude * expected.attitude.inv()).magnitude().max()) < 1e-6
    assert np.abs(sbet.position_sigma - expected.position_sigma).max() < 1e-12


def test_targets_csv_says_the_same_as_the_report(corrected):
    "One row for each target and pass, misclosures to 0.1 mm"
    _, out, report = corrected
    rows = read_rows(out / "targets.csv")
    assert [row["name"] for row in rows] == [target["name"] for target in report["targets"]]
    for row, target in zip(rows, report["targets"], strict=True):
        assert (int(row["pass"]), row["scanned"]) == (
            target["pass"],
            str(target["scanned"]).lower(),
        )
        for what in ("surveyed", "observed", "sigma", "before", "after", "left_out"):
            cells = [row[f"{what}_{axis}"] for axis in ("easting", "northing", "height")]
            numbers = [float(cell) for cell in cells if cell]
            assert numbers == pytest.approx(target[what] or [], abs=0.6e-4)


def test_page_and_pictures_are_there(corrected):
    "report.html is a page, and every picture is a PNG"
    _, out, _ = corrected
    assert "</html>" in (out / "report.html").read_text(encoding="utf-8")
    pictures = list((out / "pictures").iterdir())
    assert pictures
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in pictures)


def test_nothing_half_done_stays(corrected):
    "No .part is left in or beside the output folder"
    out = corrected[1]
    assert list(out.parent.iterdir()) == [out]
    assert not list(out.rglob("*.part"))


# ---- what must not matter


def test_the_same_input_gives_the_same_bytes(corrected, commanded):
    "Cloud, trajectory and targets.csv of a run in another process are identical byte for byte"
    for name in ("pass-1.laz", "trajectory.csv", "targets.csv"):
        assert (commanded[1] / name).read_bytes() == (corrected[1] / name).read_bytes()


def test_check_points_never_change_the_estimate(corrected, copy, tmp_path):
    "A check point moved by 5 m changes no corrected coordinate and no number of the model"
    move(copy / "control.csv", "T03", (5.0, 0.0, 0.0))
    mlscorr.correct(mlscorr.read_survey(copy)).write(tmp_path / "out", page=False)
    report = read_json(tmp_path / "out")
    for name in ("pass-1.laz", "trajectory.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (corrected[1] / name).read_bytes()
    assert report["model"] == corrected[2]["model"]
    assert report["control"] == corrected[2]["control"]
    assert report["check"]["n"] == 0


def test_a_check_point_that_is_still_found_changes_nothing_but_itself(corrected, copy):
    "Moved by 5 cm, its misclosures grow by that to 1 mm, for the cloud is cut about it; no other's"
    move(copy / "control.csv", "T03", (0.0, 0.0, 0.05))
    moved = mlscorr.correct(mlscorr.read_survey(copy))
    for name in ("position", "position_sigma", "attitude_sigma"):
        assert np.array_equal(
            getattr(moved.trajectory, name), getattr(corrected[0].trajectory, name)
        )
    assert moved.control == corrected[0].control
    old = corrected[0].matched_check.observations
    new = moved.matched_check.observations
    assert old.name == new.name
    others = np.array([name != "T03" for name in old.name])
    assert np.array_equal(new.position[others], old.position[others])
    for when in ("before", "after"):
        grown = np.subtract(moved.check[when]["mean"], corrected[0].check[when]["mean"])
        assert grown == pytest.approx([0.0, 0.0, 0.05], abs=1e-3)  # m


def move(path, name, step):
    "Move a point of control.csv"
    rows = read_rows(path)
    for row in rows:
        if row["name"] == name:
            for axis, value in zip(("easting", "northing", "height"), step, strict=True):
                row[axis] = f"{float(row[axis]) + value:.4f}"
    lines = [",".join(rows[0])] + [",".join(row.values()) for row in rows]
    path.write_text("\n".join(lines) + "\n")


def test_passes_count_in_time_whatever_the_files_are_called(corrected, copy):
    "The earlier file is pass 1 though its name sorts last; the result is that of one file, to 1 mm"
    las = laspy.read(copy / "pass-1.laz")
    early = las.gps_time < 357703.6
    for name, rows in (("b.laz", early), ("a.laz", ~early)):
        part = laspy.LasData(las.header)
        part.points = las.points[rows]
        part.write(copy / name)
    (copy / "pass-1.laz").unlink()
    toml = (copy / "survey.toml").read_text().replace('"pass-1.laz"', '"*.laz"')
    (copy / "survey.toml").write_text(toml)
    result = mlscorr.correct(mlscorr.read_survey(copy))
    passes = {row.name: row.pass_number for row in result.targets}
    assert passes == {"T01": 1, "T02": 1, "T03": 2, "T04": 2, "T05": 2}
    assert [file.path.name for file in result.survey.clouds] == ["a.laz", "b.laz"]
    assert np.abs(result.trajectory.position - corrected[0].trajectory.position).max() < 1e-3


# ---- what has no pose


@pytest.mark.long
def test_points_without_a_pose_stay_as_they_were_and_are_counted(in_part):
    "Before the trajectory and in its gap nothing moves, everywhere else something does"
    out = in_part[1]
    source = out.parent / "survey"
    before = laspy.read(source / "pass-1.laz")
    after = laspy.read(out / "pass-1.laz")
    inside = read_trajectory(source / "trajectory.csv").segment(before.gps_time) >= 0
    assert read_json(out)["coverage"]["points_outside_trajectory"] == (~inside).sum() > 0
    moved = (before.xyz != after.xyz).any(axis=1)
    assert not moved[~inside].any()
    assert moved[inside].mean() > 0.99


def test_a_target_in_a_gap_is_refused_with_the_reason(in_part):
    "Nothing is interpolated across a gap; the other targets are used as before"
    report = read_json(in_part[1])
    row = next(target for target in report["targets"] if target["name"] == "T02")
    assert not row["used"]
    assert "outside the trajectory or in one of its gaps" in row["reason"]
    assert row["observed"] is row["before"] is row["after"] is row["gps_time"] is None
    assert [t["name"] for t in report["targets"] if t["used"]] == ["T01", "T04", "T05"]
    check_schema(report, REPORT)


# ---- what is little, and what is refused


def test_two_control_points_give_a_correction_of_order_zero(copy):
    "The order falls and says so; what is left still makes the check points fit better"
    text = (copy / "control.csv").read_text().splitlines()
    text[2:5] = [line.replace(",control", ",check") for line in text[2:5]]
    (copy / "control.csv").write_text("\n".join(text) + "\n")
    with pytest.warns(UserWarning, match="2 control points") as told:
        result = mlscorr.correct(mlscorr.read_survey(copy), order=1)
    assert any("Order 0 is used" in str(warning.message) for warning in told)
    assert result.estimate.order == 0
    assert result.check["n"] == 3
    after, before = (np.linalg.norm(result.check[when]["rmse"]) for when in ("after", "before"))
    assert after < before


def test_check_points_alone_give_no_estimate(copy):
    "Without a control point there is nothing to estimate from, and check points stay out of it"
    text = (copy / "control.csv").read_text().replace(",control", ",check")
    (copy / "control.csv").write_text(text)
    with pytest.raises(ValueError, match="5 check points and no control point"):
        mlscorr.correct(mlscorr.read_survey(copy))


@pytest.mark.parametrize("place", [".", "clouds", "poses"])
def test_no_folder_of_an_input_is_written_to(place, corrected, copy, monkeypatch):
    "Cloud, trajectory and survey.toml may lie apart: none of their folders takes results"
    for folder, name in (("clouds", "pass-1.laz"), ("poses", "trajectory.csv")):
        (copy / folder).mkdir()
        (copy / name).rename(copy / folder / name)
        toml = (copy / "survey.toml").read_text().replace(f'"{name}"', f'"{folder}/{name}"')
        (copy / "survey.toml").write_text(toml)
    survey = mlscorr.read_survey(copy)
    result = replace(corrected[0], survey=survey)
    monkeypatch.chdir(copy)
    with pytest.raises(ValueError, match="contains the input"):
        result.write(place, overwrite=True)


@pytest.fixture
def full(tmp_path):
    "An output folder with results of an earlier run, and with files of the user's own"
    out = tmp_path / "out"
    (out / "pictures").mkdir(parents=True)
    for name in ("pass-1.laz", "report.json", "notes.txt", "pictures/mine.png"):
        (out / name).write_text("old")
    return out


def write_new(out):
    "Write a small result like a run"
    with output_folder(out, overwrite=True) as folder:
        (folder / "pictures").mkdir()
        for name in ("pass-1.laz", "pictures/map.png", "report.json", "targets.csv"):
            (folder / name).write_text("new")


def texts(out):
    return {str(p.relative_to(out)): p.read_text() for p in out.rglob("*") if p.is_file()}


def test_overwriting_replaces_files_of_the_same_name_only(full):
    "Other files in the folder, and in its pictures, are kept"
    write_new(full)
    new = ("pass-1.laz", "pictures/map.png", "report.json", "targets.csv")
    old = ("notes.txt", "pictures/mine.png")
    assert texts(full) == dict.fromkeys(new, "new") | dict.fromkeys(old, "old")
    assert list(full.parent.iterdir()) == [full]


@pytest.mark.parametrize("where", ["report.json", "targets.csv"])
def test_results_that_cannot_take_their_place_leave_the_old_ones(where, full):
    "A user's folder stands where a file belongs: all is put back, and the folder stays"
    (full / where).unlink(missing_ok=True)
    (full / where).mkdir()
    (full / where / "mine.txt").write_text("mine")
    before = texts(full)
    with pytest.raises(OSError, match="is a folder, but a file is needed there"):
        write_new(full)
    assert texts(full) == before
    assert list(full.parent.iterdir()) == [full]


# ---- surveys that others made


@cache
def correct_shared(name):
    "The result of a shared survey; what it warns of is not the point here"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return mlscorr.correct(mlscorr.read_survey(shared("surveys", name)))


@pytest.mark.long
def test_a_real_drift_of_half_a_metre_is_corrected():
    "wuhan_drive: all 24 targets matched, check points within 0.10, 0.07, 0.07 m (raw 0.55 m)"
    result = correct_shared("wuhan_drive")
    assert len(result.matched_control) + len(result.matched_check) == 24
    assert np.all(np.array(result.check["after"]["rmse"]) <= [0.10, 0.07, 0.07])
    assert max(result.check["before"]["rmse"]) > 0.5


@pytest.mark.long
def test_where_nothing_is_wrong_nothing_gets_worse():
    "practice_none: check points within 12 mm, and no axis more than 2 mm worse than before"
    check = correct_shared("practice_none").check
    after = np.array(check["after"]["rmse"])
    before = np.array(check["before"]["rmse"])
    assert after.max() <= 0.012
    assert (after - before).max() <= 0.002


@pytest.mark.long
@pytest.mark.parametrize("effect", ["lever_arm", "position_bump", "time_offset"])
def test_effects_of_another_simulator_are_corrected(effect):
    "Whatever was wrong, check points fit within 2 cm on every axis"
    assert max(correct_shared(f"practice_{effect}").check["after"]["rmse"]) <= 0.020


@pytest.mark.long
def test_a_drive_that_is_known_to_millimetres_is_not_called_extrapolated():
    "practice_lever_arm: 16 control points and ties hold nine tenths of it, drift or bias alike"
    support = correct_shared("practice_lever_arm").estimate.support
    assert sum(interval.seconds for interval in support.weak) < 0.1 * 104.0  # s


@pytest.mark.long
def test_two_passes_by_a_target_are_two_observations():
    "practice_lever_arm: every target is seen in pass 1 and in pass 2"
    result = correct_shared("practice_lever_arm")
    for seen in (result.matched_control, result.matched_check):
        names = np.array(seen.name)
        passes = seen.observations.pass_number
        assert set(passes) == {1, 2}
        assert sorted(names[passes == 1]) == sorted(names[passes == 2])


def test_a_notebook_shows_table_figure_and_data_frame(corrected):
    "The RMSE that the report has, a figure of it, and the rows of targets.csv"
    result, out, told = corrected
    assert f"{told['check']['after']['rmse'][0]:.3f}" in result._repr_html_()
    assert result.plot("residuals").axes
    with (out / "targets.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    frame = result.to_frame()
    assert frame["name"].tolist() == [row["name"] for row in rows]
    height = [float(row["after_height"]) for row in rows]
    assert np.allclose(frame["after_height"], height, atol=1e-4)
