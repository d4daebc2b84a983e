"""The command line as a careless user meets it: real processes, exit codes, what stands where."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.cli.work import work
from mlscorr.io.store import output_folder
from tests.beds.documents import undocumented
from tests.beds.places import MLSCORR, ROOT

STARTED = 357700.0  # s of the week, when the street's trajectory starts


def mlscorr(*arguments, cwd=None):
    "Run a command to its end"
    command = [MLSCORR, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=600)


@pytest.fixture
def survey(street, tmp_path):
    "A copy of the street's survey folder without its truth, to be changed"
    return shutil.copytree(street, tmp_path / "survey", ignore=shutil.ignore_patterns("truth.*"))


def content(folder):
    "Every file below a folder, with its bytes"
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# ---- ways to spoil a survey folder


def edit(name, old, new):
    "Replace text in a file of the survey, which must hold it"

    def spoil(folder):
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return spoil


def remove(name):
    return lambda folder: (folder / name).unlink()


def empty(name):
    return lambda folder: (folder / name).write_bytes(b"")


def cut(name, share):
    "Cut a file off after a share of its bytes"

    def spoil(folder):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: int(share * len(data))])

    return spoil


def rows(name, change):
    "Change the cells (a list of rows without header) of a table"

    def spoil(folder):
        header, *lines = (folder / name).read_text().splitlines()
        cells = change([line.split(",") for line in lines])
        (folder / name).write_text("\n".join([header, *map(",".join, cells)]) + "\n")

    return spoil


def cell(row, column, value):
    "Set one cell of a table"

    def change(table):
        table[row][column] = value
        return table

    return change


def scaled(columns, factor):
    "Multiply columns of a table"

    def change(table):
        for line in table:
            for column in columns:
                line[column] = f"{float(line[column]) * factor:.9f}"
        return table

    return change


def shifted(column, step):
    "Add to a column of a table"

    def change(table):
        for line in table:
            line[column] = f"{float(line[column]) + step:.6f}"
        return table

    return change


def cloud(change):
    "Change the points of the cloud"

    def spoil(folder):
        las = laspy.read(folder / "pass-1.laz")
        change(las)
        las.write(folder / "pass-1.laz")

    return spoil


def darken(las):
    las.intensity = np.full(len(las), 2000)


def forget_times(folder):
    "The cloud in point format 0, which has no gps_time"
    las = laspy.convert(laspy.read(folder / "pass-1.laz"), point_format_id=0, file_version="1.2")
    las.write(folder / "pass-1.laz")


def sbet_in_degrees(folder):
    "An SBET whose latitude and longitude are in degrees"
    record = np.zeros((801, 17))
    record[:, 0] = STARTED + 0.01 * np.arange(801)
    record[:, 1:4] = 30.4926, 117.3333, 40.0
    record.tofile(folder / "trajectory.sbet")
    edit("survey.toml", "trajectory.csv", "trajectory.sbet")(folder)


def swap(table):
    return [[name, north, east, *others] for name, east, north, *others in table]


BAD = [
    # survey.toml: exit code 2
    (
        "missing key",
        edit("survey.toml", '[trajectory]\nfile = "trajectory.csv"', ""),
        2,
        ["trajectory is missing"],
    ),
    (
        "unknown key",
        edit("survey.toml", "lever_arm", "leverarm"),
        2,
        ["mounting.leverarm", "nearest known one is mounting.lever_arm"],
    ),
    ("bad TOML", edit("survey.toml", "[cloud]", "[cloud"), 2, ["not valid TOML", "line 4"]),
    ("unknown CRS", edit("survey.toml", "EPSG:32650", "EPSG:99999"), 2, ["EPSG:99999", "unknown"]),
    ("cloud missing", remove("pass-1.laz"), 2, ["cloud.files", "pass-1.laz", "does not exist"]),
    (
        "control missing",
        remove("control.csv"),
        2,
        ["control.file", "control.csv", "does not exist"],
    ),
    (
        "check point unknown",
        edit("survey.toml", '"control.csv"', '"control.csv"\ncheck = ["X*"]'),
        2,
        ["control.check lists 'X*'"],
    ),
    (
        "column unknown",
        edit("survey.toml", '"control.csv"', '"control.csv"\ncolumns.easting = "X"'),
        2,
        ["control.csv has no column 'X'", "survey.toml sets as the easting"],
    ),
    # the cloud: exit code 3
    ("cloud empty", empty("pass-1.laz"), 3, ["pass-1.laz", "0 bytes"]),
    ("cloud cut off", cut("pass-1.laz", 0.6), 3, ["pass-1.laz", "truncated", "copy it again"]),
    (
        "cloud is text",
        edit("survey.toml", "pass-1.laz", "control.csv"),
        3,
        ["not a LAS or LAZ file"],
    ),
    ("cloud without gps_time", forget_times, 3, ["point format 0", "gps_time"]),
    (
        "other day",
        cloud(lambda las: setattr(las, "gps_time", las.gps_time + 86400)),
        3,
        ["None of", "[444100.050, ", "[357700.000, 357708.000] s", "different days"],
    ),
    (
        "most times outside",
        rows("trajectory.csv", lambda t: t[:300]),
        3,
        ["Only", "%", "Export the whole trajectory"],
    ),
    (
        "no bright targets",
        cloud(darken),
        3,
        ["None of the 5 surveyed targets", "intensity 2000 to 2000"],
    ),
    # the trajectory: exit code 3
    ("trajectory empty", empty("trajectory.csv"), 3, ["trajectory.csv is empty"]),
    ("trajectory cut off", cut("trajectory.csv", 0.7003), 3, ["trajectory.csv", "truncated"]),
    (
        "NaN in trajectory",
        rows("trajectory.csv", cell(7, 2, "nan")),
        3,
        ["1 of 801 epochs", "northing", "epoch 8"],
    ),
    (
        "trajectory unsorted",
        rows("trajectory.csv", lambda t: t[400:] + t[:400]),
        3,
        ["must increase", "1 go back in time", "Sort"],
    ),
    (
        "trajectory doubled",
        rows("trajectory.csv", lambda t: t[:9] + t[8:]),
        3,
        ["1 epochs are duplicates"],
    ),
    (
        "radians for degrees",
        rows("trajectory.csv", scaled((4, 5, 6), np.pi / 180)),
        3,
        ["seem to be in radians"],
    ),
    (
        "SBET in degrees",
        sbet_in_degrees,
        3,
        ["trajectory.sbet", "latitude of 30.4926", "radians", "may be in degrees"],
    ),
    # control: exit code 3
    (
        "NaN in control",
        rows("control.csv", cell(1, 1, "nan")),
        3,
        ["Line 3", "easting 'nan'", "finite"],
    ),
    (
        "letters of no encoding",
        lambda folder: (folder / "control.csv").write_bytes(
            (folder / "control.csv").read_bytes().replace(b"T05", b"M\x81")
        ),
        3,
        ["control.csv is not a text file in UTF-8", "umlauts"],
    ),
    ("northing in um", rows("control.csv", scaled((2,), 1e6)), 3, ["northing 3.374", "1e+08 m"]),
    ("name twice", rows("control.csv", cell(1, 0, "T01")), 3, ["T01 more than once"]),
    (
        "unknown kind",
        rows("control.csv", cell(0, 6, "cirle")),
        3,
        ["T01", "unknown kind 'cirle'", "Did you mean circle?"],
    ),
    ("E and N swapped", rows("control.csv", swap), 3, ["swapped", "Exchange the two columns"]),
    (
        "control 100 m off",
        rows("control.csv", shifted(3, 100.0)),
        3,
        ["of the 5 surveyed points", "same CRS"],
    ),
    (
        "control of another zone",
        rows("control.csv", shifted(1, -3e5)),
        3,
        ["km", "different CRS or zones"],
    ),
    (
        "only check points",
        edit("control.csv", ",control", ",check"),
        3,
        ["5 check points and no control point"],
    ),
]
SEEN_IN_POINTS = ("no bright targets", "control 100 m off", "only check points")  # and costs time


@pytest.mark.parametrize(("spoil", "code", "words"), [b[1:] for b in BAD], ids=[b[0] for b in BAD])
def test_bad_input_is_refused_in_a_sentence(spoil, code, words, survey):
    "Exit code 2 or 3, what and how many and the way out; nothing written, nothing changed"
    spoil(survey)
    before = content(survey)
    with warnings.catch_warnings(action="ignore"):  # what else is said stands before it
        result = CliRunner().invoke(
            app, ["correct", str(survey), "-o", str(survey.parent / "out"), "--json"]
        )
    assert result.exit_code == code, result.stderr
    last = result.stderr.splitlines()[-1]
    assert last.startswith("Error: ") and last.endswith((".", "?"))
    for word in words:
        assert word in last
    assert "Traceback" not in result.stderr
    assert result.stdout == ""
    assert content(survey) == before
    assert list(survey.parent.iterdir()) == [survey]


def test_a_cloud_that_has_sigmas_is_refused_before_its_points_are_read(survey):
    "With --sigma, which would add them: were points read, no target would be found"
    las = laspy.read(survey / "pass-1.laz")
    las.add_extra_dim(laspy.ExtraBytesParams("sigma_easting", np.uint16))
    las.intensity[:] = 1
    las.write(survey / "pass-1.laz")
    command = ["correct", str(survey), "-o", str(survey.parent / "out"), "--sigma", "-q"]
    ended = CliRunner().invoke(app, command)
    assert ended.exit_code == 3 and "have the field sigma_easting" in ended.stderr


def test_files_of_an_earlier_run_are_named(tmp_path, capsys):
    "Files that --overwrite leaves unchanged are named, in folders too; rewritten ones are not"
    for name in ("out.sbet", "smrmsg_out.out", "out.tum", "new.json"):
        (tmp_path / name).write_text("old")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "map.png").write_text("old")
    with work(tmp_path, True), output_folder(tmp_path, overwrite=True) as folder:
        (folder / "new.json").write_text("new")
    (said,) = capsys.readouterr().err.splitlines()
    assert "Left unchanged" in said
    assert ": out.sbet, out.tum, pictures/map.png, smrmsg_out.out. Delete" in said
    assert "new.json" not in said and (tmp_path / "new.json").read_text() == "new"


def test_a_new_folder_names_no_file_of_an_earlier_run(tmp_path, capsys):
    "Nor does one of which every file is written anew"
    for _ in range(2):
        with work(tmp_path / "out", True), output_folder(tmp_path / "out", overwrite=True) as new:
            (new / "new.json").write_text("new")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("command", ["calibrate", "plan"])
def test_a_mounting_that_a_command_needs_is_a_fault_of_survey_toml(command, survey):
    "Exit code 2, as for other keys that are missing there, and the section is named"
    text = (survey / "survey.toml").read_text()
    start = text.index("[mounting]")
    end = text.index("[scanner]")
    (survey / "survey.toml").write_text(text[:start] + text[end:])
    ended = CliRunner().invoke(app, [command, str(survey), "-o", str(survey.parent / "out")])
    assert ended.exit_code == 2 and "survey.toml has no [mounting]" in ended.stderr, ended.stderr


@pytest.mark.parametrize("command", ["correct", "compare", "plan", "check"])
def test_a_survey_toml_without_control_is_a_fault_of_it(command, survey):
    "Exit code 2 by every command that needs control; 3 where the list that is named is empty"
    (survey / "control.csv").write_text("")
    text = (survey / "survey.toml").read_text().partition("[scene]")[0]
    for content, code in ((text, 3), (text.replace('[control]\nfile = "control.csv"', ""), 2)):
        (survey / "survey.toml").write_text(content)
        if command == "check":
            out = []
        else:
            out = ["-o", str(survey.parent / "out")]
        with warnings.catch_warnings(action="ignore"):
            ended = CliRunner().invoke(app, [command, str(survey), *out])
        assert ended.exit_code == code and "control" in ended.output, ended.output


@pytest.mark.parametrize("bad", [b for b in BAD if b[0] not in SEEN_IN_POINTS], ids=lambda b: b[0])
def test_a_check_refuses_what_a_correction_refuses(bad, survey):
    "The same exit code for each, and the same words among all that it says; nothing changed"
    _, spoil, code, words = bad
    spoil(survey)
    before = content(survey)
    result = CliRunner().invoke(app, ["check", str(survey)])
    assert result.exit_code == code, result.stderr
    assert all(word in result.stderr for word in words), result.stderr
    assert content(survey) == before


@pytest.mark.parametrize("bad", [BAD[0], BAD[len(BAD) // 2], BAD[-1]], ids=lambda bad: bad[0])
def test_a_process_of_its_own_refuses_it_alike(bad, survey):
    "Code and sentence are those of the command as a careless user starts it"
    _, spoil, code, words = bad
    spoil(survey)
    process = mlscorr("correct", survey, "-o", survey.parent / "out", "--json")
    last = process.stderr.splitlines()[-1]
    assert process.returncode == code and last.startswith("Error: ")
    assert all(word in last for word in words)
    assert "Traceback" not in process.stderr and process.stdout == ""
    assert list(survey.parent.iterdir()) == [survey]


# ---- the output folder


@pytest.mark.parametrize(
    ("out", "arguments", "code", "words"),
    [
        ("full", (), 2, ["1 entry", "notes.txt", "--overwrite"]),
        ("survey", (), 2, ["contains the input"]),
        ("survey", ("--overwrite",), 2, ["contains the input"]),
        ("survey/../survey", ("--overwrite",), 2, ["contains the input"]),
        ("full/notes.txt", (), 2, ["is a file", "need a folder"]),
        ("full/notes.txt/out", (), 5, ["can't be", "Not a directory"]),
        ("/proc/mlscorr/out", (), 5, ["can't be", "/proc"]),
    ],
)
def test_an_output_folder_that_cannot_be_is_refused(out, arguments, code, words, survey):
    "An input's folder, a full folder, a file, an unwritable place: said before any work is done"
    (survey.parent / "full").mkdir()
    (survey.parent / "full" / "notes.txt").write_text("mine")
    before = content(survey.parent)
    process = mlscorr("correct", survey, "-o", survey.parent / out, *arguments)
    assert process.returncode == code, process.stderr
    for word in words:
        assert word in process.stderr
    assert "Traceback" not in process.stderr
    assert content(survey.parent) == before


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("correct",),
        ("correct", "survey.toml", "-o"),
        ("correct", "survey.toml", "-o", "out", "--order", "two"),
        ("correct", "survey.toml", "-o", "out", "--order", "-1"),
        ("correct", "survey.toml", "-o", "out", "--fast"),
        ("corect", "survey.toml", "-o", "out"),
        ("correct", "no such folder", "-o", "out"),
        ("demo", "-o", "out", "--seed", "-1"),
    ],
    ids=" ".join,
)
def test_wrong_usage_is_code_2(arguments, survey):
    "Unknown commands and options have no effect"
    process = mlscorr(*arguments, cwd=survey)
    assert process.returncode == 2
    assert "Traceback" not in process.stderr
    assert not (survey / "out").exists()


# ---- what works


def test_json_is_one_document_on_stdout(commanded):
    "stdout holds report.json's document and nothing else; all else stands on stderr"
    process, out = commanded
    assert process.returncode == 0, process.stderr
    document = json.loads(process.stdout)
    assert document == json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert document["schema"] == "mlscorr.report/1"
    assert not undocumented(document)
    tutorial = (ROOT / "docs" / "tutorial.md").read_text()
    shown = (
        "Result:",
        "Points:",
        "RMSE of misclosures (m)    n   E before",
    )
    assert all(words in process.stderr and words in tutorial for words in shown)


def test_paths_may_be_relative_with_spaces_and_umlauts(commanded):
    "survey.toml's own paths count from its folder, -o from where the user stands"
    process, out = commanded
    assert process.returncode == 0, process.stderr
    names = {"pass-1.laz", "pictures", "report.html", "report.json", "targets.csv"}
    names |= {"weak.csv", "weak.geojson", "log.txt"}
    names |= {"trajectory.csv", "drive.sbet", "smrmsg_drive.out", "drive.tum"}  # as asked for
    assert {path.name for path in out.iterdir()} == names
    assert [path.name for path in out.parent.iterdir()] == [out.name]


@pytest.mark.long
def test_a_quality_gate_fails_with_everything_written_and_nothing_else_said(survey):
    "Exit code 6 and one line for each gate that is met; the results are whole, stderr quiet"
    out = survey.parent / "out"
    gates = ["--fail-if", "check.rmse_h > 0.000001", "--fail-if", "check.max_3d > 5"]
    process = mlscorr("correct", survey, "-o", out, *gates, "--quiet", "--no-report")
    assert process.returncode == 6
    (line,) = process.stderr.splitlines()
    assert line.startswith("Quality gate failed: check.rmse_h: rmse of check points in height")
    assert (out / "report.json").exists() and (out / "pass-1.laz").exists()


@pytest.mark.long
def test_a_gate_that_cannot_be_read_stops_before_any_work(survey):
    "Exit code 2 and the nearest name; no folder appears"
    out = survey.parent / "out"
    process = mlscorr("correct", survey, "-o", out, "--fail-if", "check.rms_h > 0.03")
    assert process.returncode == 2
    assert "'check.rmse_h'" in process.stderr
    assert not out.exists()


@pytest.mark.long
def test_points_without_a_pose_are_counted_and_the_rest_is_done(in_part):
    "Exit code 4; stderr says how many of how many, and which target was not used"
    process, out = in_part
    assert process.returncode == 4, process.stderr
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    outside = report["coverage"]["points_outside_trajectory"]
    assert outside > 0
    assert f"{outside} of {report['files'][0]['points']} points" in process.stderr
    (warning,) = [text for text in report["model"]["warnings"] if "points sampled" in text]
    some, sampled = map(int, re.match(r"(\d+) of (\d+) points sampled", warning).groups())
    share = 100 * some / sampled
    assert share == pytest.approx(100 * outside / report["files"][0]["points"], abs=5)
    assert f"Warning: {warning}" in process.stderr
    assert "    T02: " in process.stderr and "one of its gaps" in process.stderr
    assert process.stdout == ""


@pytest.mark.long
@pytest.mark.parametrize(("kept", "order"), [(4, 5), (1, 1)])
def test_few_control_points_lower_the_order_with_a_warning(kept, order, survey):
    "Still done, exit code 0: what is doubtful is warned of and in report.json, without a page"
    edit("control.csv", ",control", ",check")(survey)
    rows("control.csv", lambda t: [[*row[:-1], "control"] for row in t[:kept]] + t[kept:])(survey)
    out = survey.parent / "out"
    process = mlscorr("correct", survey, "-o", out, "--order", order, "--no-report")
    assert process.returncode == 0, process.stderr
    names = ["log.txt", "pass-1.laz", "report.json", "targets.csv", "trajectory.csv"]
    names += ["weak.csv", "weak.geojson"]
    assert sorted(path.name for path in out.iterdir()) == names
    assert "report.html" not in process.stderr
    warned = [line for line in process.stderr.splitlines() if f"trend of order {order}" in line]
    assert len(warned) == 1
    assert warned[0].startswith(f"Warning: {kept} control point")
    model = json.loads((out / "report.json").read_text(encoding="utf-8"))["model"]
    assert f"Order {model['order']} is used" in warned[0]
    assert model["order"] < order
    assert warned[0].removeprefix("Warning: ") in model["warnings"]


# ---- interruption


def interrupt(survey, number, wait):
    "Start a correction, send it a signal after waiting for something, and see it end"
    started = ["env", "--default-signal"]  # as if nohup had not ignored SIGHUP
    command = [*started, MLSCORR, "correct", survey, "-o", survey.parent / "out"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            wait(survey.parent, process)
            process.send_signal(number)
            _, stderr = process.communicate(timeout=600)
        finally:
            process.kill()  # no harm to what has ended
    return process.returncode, stderr


def is_written(folder):
    "True if part of the corrected cloud is in a temporary folder next to the output"
    try:
        return any(folder.glob(".out.*.part/*"))
    except FileNotFoundError:  # a folder that was made to try the place, and removed meanwhile
        return False


def writing_has_begun(folder, process):
    "Wait until something of the corrected cloud lies beside the output folder"
    while not is_written(folder):
        assert process.poll() is None
        time.sleep(0.002)


def libraries_load(folder, process):
    "Wait until the process has mapped the first of scipy's libraries"
    while "/scipy/" not in Path(f"/proc/{process.pid}/maps").read_text():
        assert process.poll() is None
        time.sleep(0.002)


@pytest.mark.long
@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name
)
def test_an_interruption_while_writing_leaves_nothing(number, survey):
    "Ctrl-C, a scheduler's kill, a closed terminal: exit code 130, no folder, no .part"
    before = content(survey)
    code, stderr = interrupt(survey, number, writing_has_begun)
    assert code == 130
    assert stderr.splitlines()[-1] == "Interrupted; nothing was written."
    assert list(survey.parent.iterdir()) == [survey]
    assert content(survey) == before


def test_an_interruption_while_libraries_load_is_not_lost(survey):
    "Libraries swallow an interruption that comes while they are imported; it is repeated"
    code, stderr = interrupt(survey, signal.SIGTERM, libraries_load)
    assert code == 130
    assert "Traceback" not in stderr
    assert list(survey.parent.iterdir()) == [survey]


@pytest.mark.long
def test_a_killed_process_leaves_no_folder_under_the_name(survey):
    "After SIGKILL while writing only a folder named .part is there, and a second run works"
    code, _ = interrupt(survey, signal.SIGKILL, writing_has_begun)
    assert code == -signal.SIGKILL
    assert not (survey.parent / "out").exists()


# ---- elsewhere

AS_WINDOWS = """
import signal, sys
sys.modules["fcntl"] = None
for name in ("SIGHUP", "SIGALRM", "setitimer", "getitimer", "ITIMER_REAL", "pthread_kill"):
    delattr(signal, name)
from mlscorr.cli import app
app(sys.argv[1:])
"""


@pytest.mark.long
def test_a_system_without_locks_and_hangups_corrects(survey):
    "Windows knows no fcntl, SIGHUP and timers: a survey is corrected there, nothing else is left"
    out = survey.parent / "out"
    command = [sys.executable, "-c", AS_WINDOWS, "correct", survey, "-o", out, "--no-report"]
    process = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    assert process.returncode == 0, process.stderr
    assert (out / "report.json").is_file()
    assert sorted(survey.parent.iterdir()) == sorted([out, survey])


# ---- quick to start


def test_help_names_every_command():
    "The overview shows what can be done"
    process = mlscorr("--help")
    assert process.returncode == 0
    for command in ("correct", "demo", "doctor"):
        assert command in process.stdout


@pytest.mark.parametrize("module", ["mlscorr", "mlscorr.cli"])
def test_importing_loads_no_heavy_library(module):
    "import mlscorr and the command line's first step know none of the libraries that take time"
    code = f"import sys, {module}; print(*sys.modules)"
    loaded = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    heavy = {"laspy", "lazrs", "open3d", "sklearn", "scipy", "numba", "matplotlib", "pyproj"}
    assert not heavy & set(loaded)


def test_a_home_that_cannot_be_written_is_not_spoken_of():
    "Matplotlib keeps its fonts elsewhere then, which is nothing that a user could mend"
    code = "from mlscorr.cli import main\ntry: main()\nfinally: import matplotlib"
    home = {"HOME": os.devnull, "PATH": os.environ["PATH"]}
    command = [sys.executable, "-c", code, "--version"]
    process = subprocess.run(command, capture_output=True, text=True, env=home, cwd=ROOT)
    assert process.returncode == 0
    assert process.stderr == ""
