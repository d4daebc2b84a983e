"""Several drives as one project: what ties carry over, what is done again, and what is refused."""

import json
import shutil
import signal
import subprocess
import sys
import time
import warnings

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.io.surveys import read_project
from mlscorr.pipeline.project import Options, check_project, correct_project, project_status
from mlscorr.pipeline.project.stages import tile_tasks
from mlscorr.pipeline.project.tasks import carry_out
from mlscorr.survey import choosing
from tests.beds import project_street as bed
from tests.beds.documents import undocumented
from tests.beds.made_once import copied_once

COMMAND = [sys.executable, "-m", "mlscorr"]
QUICK = Options(page=False)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    "project.toml of two drives, each of two tiles"
    return copied_once(tmp_path_factory, "city", bed.write_tiled) / "project.toml"


@pytest.fixture(scope="module")
def corrected(project):
    "ProjectResult by this process alone, and the folder of the results"
    out = project.parent.with_name(f"{project.parent.name} out")
    return correct_project(project, out, QUICK), out


@pytest.fixture
def copy(corrected, tmp_path):
    "Folder of the results, which a test may change"
    return shutil.copytree(corrected[1], tmp_path / "out")


def outputs(out):
    "Bytes of all results but those that say when they were made"
    names = [p for p in out.rglob("*") if p.is_file() and p.relative_to(out).parts[0] != "tasks"]
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in names
        if path.suffix not in (".html", ".txt")
    }


def moved(project, out, drive):
    "Increment of the points of a drive (n, 3). Units: m"
    return np.concatenate(
        [
            laspy.read(out / drive / path.name).xyz - laspy.read(path).xyz
            for path in sorted((project.parent / drive).glob("*.laz"))
        ]
    )


def worked(out):
    "Names of the tasks of the last run that were carried out, by their kinds"
    lines = (out / "log.txt").read_text().splitlines()
    begins = max(i for i, line in enumerate(lines) if " Reading headers: " in line)
    words = [line.split(maxsplit=4) for line in lines[begins:] if " in " in line]
    return [(word[2].rstrip(":"), word[3]) for word in words if word[2].endswith("s:")]


def test_a_project_is_no_better_than_its_drives(corrected):
    "Its rating is the worst of theirs, and each that isn't green is named with the reason"
    result, _ = corrected
    order = ("green", "amber", "red")
    content = result.document
    ratings = {row["name"]: row["rating"] for row in content["drives"]}
    assert content["rating"] == max(ratings.values(), key=order.index) != "green"
    (doubts,) = (row for row in content["statements"] if row["what"] == "Doubts")
    assert {item["name"] for item in doubts["items"]} == {
        name for name, rating in ratings.items() if rating != "green"
    }
    assert all(item["text"] for item in doubts["items"])


def test_ties_carry_control_to_a_drive_without_any(project, corrected):
    "A drive that is 43 cm off, and sees no control, comes to within a fifth of that, by ties alone"
    result, out = corrected
    left = np.linalg.norm(moved(project, out, "second") + bed.SHIFT, axis=1)
    assert np.linalg.norm(bed.SHIFT) / left.max() > 5
    assert np.linalg.norm(moved(project, out, "first"), axis=1).max() < 0.05
    states = {row["name"]: row["state"] for row in result.document["drives"]}
    assert states == {"first": "controlled", "second": "tied"}
    ties = result.document["drives"][1]["tied_with"]["first"]
    assert ties["before"] > 5 * ties["after"]


def test_each_drive_has_results_of_its_own(project, corrected):
    "Corrected tiles, trajectory in the drive's own times, targets and report.json of each"
    result, out = corrected
    assert not undocumented(result.document)
    assert json.loads((out / "project.json").read_text()) == result.document
    for drive in ("first", "second"):
        recorded = mlscorr.io.trajectories.trajectory.read_trajectory(
            project.parent / drive / "trajectory.csv"
        )
        path = mlscorr.io.trajectories.trajectory.read_trajectory(out / drive / "trajectory.csv")
        assert np.array_equal(path.gps_time, recorded.gps_time)
        report = json.loads((out / drive / "report.json").read_text())
        assert not undocumented(report)
        assert {row["name"] for row in report["files"]} == {"tile-1.laz", "tile-2.laz"}
        assert max((row["pass"] for row in report["targets"] if row["pass"]), default=1) <= 2
    shown = project_status(out)
    assert {stage["share"] for stage in shown["all"]} == {1.0}
    assert not undocumented(shown)


@pytest.mark.long
def test_workers_change_no_byte(project, corrected, tmp_path):
    "Two processes write what this one does, and the page leads to that of each drive"
    _, out = corrected
    correct_project(project, tmp_path / "out", Options(workers=2))
    assert outputs(tmp_path / "out").items() >= outputs(out).items()
    page = (tmp_path / "out" / "project.html").read_text()
    for drive in ("first", "second"):
        assert f'href="{drive}/report.html"' in page
        assert (tmp_path / "out" / drive / "report.html").is_file()


def test_a_drive_that_nothing_corrects_is_done_in_part(project, tmp_path):
    "Exit code 4 without ties, of which the second drive has nothing else; its points stay"
    command = ["correct", str(project), "-o", str(tmp_path / "out"), "--no-ties", "--no-report"]
    ended = CliRunner().invoke(app, command)
    assert ended.exit_code == 4, ended.stderr
    rows = json.loads((tmp_path / "out" / "project.json").read_text())["drives"]
    assert [row["state"] for row in rows] == ["controlled", "uncorrected"]
    assert np.abs(moved(project, tmp_path / "out", "second")).max() < 1e-6  # m


@pytest.mark.long
def test_tiles_of_two_drives_are_told_apart_by_point_source_id(project, corrected, tmp_path):
    "Each point moves as in a tile of its drive alone, and a tile keeps all of its points"
    result, separate = corrected
    folder = shutil.copytree(project.parent, tmp_path / "city")
    bed.share_tiles(folder)
    out = tmp_path / "out"
    shared = correct_project(folder, out, QUICK)
    assert shared.is_whole
    for name in ("tile-1.laz", "tile-2.laz"):
        tile = laspy.read(out / "tiles" / name)
        assert len(tile) == len(laspy.read(folder / "tiles" / name))
        for number, drive in enumerate(("first", "second"), start=1):
            own = tile.xyz[np.asarray(tile.point_source_id) == number]
            assert np.abs(own - laspy.read(separate / drive / name).xyz).max() < 1e-6  # m
    for row, before in zip(shared.document["drives"], result.document["drives"], strict=True):
        assert row["state"] == before["state"] and row["tied_with"] == before["tied_with"]
    report = json.loads((out / "second" / "report.json").read_text())
    assert [row["name"] for row in report["files"]] == [
        "../tiles/tile-1.laz",
        "../tiles/tile-2.laz",
    ]
    alone = json.loads((separate / "second" / "report.json").read_text())
    assert report["coverage"] == alone["coverage"]


@pytest.mark.long
def test_points_of_no_drive_are_refused_with_their_tile(project, tmp_path):
    "A tile with an id that no drive names is named with the number of such points; exit code 4"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    bed.share_tiles(folder)
    cloud = laspy.read(folder / "tiles" / "tile-1.laz")
    cloud.point_source_id[:50] = 9
    cloud.write(folder / "tiles" / "tile-1.laz")
    result = correct_project(folder, tmp_path / "out", QUICK)
    (fault,) = result.document["faults"]
    assert fault["name"] == "tiles/tile-1.laz" and "first: 9" in fault["fault"]
    assert f"50 of the {len(cloud)} points" in fault["fault"]
    assert [path.name for path in (tmp_path / "out" / "tiles").iterdir()] == ["tile-2.laz"]


@pytest.mark.long
def test_a_drive_without_points_is_a_failure(project, tmp_path):
    """By ids that no point has: it is named in red, in `faults`, by status and by the check, with
    the ids there are; all else is corrected, and the exit code is 4.
    """
    folder = shutil.copytree(project.parent, tmp_path / "city")
    out = tmp_path / "out"
    bed.share_tiles(folder)
    third = bed.PROJECT[bed.PROJECT.index('[[drive]]\nname = "second"') :]
    third = third.replace('"second"', '"third"').replace('"second/*', '"tiles/*')
    third = third.replace("]\n\n", "]\npoint_source_ids = [7, 9]\n\n", 1)
    with open(folder / "project.toml", "a") as file:
        file.write(f"\n{third}")
    (fault,) = check_project(folder).faults
    points = sum(len(laspy.read(path)) for path in (folder / "tiles").iterdir())
    words = f"None of the {points} points in the files of drive third has its point_source_id "
    assert fault.sentence.startswith(words + "(7, 9); they have 1, 2.")
    command = ["correct", str(folder), "-o", str(out), "--no-report"]
    assert CliRunner().invoke(app, command).exit_code == 4
    content = json.loads((out / "project.json").read_text())
    named = {"drive": "third", "name": "third", "stage": "tiles", "fault": fault.sentence}
    assert content["faults"] == [named]
    (failures,) = (row for row in content["statements"] if row["what"] == "Failures")
    assert failures["rating"] == "red" and failures["items"][0]["name"] == "third"
    assert [row["name"] for row in content["drives"]] == ["first", "second"]
    (line,) = project_status(out)["failures"]
    assert line.endswith(f" Failed: third: {fault.sentence}")
    cloud = folder / "tiles" / "tile-1.laz"
    cloud.write_bytes(cloud.read_bytes()[:-2000])
    (fault,) = check_project(folder).faults  # in which there may be points of any drive
    assert "tile-1.laz" in fault.sentence


@pytest.mark.long
def test_a_check_tells_the_faults_of_all_drives(project, tmp_path):
    "A good project has none; a cut tile, a drive without points near and a far point are named"
    checked = check_project(project)
    assert not checked.faults
    amounts = {amount.what: amount.number for amount in (*checked.read, *checked.needed)}
    clouds = project.parent.glob("*/*.laz")
    assert amounts["points"] == sum(len(laspy.read(path)) for path in clouds)
    assert amounts["control points"] == 4 and amounts["memory"] < 2
    folder = shutil.copytree(project.parent, tmp_path / "city")
    tile = folder / "second" / "tile-2.laz"
    whole = tile.read_bytes()
    tile.write_bytes(whole[:-2000])
    with open(folder / "control.csv", "a") as file:
        file.write("far,533500.0,3374000.0,43.0,0.003,0.003,circle,0.6,control\n")
    checked = check_project(folder)
    (fault,) = checked.faults
    assert "tile-2.laz" in fault.sentence and "truncated" in fault.sentence
    (folder / "second" / "tile-1.laz").unlink()  # the drive has none but the cut one now
    (alone,) = check_project(folder).faults
    assert alone == fault
    shutil.copy(project.parent / "second" / "tile-1.laz", folder / "second")
    assert any("(first: far)" in sentence for sentence in checked.warnings)
    tile.write_bytes(whole)
    header, *points = (folder / "control.csv").read_text().splitlines()
    near = [point for point in points if point.endswith(",control")][:2]
    (folder / "control.csv").write_text("\n".join([header, *near, ""]))
    assert any(text.startswith("Only 2 control") for text in check_project(folder).warnings)
    (folder / "control.csv").write_text("\n".join([header, points[-1], ""]))
    assert any("(first: far)" in fault.sentence for fault in check_project(folder).faults)
    (folder / "control.csv").write_text(header + "\n")
    (fault,) = check_project(folder).faults
    assert "project.toml has no control points" in fault.sentence
    with pytest.raises(ValueError, match=r"has no control points: .* --ties-only"):
        correct_project(folder, tmp_path / "out", QUICK)


@pytest.mark.long
def test_a_project_of_one_drive_is_its_survey(project, tmp_path):
    "The same clouds and trajectory, to the byte, as of the survey by itself"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    survey = (folder / "first" / "survey.toml").read_text()
    control = '\n[control]\nfile = "../control.csv"\n'
    (folder / "first" / "survey.toml").write_text(survey + control)
    text = '[control]\nfile = "control.csv"\n\n[[drive]]\nsurvey = "first"\n'
    (folder / "one.project.toml").write_text(text)
    correct_project(folder / "one.project.toml", tmp_path / "out", QUICK)
    with warnings.catch_warnings(action="ignore"):
        mlscorr.correct(mlscorr.read_survey(folder / "first")).write(tmp_path / "alone", page=False)
    for name in ("tile-1.laz", "tile-2.laz", "trajectory.csv", "targets.csv"):
        alone = (tmp_path / "alone" / name).read_bytes()
        assert (tmp_path / "out" / "first" / name).read_bytes() == alone


def test_a_folder_of_others_is_wrong_use_as_of_a_survey(project, tmp_path):
    "Exit code 2 for a folder that holds other files, and for that of an input, of both alike"
    (tmp_path / "notes.txt").write_text("mine")
    for file in (project, project.parent / "first" / "survey.toml"):
        for out, words in ((tmp_path, "(first: notes.txt)"), (file.parent, "the input")):
            ended = CliRunner().invoke(app, ["correct", str(file), "-o", str(out)])
            assert ended.exit_code == 2, ended.stderr
            assert f"The output folder {out}" in ended.stderr and words in ended.stderr


def test_an_input_in_a_folder_of_the_results_is_refused(project, tmp_path):
    "A trajectory with the place and name of the corrected one stays as it is, by a link as well"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    (tmp_path / "project").mkdir()
    for name in ("project.toml", "control.csv"):
        (folder / name).rename(tmp_path / "project" / name)
    (folder / "second" / "tiles").mkdir()
    for path in (folder / "second").glob("*.laz"):
        path.rename(path.parent / "tiles" / path.name)
    text = bed.PROJECT.replace('survey = "first"', 'name = "elsewhere"\nsurvey = "../city/first"')
    text = text.replace('"second/*', '"../city/second/tiles/*').replace(
        '"second/t', '"../city/second/t'
    )
    (tmp_path / "project" / "project.toml").write_text(text)
    trajectory = folder / "second" / "trajectory.csv"
    before = trajectory.read_bytes()
    (tmp_path / "link").symlink_to(folder)
    for out in ("city", "link"):
        with pytest.raises(ValueError, match=r"the input second/trajectory\.csv"):
            correct_project(tmp_path / "project", tmp_path / out, Options(overwrite=True))
    assert trajectory.read_bytes() == before


@pytest.mark.parametrize("options", [Options(overwrite=True), Options(resume=True)])
def test_a_folder_of_tasks_that_no_run_made_is_refused(project, tmp_path, options):
    "Neither --overwrite nor --resume touches anything beside a folder `tasks` without a plan"
    texts = {"tasks/mine/todo.txt": "a", "tasks/lock": "b", "first/tile-1.laz": "c"}
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    with pytest.raises(
        ValueError,
        match=r"tasks was not written by a run: .* choose another folder",
    ):
        correct_project(project, tmp_path, options)
    there = {str(p.relative_to(tmp_path)): p for p in tmp_path.rglob("*") if p.is_file()}
    assert {name: path.read_text() for name, path in there.items()} == texts


@pytest.mark.long
def test_overwriting_removes_results_of_tasks_alone(project, copy):
    "All tasks are done again, and what somebody keeps among their results stays"
    notes = copy / "tasks" / "mine" / "todo.result"
    notes.parent.mkdir()
    notes.write_text("precious")
    correct_project(project, copy, Options(page=False, overwrite=True))
    assert notes.read_text() == "precious"
    assert {kind for kind, _ in worked(copy)} == {"tiles", "findings", "clouds", "reports"}


@pytest.mark.long
@pytest.mark.parametrize("left", [(), ("plan.json.part",)])
def test_a_run_that_was_ended_before_its_plan_is_resumed(project, corrected, tmp_path, left):
    "Only its lock, an empty log and half a plan are there: the same results as of a new folder"
    out = tmp_path / "out"
    (out / "tasks").mkdir(parents=True)
    for name in ("log.txt", "tasks/lock", *(f"tasks/{name}" for name in left)):
        (out / name).touch()
    with pytest.raises(ValueError, match="is missing or changed with --resume"):
        correct_project(project, out, QUICK)
    correct_project(project, out, Options(page=False, resume=True))
    assert outputs(out) == outputs(corrected[1])


def test_resume_does_what_is_missing_or_damaged(project, copy):
    """A cloud that is gone, and a result of which a bit fell over, are made again; nothing else.

    A list and a project.toml that are newer, but say the same, change nothing. A cloud of a drive
    that is no more is named, a page that is not asked for is gone.
    """
    out = copy
    before = outputs(copy)
    for path in (project, project.parent / "control.csv"):
        path.write_bytes(path.read_bytes())
    (out / "project.html").write_text("of the run before")
    (out / "first" / "tile-2.laz").unlink()
    damaged = next((out / "tasks" / "tiles").glob("*.result"))
    content = bytearray(damaged.read_bytes())
    content[-1] ^= 1
    damaged.write_bytes(content)
    (out / "third").mkdir()
    shutil.copy(out / "first" / "tile-1.laz", out / "third" / "tile-1.laz")
    document = correct_project(project, out, Options(page=False, resume=True)).document
    (older,) = [row for row in document["statements"] if row["what"] == "Older results"]
    assert older["sentence"].startswith("1 file is from an earlier run: from clouds or ")
    assert older["items"] == [{"name": "third/tile-1.laz", "text": "not from this run"}]
    shutil.rmtree(out / "third")
    same = outputs(out)
    same.pop("project.json"), before.pop("project.json")
    assert same == before
    kinds = [kind for kind, _ in worked(out)]
    assert sorted(kinds) == ["clouds", "tiles"]
    assert not (out / "project.html").exists()


def test_what_is_gone_or_cut_off_is_not_done(copy):
    "Of four clouds, two are left, and of two reports one: status says so, and how to go on"
    (copy / "first" / "tile-2.laz").unlink()
    (copy / "second" / "report.json").unlink()
    with open(copy / "first" / "tile-1.laz", "r+b") as file:
        file.truncate(1000)
    rows = {row["stage"]: (row["done"], row["tasks"]) for row in project_status(copy)["all"]}
    assert (rows["findings"], rows["clouds"], rows["reports"]) == ((4, 4), (2, 4), (1, 2))
    said = CliRunner().invoke(app, ["status", str(copy)]).stderr
    assert "Not running: continue with the same command and --resume." in said


def test_a_cloud_that_cannot_be_opened_is_a_fault_of_its_own(project, tmp_path):
    "A link that leads nowhere fails the task of its file alone; a folder of that name is none"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    (folder / "second" / "late.laz").symlink_to("nowhere")
    (folder / "second" / "old.laz").mkdir()
    tasks = tile_tasks(read_project(folder))
    faults = {task.name: carry_out(task, tmp_path / "tasks")[0] for task in tasks}
    assert "second/late.laz does not exist" in faults.pop("second/late.laz")
    assert [*faults.values()] == [""] * 4


@pytest.mark.long
def test_an_edited_control_list_reads_no_cloud_again(project, copy, tmp_path):
    "A check point that becomes control changes the estimate and all that follows, nothing before"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    out = copy
    control = folder / "control.csv"
    control.write_text(control.read_text().replace(",check", ",control"))
    result = correct_project(folder, out, Options(page=False, resume=True))
    assert result.document["drives"][0]["control"]["n_scored"] == 5
    kinds = {kind for kind, _ in worked(out)}
    assert kinds == {"tiles", "clouds", "reports"}  # whose paths are new, or their correction


@pytest.mark.long
@pytest.mark.parametrize("sent, code", [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)])
def test_an_ended_run_is_resumed_to_the_same_bytes(project, corrected, tmp_path, sent, code):
    "SIGKILL or Ctrl-C in the middle, then --resume: the same results as without"
    command = [*COMMAND, "correct", project, "-o", tmp_path / "out", "--no-report"]
    process = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True)
    log = tmp_path / "out" / "log.txt"
    due = time.monotonic() + 120
    while time.monotonic() < due and process.poll() is None:
        if log.exists() and "findings:" in log.read_text():
            break
        time.sleep(0.05)
    process.send_signal(sent)
    said = process.communicate()[1]
    assert process.returncode == code and "Traceback" not in said
    assert sent == signal.SIGKILL or "and --resume" in said
    assert not (tmp_path / "out" / "project.json").exists()
    correct_project(project, tmp_path / "out", Options(page=False, resume=True))
    assert outputs(tmp_path / "out") == outputs(corrected[1])
    assert not [*(tmp_path / "out" / "tasks").glob("part.*")]


@pytest.mark.long
def test_one_corrupt_file_is_named_and_the_rest_done(project, tmp_path):
    "Exit code 4, the file by its name in the log and in project.json, all others corrected"
    folder = shutil.copytree(project.parent, tmp_path / "city")
    tile = folder / "second" / "tile-2.laz"
    tile.write_bytes(tile.read_bytes()[:-2000])
    out = tmp_path / "out"
    command = [*COMMAND, "correct", folder, "-o", out, "--no-report", "--json"]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert run.returncode == 4, run.stderr
    (fault,) = json.loads(run.stdout)["faults"]
    assert fault["name"] == "second/tile-2.laz" and "truncated" in fault["fault"]
    assert sorted(path.name for path in (out / "second").glob("*.laz")) == ["tile-1.laz"]
    assert len([*(out / "first").glob("*.laz")]) == 2
    assert "Failed: second/tile-2.laz" in run.stderr


@pytest.mark.long
def test_results_are_of_the_paths_and_the_crs_that_are_asked_for(project, tmp_path):
    """Resumed by another path, a cloud that is missing is written; in another CRS nothing stays
    of the one before.
    """
    folder = shutil.copytree(project.parent, tmp_path / "city")
    out = tmp_path / "out"
    correct_project(folder, out, QUICK)
    (out / "first" / "tile-2.laz").unlink()
    (tmp_path / "link").symlink_to(folder)
    correct_project(tmp_path / "link", out, Options(page=False, resume=True))
    assert (out / "first" / "tile-2.laz").is_file()
    for path in folder.rglob("*.toml"):
        path.write_text(path.read_text().replace("EPSG:32650", "EPSG:32649"))
    with warnings.catch_warnings(action="ignore"):  # of the other zone
        correct_project(folder, out, Options(page=False, resume=True))
    assert json.loads((out / "first" / "report.json").read_text())["crs"] == "EPSG:32649"


def test_an_excluded_control_point_of_a_project_takes_no_part_in_any_drive(project, tmp_path):
    "Its residual is reported by each drive that observed it, and no drive uses it"
    parts = read_project(project)
    name = parts.control.name[1]
    result = correct_project(choosing(parts, [name], []), tmp_path / "out", QUICK)
    rows = [row for report in result.reports.values() for row in report["targets"]]
    own = [row for row in rows if row["name"] == name]
    assert own and not any(row["used"] for row in own)
    assert any(row["after"] is not None for row in own)
    assert {row["reason"] for row in own} == {"excluded by the user"}
    assert any(row["used"] for row in rows if row["role"] == "control")
