"""Fixtures and options that several test files share."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from mlscorr.simulate import Scenario, simulate
from tests.beds.made_once import contents, made_once
from tests.beds.places import MLSCORR


def pytest_configure(config):
    """Files run in their order: with those of many tests first, a slow example would end alone

    Bytecode is kept, as to compile 400 modules takes each process that a test starts 0.4 s.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def write_street(folder):
    scenario = Scenario(
        drive={"duration": 8.0},
        targets={"control": 4, "check": 1},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)


@pytest.fixture(scope="session")
def street(tmp_path_factory):
    "Folder of a simulated survey of 8 s: 4 control points and 1 check point; copy it to change it"
    folder = made_once(tmp_path_factory, "street", write_street)
    before = contents(folder)
    yield folder
    assert contents(folder) == before, "A test changed the street, which all tests share."


@pytest.fixture(scope="session")
def commanded(street, tmp_path_factory):
    "mlscorr correct --json on the street, with spaces and umlauts in the paths: (process, out)"
    folder = tmp_path_factory.mktemp("öffentliche Straße")
    shutil.copytree(street, folder / "Erste Fahrt")
    command = [MLSCORR, "correct", "Erste Fahrt/survey.toml", "-o", "out/für Müller", "--json"]
    command += ["--trajectory", "drive.sbet", "--trajectory", "drive.tum"]
    process = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    return process, folder / "out" / "für Müller"


@pytest.fixture(scope="session")
def in_part(street, tmp_path_factory):
    "mlscorr correct where the trajectory starts late and has a gap under T02: (process, out)"
    folder = shutil.copytree(street, tmp_path_factory.mktemp("in part") / "survey")
    header, *epochs = (folder / "trajectory.csv").read_text().splitlines()
    kept = [header, *epochs[51:296], *epochs[360:]]
    (folder / "trajectory.csv").write_text("\n".join(kept) + "\n")
    out = folder.parent / "out"
    command = [MLSCORR, "correct", folder, "-o", out, "--no-report"]
    return subprocess.run(command, capture_output=True, text=True), out
