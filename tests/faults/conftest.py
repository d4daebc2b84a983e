"""Common parts of the tests of faults: their count, and a process in which calls fail."""

import shutil
import subprocess

import laspy
import numpy as np
import pytest

from mlscorr.io.tables import read_control
from tests.beds.places import ROOT
from tests.faults.sizes import IS_FULL
from tests.faults.stage import Stage

NEAR = 1.5  # m from a control point: what is left of the cloud


def pytest_terminal_summary(terminalreporter):
    "Number and outcome of the tested faults, for docs/faults.md"
    for report in terminalreporter.getreports("passed") if IS_FULL else ():
        for what, outcome in report.user_properties:
            terminalreporter.write_line(f"{what}: {outcome}")


@pytest.fixture(scope="session")
def tiny(street, tmp_path_factory):
    """The street with little more than its targets, so that a correction takes two seconds

    LAS, for the threads that read LAZ don't survive a fork.
    """
    folder = tmp_path_factory.mktemp("tiny") / "survey"
    shutil.copytree(street, folder, ignore=shutil.ignore_patterns("truth.*"))
    cloud = laspy.read(folder / "pass-1.laz")
    control, check, _ = read_control(folder / "control.csv")
    places = np.vstack([control.position, check.position])
    away = np.linalg.norm(cloud.xyz[:, None] - places, axis=2).min(axis=1)
    cloud.points = cloud.points[away < NEAR]
    cloud.write(folder / "pass-1.las")
    (folder / "pass-1.laz").unlink()
    text = (folder / "survey.toml").read_text()
    (folder / "survey.toml").write_text(text.replace("pass-1.laz", "pass-1.las"))
    return folder


@pytest.fixture(scope="session")
def shim(tmp_path_factory):
    "The library that lets calls fail"
    if shutil.which("cc") is None:
        pytest.skip("needs a C compiler, cc")
    library = tmp_path_factory.mktemp("shim") / "failing_calls.so"
    source = ROOT / "tests" / "faults" / "failing_calls.c"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True)
    return library


@pytest.fixture(scope="session")
def stage(shim, tiny, tmp_path_factory):
    "A Stage for the tiny survey"
    with Stage(shim, tiny, tmp_path_factory.mktemp("stage")) as made:
        yield made
