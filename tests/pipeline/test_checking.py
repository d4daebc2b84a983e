"""A survey folder in: all that is wrong with it at once, and what a correction will take."""

import re
import shutil
import warnings

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.cli.terminal import is_quiet
from mlscorr.io.tables import read_control
from mlscorr.pipeline.faults import Faults, find_faults

NEAR = 1.5  # m from a surveyed point: what is left of the cloud


@pytest.fixture(scope="module")
def small(street, tmp_path_factory):
    "The street with little more than four of its targets"
    folder = tmp_path_factory.mktemp("small") / "survey"
    shutil.copytree(street, folder, ignore=shutil.ignore_patterns("truth.*"))
    header, *rows = (folder / "control.csv").read_text().splitlines()
    checks = [row for row in rows if row.endswith(",check")]
    rows = [row for row in rows if row not in checks][:3] + checks[:1]
    (folder / "control.csv").write_text("\n".join([header, *rows]) + "\n")
    cloud = laspy.read(folder / "pass-1.laz")
    control, check, _ = read_control(folder / "control.csv")
    places = (control + check).position
    away = np.linalg.norm(cloud.xyz[:, None] - places, axis=2).min(axis=1)
    cloud.points = cloud.points[away < NEAR]
    cloud.write(folder / "pass-1.laz")
    return folder


@pytest.fixture
def survey(small, tmp_path):
    "A copy to be changed"
    return shutil.copytree(small, tmp_path / "survey")


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def change_control(folder, column, change):
    "Set a column of the control anew"
    header, *rows = (folder / "control.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[column] = f"{change(float(row[column])):.4f}"
    (folder / "control.csv").write_text("\n".join([header, *map(",".join, cells)]) + "\n")


def sentences(checked):
    return [fault.sentence for fault in checked.faults]


def test_a_good_survey_has_no_fault_and_is_counted(small):
    "Nothing is said against it; points, passes, files and control are those that it has"
    checked = mlscorr.check(small)
    assert (checked.faults, checked.warnings) == ((), ())
    amounts = {amount.what: amount.number for amount in checked.read}
    assert amounts["points"] == laspy.read(small / "pass-1.laz").header.point_count
    assert [amounts[name] for name in ("scanners", "passes", "control points", "check points")] == [
        *(1, 1),
        *(3, 1),
    ]
    assert amounts["trajectory"] == pytest.approx(8.0)
    written = sum(amount.number for amount in checked.written)
    assert written > (small / "pass-1.laz").stat().st_size / 1e6
    needed = {amount.what: amount for amount in checked.needed}
    assert needed["time"].number > needed["report and pictures"].number > 0
    assert all(amount.source for amount in (*checked.read, *checked.written, *checked.needed))


def test_a_target_that_is_not_where_it_should_be_is_named(survey):
    "A height of 0, as lists of total stations have it where none was measured: its point by name"
    path = survey / "control.csv"
    header, first, *rows = path.read_text().splitlines()
    cells = first.split(",")
    path.write_text("\n".join([header, ",".join([*cells[:3], "0.0", *cells[4:]]), *rows, ""]))
    notes = mlscorr.check(survey).notes
    assert f"3 of 4 tested targets were found, not {cells[0]}." in notes


def test_faults_are_counted_as_the_sentences_count_them(survey):
    "A list with an unknown kind everywhere and one size in millimetres: two, and the end says so"
    text = (survey / "control.csv").read_text().replace("circle", "ball")
    (survey / "control.csv").write_text(text.replace(",0.6,", ",600,", 1))
    (fault,) = mlscorr.check(survey).faults
    assert "control.csv has 2 faults" in fault.sentence and fault.number == 2
    result = CliRunner().invoke(app, ["check", str(survey)])
    assert result.exit_code == 3 and result.stderr.endswith("\n2 faults\n")


def test_all_faults_are_named_at_once(survey):
    "Two missing files, a bad CRS, exchanged axes, a cut cloud: five sentences, not the first alone"
    edit(survey / "survey.toml", '"pass-1.laz"', '"pass-1.laz", "pass-2.laz"')
    edit(survey / "survey.toml", "EPSG:32650", "EPSG:4326")
    edit(survey / "survey.toml", "[control]", '[scene]\nreference = "mesh.ply"\n[control]')
    header, *rows = (survey / "control.csv").read_text().splitlines()
    swapped = [",".join([c[0], c[2], c[1], *c[3:]]) for c in (row.split(",") for row in rows)]
    (survey / "control.csv").write_text("\n".join([header, *swapped]) + "\n")
    cloud = (survey / "pass-1.laz").read_bytes()
    (survey / "pass-1.laz").write_bytes(cloud[: len(cloud) // 2])
    checked = mlscorr.check(survey)
    expected = ("projected CRS", "pass-2.laz", "mesh.ply", "be swapped", "truncated")
    assert len(checked.faults) == len(expected)
    for words in expected:
        assert any(words in sentence for sentence in sentences(checked)), words
    assert [fault.where for fault in checked.faults].count("survey.toml") == 3
    assert "until the faults are corrected" in checked.unchecked[0]


@pytest.mark.parametrize(
    ("column", "change", "words"),
    [
        (3, lambda height: height + 15.3, r"4 of 4 .* 15\.[23]\d m below .* vertical datum"),
        (
            7,
            lambda size: size / 2,
            "0 of 4 tested points are found with these sizes, 4 with sizes doubled",
        ),
    ],
    ids=["heights", "radii"],
)
def test_a_quick_look_tells_heights_and_radii(column, change, words, survey):
    "Targets that are there at other heights or of twice the size say what is wrong by how much"
    change_control(survey, column, change)
    checked = mlscorr.check(survey)
    assert len(checked.faults) == 1
    assert re.search(words, sentences(checked)[0])


@pytest.mark.parametrize("lines", [0, 1], ids=["empty", "header"])
def test_a_survey_without_control_points_has_a_fault(lines, survey):
    "A fault that stops a correction is reported before it, in the same sentence"
    text = (survey / "control.csv").read_text().splitlines(keepends=True)
    (survey / "control.csv").write_text("".join(text[:lines]))
    checked = mlscorr.check(survey)
    assert len(checked.faults) == 1 and checked.faults[0].where == "data"
    with pytest.raises(ValueError, match="has no control points") as refused:
        mlscorr.correct(mlscorr.read_survey(survey))
    assert sentences(checked) == [str(refused.value)]


def test_a_survey_of_check_points_alone_names_what_does_without_control(survey):
    "Passes that overlap can still be brought together: the refusal says how"
    text = (survey / "control.csv").read_text().replace(",control", ",check")
    (survey / "control.csv").write_text(text)
    with pytest.raises(ValueError, match=r"no control point.*role control,.*--ties-only"):
        mlscorr.correct(mlscorr.read_survey(survey))


@pytest.mark.long
@pytest.mark.parametrize(("number", "words"), [(1, "1 control point was"), (2, "2 control points")])
def test_few_control_points_are_a_warning_as_in_a_correction(number, words, survey):
    "One or two can't be tested: told beforehand in the sentence of the correction itself"
    lines = (survey / "control.csv").read_text().splitlines(keepends=True)
    (survey / "control.csv").write_text("".join([lines[0], *lines[1 : number + 1], lines[-1]]))
    checked = mlscorr.check(survey)
    (warning,) = checked.warnings
    assert not checked.faults and warning.startswith(f"Only {words}")
    with warnings.catch_warnings(record=True, action="always") as caught:
        mlscorr.correct(mlscorr.read_survey(survey))
    assert warning in [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("kept", "words"), [((), "No point of the cloud"), (("check",), "only 1 ")]
)
def test_control_outside_all_clouds_is_a_fault_as_in_a_correction(kept, words, survey):
    "Nine control points down the street, more than are looked at, or beside one check point"
    header, *rows = (survey / "control.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows for _ in range(3)]
    for i, row in enumerate(cells):
        if row[-1] not in kept:
            row[0], row[1] = f"T{i}", f"{float(row[1]) + 300.0 + i:.3f}"
    rows = dict.fromkeys(map(",".join, cells))
    (survey / "control.csv").write_text("\n".join([header, *rows]) + "\n")
    with warnings.catch_warnings(action="ignore"):
        (fault,) = mlscorr.check(survey).faults
    with pytest.raises(ValueError, match=words) as refused:
        mlscorr.correct(mlscorr.read_survey(survey))
    assert fault.where == "data" and words in fault.sentence
    assert fault.sentence[:20] == str(refused.value)[:20]


def test_a_small_difference_of_heights_is_a_warning_as_in_a_correction(survey):
    "Within the search radius targets are found, and the datum is doubted in the same sentence"
    change_control(survey, 3, lambda height: height + 3.0)
    checked = mlscorr.check(survey)
    assert not checked.faults
    assert any("vertical datum" in sentence for sentence in checked.warnings)


def test_a_scale_of_the_control_is_a_value_and_a_warning(street, tmp_path):
    "Distances longer by 5000 ppm on a drive of 50 m: to 1000 ppm, as in a correction"
    survey = shutil.copytree(street, tmp_path / "survey")
    header, *rows = (survey / "control.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    place = np.array([row[1:3] for row in cells], dtype=float)
    place += 0.005 * (place - place.mean(axis=0))
    for row, scaled in zip(cells, place, strict=True):
        row[1:3] = [f"{value:.4f}" for value in scaled]
    (survey / "control.csv").write_text("\n".join([header, *map(",".join, cells)]) + "\n")
    checked = mlscorr.check(survey)
    (found,) = checked.datum
    assert found.term == "scale" and found.sentence in checked.warnings
    assert found.size[0] == pytest.approx(0.005, abs=0.001)
    with pytest.warns(UserWarning, match="control network is larger"):
        (corrected,) = mlscorr.correct(mlscorr.read_survey(survey)).datum
    assert corrected.size[0] == pytest.approx(0.005, abs=0.001)


@pytest.mark.long
def test_the_crs_of_the_cloud_counts(survey):
    "Another zone in survey.toml is a fault here and a warning in a correction; none is a hint"
    edit(survey / "survey.toml", "EPSG:32650", "EPSG:32649")
    with warnings.catch_warnings(action="ignore"):
        checked = mlscorr.check(survey)
    assert re.search("EPSG:32650.*EPSG:32649.*km apart", sentences(checked)[0])
    with pytest.warns(UserWarning, match="VLRs of pass-1.laz state EPSG:32650"):
        mlscorr.read_survey(survey)
    edit(survey / "survey.toml", 'crs = "EPSG:32649"', "")
    checked = mlscorr.check(survey)
    assert not checked.faults
    assert any('set crs = "EPSG:32650"' in sentence for sentence in checked.warnings)


def test_points_outside_the_trajectory_are_a_share(survey):
    "A trajectory that ends before the last fifth of the points: told beforehand, with the share"
    end = np.quantile(laspy.read(survey / "pass-1.laz").gps_time, 0.8)
    header, *rows = (survey / "trajectory.csv").read_text().splitlines()
    rows = [row for row in rows if float(row.split(",")[0]) < end]
    (survey / "trajectory.csv").write_text("\n".join([header, *rows]) + "\n")
    checked = mlscorr.check(survey)
    assert not checked.faults
    words = r"1[2-4] of 65 points sampled from pass-1.laz .* by up to \d\.\d+ s"
    assert any(re.match(words, text) for text in checked.warnings)


def test_a_cloud_in_feet_is_named(survey):
    "By its header, with the way it would lie beside the trajectory"
    data = bytearray((survey / "pass-1.laz").read_bytes())
    numbers = np.frombuffer(data, "<f8", 12, 131)  # scale, offset and box
    data[131:227] = (numbers / 0.3048).tobytes()
    (survey / "pass-1.laz").write_bytes(data)
    assert any(
        "near it with its coordinates taken as feet" in s for s in sentences(mlscorr.check(survey))
    )


def test_what_lies_beside_the_cloud_is_counted(survey):
    "A surveyed point 300 m down the street is named before anything is read"
    row = (survey / "control.csv").read_text().splitlines()[-1].split(",")
    row[:2] = "T99", f"{float(row[1]) + 300.0:.3f}"
    with (survey / "control.csv").open("a") as file:
        file.write(",".join(row) + "\n")
    assert any("first: T99" in sentence for sentence in mlscorr.check(survey).warnings)


@pytest.mark.long
def test_the_command_says_what_the_function_returns(survey):
    "A page without a fault ends with the next command; a fault with its code, warnings before"
    good = CliRunner().invoke(app, ["check", str(survey)])
    assert good.exit_code == 0, good.stderr
    for title in ("Read", "Written", "Needed", "Determined"):
        assert title in good.stderr.splitlines()
    assert good.stderr.splitlines()[-1].startswith("No fault, 0 warnings. Next: mlscorr correct")
    spaced = survey.rename(survey.parent / "second drive")
    again = CliRunner().invoke(app, ["check", str(spaced)])
    assert again.stderr.splitlines()[-1].endswith(f"mlscorr correct '{spaced}' -o OUT")
    survey = spaced.rename(survey)
    (survey / "control.csv").unlink()
    bad = CliRunner().invoke(app, ["check", str(survey), "--quiet"])
    assert bad.exit_code == 2
    assert bad.stderr.splitlines()[0].startswith("Error: control.file of ")
    assert bad.stderr.splitlines()[-1] == "1 fault"
    assert not is_quiet()  # a command that was asked to be quiet leaves the next as it was


def test_a_fault_is_kept_once_and_where_it_is(tmp_path):
    "The same sentence twice is one fault; what the system refuses is the system's"
    faults = Faults()
    find_faults(tmp_path / "none", faults)
    find_faults(tmp_path / "none", faults)
    assert [fault.where for fault in faults.faults] == ["survey.toml"]
    faults.of("data", (tmp_path / "none").read_text)
    assert faults.faults[-1].where == "system"


def test_points_that_are_surveyed_twice_are_a_fault_as_in_a_correction(street, tmp_path):
    "More of them than are looked at, each as P and P.1: nothing tells which of the two was seen"
    folder = shutil.copytree(street, tmp_path / "survey", ignore=shutil.ignore_patterns("truth.*"))
    header, *rows = (folder / "control.csv").read_text().splitlines()
    again = [row.replace(",", ".1,", 1) for row in rows]
    (folder / "control.csv").write_text("\n".join([header, *rows, *again]) + "\n")
    assert 2 * len(rows) > 8
    with warnings.catch_warnings(action="ignore"):
        (fault,) = mlscorr.check(folder).faults
        with pytest.raises(ValueError, match="each point is listed twice") as refused:
            mlscorr.correct(mlscorr.read_survey(folder), ties="off")
    assert fault.sentence == str(refused.value)


def test_a_check_without_a_look_at_targets_does_not_pass_them(survey):
    "Points of a long file out of order: no target is looked for, and the last line says so"
    cloud = laspy.read(survey / "pass-1.laz")
    rows = np.random.default_rng(1).permutation(np.resize(np.arange(len(cloud.points)), 510_000))
    cloud.points = cloud.points[rows]
    (survey / "pass-1.laz").unlink()
    cloud.write(survey / "pass-1.las")
    edit(survey / "survey.toml", "pass-1.laz", "pass-1.las")
    result = CliRunner().invoke(app, ["check", str(survey)])
    assert result.exit_code == 0, result.stderr
    assert "pass-1.las are not in time order" in result.stderr
    words = "No fault in what was checked, .*; no control point was found, see Not checked."
    assert re.match(words, result.stderr.splitlines()[-1])
