"""A survey compared: every method in one table, from files to files."""

import csv
import json
import shutil
import subprocess
import sys
import warnings

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.baselines import RAW, Transformation
from mlscorr.io.clouds import read_chunks
from mlscorr.io.surveys import read_survey
from mlscorr.simulate import Scenario, simulate
from tests.beds.copies import write_corrected
from tests.beds.documents import undocumented
from tests.beds.places import BENCHMARKS, MLSCORR
from tests.beds.shared import shared

NAMES = ["raw", "shift", "transformation", "rigid", "affine", "icp"]
NAMES += ["ls-2", "ls-3", "ls-4", "ls-5", "linear", "pchip", "linear-steps", "gp"]
NAMES += ["lsc-2", "lsc-3", "lsc-4", "lsc-5", "lsc", "correct"]
ONE_MOVE = ("shift", "transformation", "rigid", "affine", "icp")


def compare(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # extrapolation, and ICP's own; they stand in the rows
        return mlscorr.compare(mlscorr.read_survey(folder))


def rewrite_control(folder, change):
    "Write control.csv anew with the rows (dicts) that change(rows) gives"
    path = folder / "control.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = list(rows[0])
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(change(rows))


@pytest.fixture(scope="module")
def compared(street):
    return compare(street)


@pytest.fixture(scope="module")
def commanded(street, tmp_path_factory):
    "mlscorr compare --json with two clouds on the street: (process, out)"
    out = tmp_path_factory.mktemp("compared") / "out"
    command = [MLSCORR, "compare", street, "-o", out, "--json"]
    command += ["--clouds", "shift", "--clouds", "lsc"]
    return subprocess.run(command, capture_output=True, text=True), out


# ---- the document


def test_all_methods_stand_in_the_document_in_their_order(compared):
    "compare.json names every method, with check, control and seconds as promised"
    document = compared.document
    assert next(iter(document.items())) == ("schema", "mlscorr.compare/1")
    assert not undocumented(document)
    assert [row["name"] for row in document["methods"]] == NAMES
    for row in document["methods"]:
        determined = row["status"] == "determined"
        assert determined == (row["why"] is None) == (row["seconds"] is not None)
        for role, n in (("check", 1), ("control", 4)):
            assert row[role]["n"] == n
            for key in ("rmse", "min", "max"):
                assert len(row[role][key]) == 3 if determined else row[role][key] is None
            assert (row[role]["rmse_3d"] is None) == (not determined)


def test_a_method_without_enough_epochs_says_so(compared):
    "Control points at three epochs determine no polynomial of order 2 to 5; all else is fitted"
    for name in NAMES:
        why = compared.row(name)["why"] or ""
        is_polynomial = name.startswith(("ls-", "lsc-"))
        assert ("or more epochs" in why and "here are 3" in why) == is_polynomial, name


def test_few_check_points_are_backed_by_cross_validation(compared):
    "With one check point every determined method is cross-validated over all five points"
    document = compared.document
    assert document["scored_by"] == "cross_validated"
    assert document["cross_validation_groups"] == 4
    assert "cross-validated" in document["statements"][1]["sentence"]
    shift = compared.row("shift")["cross_validated"]
    assert shift["n"] == 5
    assert shift["rmse_3d"] > 0
    affine = compared.row("affine")  # four points are fitted exactly; three determine nothing
    assert affine["control"]["rmse_3d"] < 1e-6
    assert affine["cross_validated"]["rmse"] is None
    assert "Without T0" in affine["cross_validated"]["why"]


def test_a_left_out_point_is_predicted_from_the_others_alone(compared):
    "The cross-validated residuals of the shift are those of means without the point in turn"
    control = compared.matched_control
    left = control.misclosure
    variance = np.mean(control.variance, axis=1)
    residuals = [
        left[i] - np.average(np.delete(left, i, 0), axis=0, weights=1 / np.delete(variance, i))
        for i in range(len(left))
    ]
    check = np.square(compared.row("shift")["check"]["rmse"])
    wanted = np.sqrt((np.square(residuals).sum(axis=0) + check) / 5)
    assert compared.row("shift")["cross_validated"]["rmse"] == pytest.approx(wanted, abs=1e-9)


def test_the_row_of_correct_is_what_correct_leaves(street, compared):
    "Its residuals are those of mlscorr.correct to 1e-12 m; on a single pass lsc leaves the same"
    with warnings.catch_warnings(action="ignore"):
        corrected = mlscorr.correct(mlscorr.read_survey(street))
    row = compared.row("correct")
    assert row["check"]["rmse"] == pytest.approx(corrected.check["after"]["rmse"], abs=1e-12)
    assert row["check"] == compared.row("lsc")["check"]
    assert row["details"]["ties"] == 0
    assert row["details"]["untied"] == corrected.estimate.untied
    (ties,) = [fact for fact in compared.document["statements"] if fact["what"] == "Ties"]
    assert "correct equals lsc" in ties["sentence"]


@pytest.mark.long
def test_the_row_of_correct_uses_what_two_passes_saw(tmp_path):
    """A street driven there and back with an outage of 18 s: correct uses the same ties as
    mlscorr.correct, its residuals are the same to 1e-12 m, and no other method uses any
    """
    scenario = Scenario(
        drive={"duration": 30.0, "speed": 6.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 4, "check": 5},
        scanner=[{"lines_per_second": 75, "points_per_line": 300}],
        pos={"grade": "mems", "processing": "filtered", "outages": [[6.0, 18.0]]},
    )
    simulate(scenario, np.random.default_rng(5)).write(tmp_path / "survey")
    compared = compare(tmp_path / "survey")
    with warnings.catch_warnings(action="ignore"):
        corrected = mlscorr.correct(mlscorr.read_survey(tmp_path / "survey"))
    row = compared.row("correct")
    lsc = compared.row("lsc")
    assert row["check"]["rmse"] == pytest.approx(corrected.check["after"]["rmse"], abs=1e-12)
    assert row["details"]["ties"] == int(corrected.estimate.ties.used.sum()) > 50
    assert row["check"]["rmse_3d"] != lsc["check"]["rmse_3d"]
    assert "ties" not in lsc["details"]


@pytest.mark.long
def test_check_points_have_no_influence_on_any_method(street, compared, tmp_path):
    "A check point surveyed 7 cm elsewhere changes its own misclosure by 7 cm and nothing else"
    folder = shutil.copytree(street, tmp_path / "survey")

    def move(rows):
        for row in rows:
            if row["role"] == "check":
                row["easting"] = f"{float(row['easting']) + 0.07:.4f}"
        return rows

    rewrite_control(folder, move)
    other = compare(folder)
    for name in NAMES:
        before = compared.row(name)
        after = other.row(name)
        assert (after["control"]["rmse"] is None) == (before["control"]["rmse"] is None)
        if before["control"]["rmse"] is not None:
            assert after["control"]["rmse"] == pytest.approx(before["control"]["rmse"], abs=1e-9)
            gain = after["check"]["max"][0] - before["check"]["max"][0]
            assert gain == pytest.approx(0.07, abs=1e-3), name  # its cloud is cut about it


@pytest.mark.long
def test_without_check_points_the_control_points_are_left_out_in_turn(street, tmp_path):
    "No check point: the scores are cross-validated, and the document says so"
    folder = shutil.copytree(street, tmp_path / "survey")
    rewrite_control(folder, lambda rows: [row for row in rows if row["role"] == "control"])
    other = compare(folder)
    assert other.scored_by == "cross_validated"
    assert (
        "As there are no check points, the scores are cross-validated"
        in other.document["statements"][1]["sentence"]
    )
    assert other.row("shift")["cross_validated"]["n"] == 4
    assert other.row("shift")["check"] | {"n": 0} == other.row("shift")["check"]


@pytest.mark.long
def test_one_target_leaves_what_one_target_can_tell(street, tmp_path):
    "One control point determines raw, shift, lines, lsc, correct; the others say why not"
    folder = shutil.copytree(street, tmp_path / "survey")
    rewrite_control(folder, lambda rows: [row for row in rows if row["role"] == "control"][:1])
    other = compare(folder)
    determined = [row["name"] for row in other.rows if row["status"] == "determined"]
    assert determined == ["raw", "shift", "linear", "pchip", "linear-steps", "lsc", "correct"]
    assert all(row["why"] for row in other.rows if row["status"] != "determined")
    assert other.scored_by == "control"
    assert "show the fit only" in other.document["statements"][1]["sentence"]
    other.write(tmp_path / "out")
    assert "there is 1" in (tmp_path / "out" / "compare.html").read_text()


def test_without_control_points_there_is_nothing_to_compare(street, tmp_path):
    "A survey of check points alone is refused"
    folder = shutil.copytree(street, tmp_path / "survey")
    rewrite_control(folder, lambda rows: [row for row in rows if row["role"] == "check"])
    with pytest.raises(ValueError, match="1 check point and no control point"):
        mlscorr.compare(mlscorr.read_survey(folder))


@pytest.mark.long
def test_collocation_beats_every_single_move_on_the_real_drift():
    "On wuhan_drive lsc leaves less on each axis than any method that moves the cloud as one"
    compared = compare(shared("surveys", "wuhan_drive"))
    assert compared.scored_by == "check"
    assert "cross_validated" not in compared.row("lsc")
    ours = np.array(compared.row("lsc")["check"]["rmse"])
    for name in ONE_MOVE:
        assert np.all(ours < compared.row(name)["check"]["rmse"]), name
    icp = compared.row("icp")
    assert any("No rigid motion fits" in text for text in icp["warnings"])
    assert icp["check"]["rmse_3d"] < compared.row("raw")["check"]["rmse_3d"]


# ---- files


@pytest.mark.long
def test_the_command_writes_page_document_and_clouds(commanded):
    "compare --json prints what it writes; each method's cloud lies in a folder of its name"
    process, out = commanded
    assert process.returncode == 0, process.stderr
    printed = json.loads(process.stdout)
    assert printed == json.loads((out / "compare.json").read_text())
    assert sorted(path.name for path in out.iterdir()) == sorted(
        ["compare.html", "compare.json", "log.txt", "lsc", "shift"]
    )
    assert [file["method"] for file in printed["files"]] == ["shift", "lsc"]
    assert all((out / file["name"]).exists() for file in printed["files"])
    assert printed["statements"][0]["sentence"] in process.stderr


@pytest.mark.long
def test_a_shifted_cloud_keeps_all_but_its_coordinates(street, commanded, compared):
    "The cloud of the shift is the recorded one plus the shift, to half of the file's resolution"
    source = read_survey(street).clouds[0]
    before = laspy.read(source.path)
    after = laspy.read(commanded[1] / "shift" / source.path.name)
    moved = after.xyz - before.xyz - compared.corrections["shift"].shift
    assert np.abs(moved).max() < 0.5 * before.header.scales.max() + 1e-9
    assert np.array_equal(before.gps_time, after.gps_time)
    assert np.array_equal(before.intensity, after.intensity)


def test_a_transformation_of_nothing_changes_no_coordinate(street, tmp_path):
    "The identity leaves every integer of the file as it was"
    source = read_survey(street).clouds[0]
    target = tmp_path / "raw.laz"
    assert write_corrected(source, target, RAW) == 0
    before = laspy.read(source.path)
    after = laspy.read(target)
    for name in "XYZ":
        assert np.array_equal(before[name], after[name])


def test_a_cloud_that_does_not_fit_its_file_is_refused(street, tmp_path):
    "A transformation by thousands of kilometres overflows the file's integers, and says so"
    source = read_survey(street).clouds[0]
    first = next(iter(read_chunks(source))).xyz[0]
    far = Transformation(first, np.array([1e7, 0.0, 0.0]), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="can't be stored in 32 bits with the file's scale"):
        write_corrected(source, tmp_path / "far.laz", far)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "code", "words"),
    [("rigit", 2, "The nearest is 'rigid'"), ("ls-5", 3, "ls-5 has no cloud to write: A polyn")],
)
def test_a_cloud_of_no_method_is_refused(street, tmp_path, method, code, words):
    "An unknown method ends with 2, one that was not determined with 3, and nothing is written"
    out = tmp_path / "out"
    command = [MLSCORR, "compare", street, "-o", out, "--clouds", method]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == code, process.stderr
    assert words in process.stderr
    assert not out.exists()


@pytest.mark.long
def test_the_example_makes_its_picture(street, tmp_path):
    "The script of the picture prints the table and draws it"
    script = BENCHMARKS / "pictures" / "compare_methods.py"
    picture = tmp_path / "picture.png"
    command = [sys.executable, "-W", "ignore", script, street, "--picture", picture]
    printed = subprocess.check_output(command, text=True)
    assert "shift           RMSE E/N/H" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_notebook_shows_table_figure_and_data_frame(compared):
    "A row each method in both, and the figure of the page"
    frame = compared.to_frame().set_index("name")
    assert list(frame.index) == NAMES
    assert frame.loc["lsc", "check_rmse_3d"] == compared.row("lsc")["check"]["rmse_3d"]
    assert f"<td>{NAMES[-1]}</td>" in compared._repr_html_()
    assert len(compared.plot().axes) == 3
