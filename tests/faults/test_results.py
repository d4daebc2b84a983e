"""Results appear whole or not at all, whatever stands where they belong and whoever else writes."""

import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer

from mlscorr.cli.terminal import Exit, exit_code
from mlscorr.io.store import check_output, check_unchanged, input_file, output, output_folder
from mlscorr.io.surveys import read_survey
from tests.beds.places import ROOT


def write(out, text, overwrite=False, names=("a.txt", "sub/b.txt")):
    "Write a small result like a run"
    with output_folder(out, overwrite=overwrite) as folder:
        (folder / "sub").mkdir()
        for name in names:
            (folder / name).write_text(text)


def texts(out):
    return {str(p.relative_to(out)): p.read_text() for p in out.rglob("*") if p.is_file()}


def test_of_two_runs_into_a_new_folder_the_second_is_refused(tmp_path):
    "Both began when the folder wasn't there; the first to end stands, the other says so"
    out = tmp_path / "out"
    message = r"another run wrote 2 entries into .*Choose another"
    with pytest.raises(OSError, match=message), output_folder(out) as folder:
        (folder / "a.txt").write_text("late")
        write(out, "early")
    assert texts(out) == {"a.txt": "early", "sub/b.txt": "early"}
    assert list(tmp_path.iterdir()) == [out]


def test_overwriting_exchanges_the_folder_at_once(tmp_path, monkeypatch):
    "Until the moment when all is new, all is old, and what isn't replaced stays"
    out = tmp_path / "out"
    write(out, "old")
    (out / "notes.txt").write_text("mine")
    (out / "link").symlink_to("nowhere")
    seen = []
    exchange = output._exchange
    monkeypatch.setattr(
        output, "_exchange", lambda *pair: (seen.append(texts(out)), exchange(*pair))
    )
    write(out, "new", overwrite=True, names=("a.txt",))
    old = {"a.txt": "old", "sub/b.txt": "old", "notes.txt": "mine"}
    assert seen == [old]
    assert texts(out) == old | {"a.txt": "new"}
    assert os.readlink(out / "link") == "nowhere"
    assert list(tmp_path.iterdir()) == [out]


def test_a_disk_that_cannot_exchange_moves_file_by_file(tmp_path, monkeypatch):
    "Without the system's call files are replaced in turn"
    out = tmp_path / "out"
    write(out, "old")
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: object())
    write(out, "new", overwrite=True)
    assert set(texts(out).values()) == {"new"}
    assert list(tmp_path.iterdir()) == [out]


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path):
    "The folder of a killed process goes, that of a living one stays"
    out = tmp_path / "out"
    code = (
        "import sys, time; from mlscorr.io.store.output import output_folder\n"
        "with output_folder(sys.argv[1]) as folder:\n"
        "    (folder / 'half').write_text('x'); print('begun', flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", code, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout.readline() == "begun\n"
        (part,) = tmp_path.iterdir()
        write(tmp_path / "other", "new")
        write(out, "new")
        assert (part / "half").exists()
        process.send_signal(signal.SIGKILL)
    write(out, "newer", overwrite=True)
    assert not part.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "out"]


@pytest.mark.parametrize(("link", "out"), [("nowhere", "link"), ("link", "link"), ("no", "link/o")])
def test_a_link_that_leads_nowhere_is_refused_before_the_work(link, out, tmp_path):
    "A dangling link, a link to itself, a folder below one: said at the start"
    (tmp_path / "link").symlink_to(tmp_path / link)
    with pytest.raises(ValueError, match=r"is a link to .*, which does not exist"):
        check_output(tmp_path / out, [])


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="needs a second disk")
@pytest.mark.parametrize("linked", [False, True])
def test_a_link_to_another_disk_is_a_folder_like_any_other(linked, tmp_path):
    "The folder that a link leads to, there or on another disk, gets the results at once"
    if linked:
        place = Path("/dev/shm") / f"mlscorr-{os.getpid()}"
    else:
        place = tmp_path / "there"
    place.mkdir()
    try:
        (tmp_path / "out").symlink_to(place)
        write(tmp_path / "out", "old")
        write(tmp_path / "out", "new", overwrite=True)
        assert texts(place) == {"a.txt": "new", "sub/b.txt": "new"}
        assert (tmp_path / "out").is_symlink()
    finally:
        subprocess.run(["rm", "-rf", str(place)], check=True)


def test_a_mount_point_takes_the_results_file_by_file(tmp_path, monkeypatch):
    "If a folder next to the output is on another disk, incomplete files are kept inside"
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(output, "_place", lambda path: path.resolve())
    write(out, "old")
    with pytest.raises(ValueError, match="2 entries"):
        write(out, "new")
    write(out, "new", overwrite=True)
    assert texts(out) == {"a.txt": "new", "sub/b.txt": "new"}
    assert sorted(path.name for path in out.iterdir()) == ["a.txt", "sub"]


def replace(path):
    path.with_name("new").write_text("new text")
    os.replace(path.with_name("new"), path)


def rewrite(path):
    "Other bytes of the same number, and the old time of change"
    status = path.stat()
    path.write_text("new text")
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.parametrize("change", [replace, rewrite, Path.unlink, lambda p: p.write_text("long")])
def test_an_input_that_changes_while_it_is_read_stops_the_run(change, tmp_path):
    "Replaced, rewritten, removed or grown: nothing appears, and the file is named"
    path = tmp_path / "pass-1.laz"
    out = tmp_path / "out"
    path.write_text("old text")
    inputs = [input_file("cloud", path)]
    check_unchanged(inputs)
    time.sleep(0.02)  # s, the finest step of a file's time
    message = r"1 of 1 input files.*pass-1\.laz"
    with pytest.raises(OSError, match=message), output_folder(out, inputs):
        change(path)
    assert not out.exists()
    assert not list(tmp_path.glob(".out*"))


@pytest.mark.parametrize(
    "touch", [lambda p: p.chmod(0o400), lambda p: p.with_name("backup").hardlink_to(p)]
)
def test_other_rights_and_links_of_an_input_leave_a_run_alone(touch, tmp_path):
    "A backup that links what is read, or a change of its rights, changes nothing of its content"
    path = tmp_path / "pass-1.laz"
    out = tmp_path / "out"
    path.write_text("old text")
    inputs = [input_file("cloud", path)]
    time.sleep(0.02)  # s, the finest step of a file's time
    with output_folder(out, inputs):
        touch(path)
    assert out.is_dir()


def test_an_input_in_a_folder_that_gets_results_is_refused(tmp_path):
    "Below the output folder, too, where results go there: by overwriting as well"
    path = tmp_path / "shift" / "pass-1.laz"
    path.parent.mkdir()
    path.write_text("old text")
    check_output(tmp_path, [path], overwrite=True)
    with pytest.raises(ValueError, match=r"the input shift/pass-1\.laz, which must"):
        check_output(tmp_path, [path], True, ["shift"])


def test_a_survey_knows_the_files_that_it_was_read_from(street, tmp_path):
    "survey.toml and all that it names are watched from before their first byte is read"
    folder = shutil.copytree(street, tmp_path / "survey")
    survey = read_survey(folder)
    names = ["survey.toml", "pass-1.laz", "trajectory.csv", "control.csv"]
    assert [file.path.name for file in survey.inputs] == names
    check_unchanged(survey.inputs)
    for file in survey.inputs:
        content = file.path.read_bytes()
        file.path.write_bytes(content + b"\n")
        with pytest.raises(OSError, match=file.path.name):
            check_unchanged([file])


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_last_moments_changes_nothing(number):
    "While the interpreter ends nothing is left to interrupt: exit code 0, not a word on stderr"
    code = (
        "import atexit, os, sys; from mlscorr.cli import main\n"
        f"atexit.register(os.kill, os.getpid(), {int(number)})\n"
        "sys.argv = ['mlscorr', '--help']; main()"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (process.returncode, process.stderr) == (0, "")


@pytest.mark.parametrize("has_results", [False, True])
def test_an_interruption_says_whether_results_stand(has_results, capsys):
    "Between the last rename and the end of the work all is there"
    with pytest.raises(typer.Exit) as ended, exit_code(Exit.BAD_DATA, lambda: has_results):
        raise KeyboardInterrupt
    assert ended.value.exit_code == 130
    assert ("all results were already written" in capsys.readouterr().err) == has_results


def test_a_document_that_finds_no_room_leaves_the_one_before(tmp_path):
    "As project.json on a full disk: it is the old one, and nothing lies beside it"
    resource = pytest.importorskip("resource", reason="Windows limits no sizes of files")
    path = tmp_path / "project.json"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    output.write_json(path, {"name": "old"})
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            output.write_json(path, {"name": "new" * 10_000})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert json.loads(path.read_text()) == {"name": "old"}
    assert list(tmp_path.iterdir()) == [path]
