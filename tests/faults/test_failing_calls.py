"""Disks that are full, broken or forbidden in the middle of a run: all of the results, or none.

``make faults`` lets hundreds of calls fail; each run's results are compared byte for byte.
"""

import errno
import os
import shutil
import signal
import subprocess
import time
from collections import Counter
from itertools import product

import numpy as np
import pytest

from tests.beds.places import MLSCORR
from tests.faults.sizes import IS_FULL, tries
from tests.faults.stage import content, send

CAUSES = {
    errno.ENOSPC: "No space left on device",
    errno.EIO: "Input/output error",
    errno.EACCES: "Permission denied",
}
COMMANDS = tuple(
    product(("simulate", "extract", "calibrate", "correct"), ("write", "open", "close"))
)
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


@pytest.fixture(scope="module")
def kept(stage):
    "Calls of an undisturbed correction, what it writes, and a folder of older results"
    command = ("correct", stage.survey, "--no-report")
    calls, whole = stage.calls(*command, is_computed=True)
    older = stage.folder / "older"
    shutil.move(stage.runs / "out", older)
    (older / "trajectory.csv").write_text("old")
    (older / "notes.txt").write_text("of the user")
    return calls, whole, older


def drawn(calls, rng):
    "A call and its number, each kind of call as likely as another"
    counts = Counter(calls)
    call = rng.choice(sorted(counts))
    return {"call": call, "number": int(rng.integers(counts[call])) + 1}


def prepared(stage, kept, overwrites):
    "Command, what stands before it and what it should write"
    _, whole, older = kept
    stage.clear(older if overwrites else None)
    before = content(stage.runs)
    command = ["correct", stage.survey, "--no-report"]
    if overwrites:
        return [*command, "--overwrite"], before, before | whole
    return command, before, whole


def check_again(stage, command, before, whole, left):
    "After whatever was left the next run writes the same bytes and leaves nothing else"
    if left == before:
        return
    again = stage.run(*dict.fromkeys([*command, "--overwrite"]), is_computed=True)
    assert (again.code, again.left) == (0, whole), again.stderr


@pytest.mark.long
def test_a_failing_call_leaves_all_or_nothing(stage, kept, record_property):
    "Whatever call fails: one sentence with the cause, the old results or the new, and no .part"
    rng = np.random.default_rng(18)
    outcomes = Counter()
    for _ in range(tries(3, 400)):
        overwrites = bool(rng.integers(2))
        command, before, whole = prepared(stage, kept, overwrites)
        error = int(rng.choice(list(CAUSES)))
        fault = drawn(kept[0], rng) | {"errno": error}
        ended = stage.run(*command, is_computed=True, **fault)
        if ended.code:
            assert (ended.code, ended.left) == (5, before), (fault, ended)
            assert ended.is_told and CAUSES[error] in ended.stderr, ended.stderr
        else:  # of a call that is only tried, as a link where a copy will do
            assert ended.left == whole, (fault, ended)
        outcomes[ended.code] += 1
    assert outcomes[5]
    record_property("failing calls", dict(outcomes))


def test_a_kill_in_a_call_leaves_all_or_nothing(stage, kept, record_property):
    "Killed or interrupted in any call: old results or new, and the next run clears the rest away"
    rng = np.random.default_rng(18)
    outcomes = Counter()
    for _ in range(tries(2, 200)):
        command, before, whole = prepared(stage, kept, bool(rng.integers(2)))
        number = SIGNALS[rng.integers(len(SIGNALS))]
        ended = stage.run(*command, is_computed=True, **drawn(kept[0], rng), errno=-number)
        outcomes[check_ended(ended, number, before, whole)] += 1
        check_again(stage, command, before, whole, ended.left)
    record_property("kills in calls", dict(outcomes))


@pytest.mark.skipif(not IS_FULL, reason="in make faults: moments are those of a clock")
def test_a_kill_at_any_moment_leaves_all_or_nothing(stage, kept, record_property):
    "From the first read byte to the last written one, in whole runs"
    rng = np.random.default_rng(18)
    outcomes = Counter()
    stage.clear()
    start = time.perf_counter()
    stage.run("correct", stage.survey, "--no-report")
    length = time.perf_counter() - start
    for _ in range(tries(0, 200)):
        command, before, whole = prepared(stage, kept, bool(rng.integers(2)))
        number = SIGNALS[rng.integers(len(SIGNALS))]
        moment = rng.uniform(0.0, length)

        def kill(process, number=number, moment=moment):
            time.sleep(moment)
            send(process, number)

        ended = stage.run(*command, meanwhile=kill)
        outcomes[check_ended(ended, number, before, whole)] += 1
        check_again(stage, command, before, whole, ended.left)
    record_property("kills at moments", dict(outcomes))


def check_ended(ended, number, before, whole):
    "A run that got a signal: how it ended, in a word"
    left = {name: hashed for name, hashed in ended.left.items() if ".part" not in name}
    assert left in (before, whole), ended
    assert "Traceback" not in ended.stderr
    if ended.code == 0:
        assert left == whole
        return "done before"
    if number == signal.SIGKILL:
        assert ended.code == -number
        return "killed"
    assert ended.code == 130 and left == ended.left, ended
    if left == whole:
        said = "all results were already written"
    else:
        said = "nothing was written"
    assert ended.stderr.endswith(f"Interrupted; {said}.\n")
    return f"interrupted; {said}"


@pytest.mark.long
@pytest.mark.parametrize(("command", "call"), COMMANDS if IS_FULL else COMMANDS[:1])
def test_every_command_says_that_the_disk_is_full(command, call, shim, tiny, tmp_path):
    "As users run them: exit code 5, one sentence, nothing left, the input intact"
    before = content(tiny)
    runs = tmp_path / "runs"
    runs.mkdir()
    fault = {"FOLDER": f"{runs}/", "CALL": call, "NUMBER": "2", "ERRNO": str(errno.ENOSPC)}
    env = os.environ | {f"FAULT_{name}": value for name, value in fault.items()}
    survey = tiny
    if command == "simulate":
        survey = tmp_path / "scenario.toml"
        survey.write_text("[drive]\nduration = 4.0\n[targets]\ncontrol = 2\ncheck = 1\n")
    process = subprocess.run(
        [MLSCORR, command, survey, "-o", runs / "out"],
        env=env | {"LD_PRELOAD": str(shim)},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 5, process.stderr
    (sentence,) = [line for line in process.stderr.splitlines() if line.startswith("Error: ")]
    assert CAUSES[errno.ENOSPC] in sentence and "Traceback" not in process.stderr
    assert content(runs) == {} and content(tiny) == before
