"""The first commands of a new user: a folder, a dry run, a name too many, a log to send around."""

import re
import shutil

import pytest
from typer.testing import CliRunner

from mlscorr import read_survey
from mlscorr.cli import COMMANDS, app
from mlscorr.io.surveys import survey_toml


def run(*arguments):
    "Run a command in this process"
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "120"})


def content(folder):
    "Every file below a folder, with its bytes"
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def folder(street, tmp_path):
    "Clouds, trajectory and control of the street, without a survey.toml"
    left_out = shutil.ignore_patterns("truth.*", "survey.toml")
    return shutil.copytree(street, tmp_path / "street", ignore=left_out)


@pytest.mark.parametrize("name", [*COMMANDS, "status"])
def test_every_command_shows_examples(name):
    "The end of --help has a line or more that can be run as it is"
    ended = run(name, "--help")
    assert ended.exit_code == 0
    *_, examples = ended.stdout.partition("Examples:")
    assert f"mlscorr {name}" in examples


def test_a_folder_is_corrected_by_one_command(folder):
    "No survey.toml: it is inferred, checked, and written beside the result; the folder stays"
    before = content(folder)
    ended = run("correct", folder, "--no-report")
    assert ended.exit_code == 0, ended.stderr
    out = folder.parent / "street-correct"
    assert f"Results: {out}" in ended.stderr.replace("\n", "")
    assert content(folder) == before
    inferred = read_survey(out / "survey.toml")
    assert len(inferred.control) == 4 and len(inferred.check) == 1
    assert (out / "pass-1.laz").exists()
    assert sorted(path.name for path in folder.parent.iterdir()) == ["street", "street-correct"]


def test_a_folder_with_an_open_question_is_not_corrected(folder):
    "Sizes of targets that nobody states: exit code 2, and the line that answers"
    rows = [row.split(",") for row in (folder / "control.csv").read_text().splitlines()]
    column = rows[0].index("size")
    text = "\n".join(",".join(row[:column] + row[column + 1 :]) for row in rows)
    (folder / "control.csv").write_text(text + "\n")
    before = content(folder.parent)
    ended = run("correct", folder)
    assert ended.exit_code == 2
    assert f"mlscorr init {folder} --set 'control.size" in ended.stderr.replace("\n", "")
    assert content(folder.parent) == before


def test_a_dry_run_writes_nothing(street, folder, tmp_path):
    "It names what would be read and written, for a survey and for a folder; exit code 0"
    copied = shutil.copytree(street, tmp_path / "survey")
    before = content(tmp_path)
    for path in (copied, folder):
        ended = run("correct", path, "--dry-run", "-o", tmp_path / "out")
        assert ended.exit_code == 0, ended.stderr
        for words in ("Would be read", "pass-1.laz (", "report.json", "Nothing was written"):
            assert words in ended.stderr
    assert content(tmp_path) == before
    assert not (tmp_path / "out").exists()


def test_a_dry_run_ends_as_a_check_does(folder, street):
    "A fault of the data is code 3, one of survey.toml 2, in both"
    shutil.copy(street / "survey.toml", folder)
    (folder / "trajectory.csv").write_text("gps_time\n1\n")
    checked = run("check", folder)
    tried = run("correct", folder, "--dry-run")
    assert checked.exit_code == tried.exit_code != 0
    (folder / "survey.toml").write_text("cloud = 3\n")
    assert run("correct", folder, "--dry-run").exit_code == run("check", folder).exit_code == 2


def test_results_lie_beside_the_survey_by_default(street, tmp_path):
    "FOLDER-extract is refused when it is there already, as any folder is"
    copied = shutil.copytree(street, tmp_path / "drive")
    assert run("extract", copied / "survey.toml").exit_code == 0
    assert (tmp_path / "drive-extract" / "targets.json").exists()
    assert run("extract", copied).exit_code == 2


def test_the_log_holds_what_was_decided_and_no_password(street, tmp_path):
    "log.txt: command, versions, targets, matches, parameters, stages; URLs without their secrets"
    from mlscorr.pipeline.logs import without_secrets

    out = tmp_path / "out"
    ended = run("correct", street, "-o", out, "--no-report", "-v")
    assert ended.exit_code == 0, ended.stderr
    log = (out / "log.txt").read_text()
    assert log.startswith("Command: mlscorr")
    assert re.search(r"^Versions: mlscorr \d.*numpy \d.*Python 3", log, re.MULTILINE)
    for words in (
        "targets found",
        "4 of 4 control and 1 of 1 check points matched",
        "POS error estimated by 4 of 4 control observations",
        "covariance, probability",
        "Reading the cloud and finding targets: ",
    ):
        assert words in log
    assert "4 of 4 control and 1 of 1 check points matched" in ended.stderr
    secret = "s3://me:key@host/a.laz https://host/b.laz?token=1"
    assert not {"key", "token"} & set(re.split(r"\W+", without_secrets(secret)))


def test_points_can_be_left_out_by_name(street, tmp_path):
    "--exclude and --include name control points; another name is refused with the nearest"
    control = read_survey(survey_toml(street)).control.name
    out = tmp_path / "out"
    given = ["-o", out, "--no-report", "--worst-first"]
    ended = run("correct", street, *given, "--exclude", control[0])
    assert ended.exit_code == 0, ended.stderr
    assert "not used: excluded by the user" in ended.stderr
    assert f"{control[0]} is excluded by the user; its 3D residual is" in ended.stderr
    wrong = run("correct", street, "-o", tmp_path / "other", "--exclude", control[0] + "x")
    assert wrong.exit_code == 2
    assert f"the nearest name is {control[0]}" in wrong.stderr
