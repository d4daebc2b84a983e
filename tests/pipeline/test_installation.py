"""Findings of doctor on any machine, and the commands that install missing parts."""

import json
import platform
import re
import subprocess
import sys

import pytest

from mlscorr.pipeline.installation import (
    EXTRAS,
    LIBRARIES,
    PACKAGES,
    Installation,
    InstalledPart,
    _extra,
    remedy,
)
from tests.beds.places import MLSCORR, ROOT


@pytest.fixture(scope="module")
def examined():
    "One run of mlscorr doctor --json: (process, findings by name)"
    process = subprocess.run([MLSCORR, "doctor", "--json"], capture_output=True, text=True)
    document = json.loads(process.stdout)
    assert next(iter(document.items())) == ("schema", "mlscorr.doctor/1")
    return process, {finding["name"]: finding for finding in document["findings"]}


def test_a_python_that_cannot_be_started_draws_no_picture():
    "Doctor reports an interpreter that is part of another program, and continues"
    code = "import sys, mlscorr; sys.executable = ''; print(*mlscorr.doctor().parts, sep='\\n')"
    told = subprocess.check_output([sys.executable, "-c", code], text=True, cwd=ROOT)
    assert "'off-screen picture', ok=False" in told


def test_all_that_is_needed_is_looked_at(examined):
    "Python, packages, extras, the system libraries, off-screen drawing and the geoid grids"
    others = ("python", "Vulkan drivers", "off-screen picture", "geoid grids")
    assert list(examined[1]) == [others[0], *PACKAGES, *EXTRAS, *LIBRARIES, *others[1:]]


def test_an_extra_that_is_not_installed_is_nothing_missing():
    "Without pye57 the installation is complete, and the line says how to add it"
    part = _extra("no-such-package", "e57")
    assert part.mark == "without" and "pip install 'mlscorr[e57]'" in part.state
    assert Installation((part,)).is_complete and not Installation((part,)).remedies


def test_versions_are_told(examined):
    "Python and each package that is installed come with their version"
    findings = examined[1]
    assert findings["python"]["found"] == platform.python_version()
    for name in PACKAGES:
        if findings[name]["ok"]:
            assert re.match(r"\d+\.\d+", findings[name]["found"]), name


def test_every_finding_is_a_line_on_stderr(examined):
    "ok, MISSING where it is needed, without where it is not; stdout holds the document alone"
    process, findings = examined
    lines = process.stderr.splitlines()
    for name, finding in findings.items():
        if finding["ok"]:
            mark = "ok"
        else:
            mark = "MISSING" if finding["needed"] else "without"
        assert f"{mark:7s} {name}: {finding['found']}" in lines
    assert process.stdout.count("\n") == 1


def test_the_exit_code_tells_whether_something_needed_is_missing(examined):
    "7 when a library that is needed is missing, else 0, without geoid grids too"
    process, findings = examined
    missing = [f["name"] for f in findings.values() if f["needed"] and not f["ok"]]
    assert process.returncode == (7 if missing else 0)


def test_what_is_missing_comes_with_the_line_that_installs_it(examined):
    "stderr ends with the lines that remedy() gives for these findings, and every gap has one"
    process, findings = examined
    parts = [InstalledPart(*finding.values()) for finding in findings.values()]
    lines = remedy(parts)
    told = [line for line in process.stderr.splitlines() if line.startswith("To install")]
    assert told == [f"To install what is missing:  {line}" for line in lines]
    for finding in findings.values():
        if finding["needed"] and not finding["ok"]:
            assert finding["remedy"]


# ---- remedy: findings given by hand


def test_nothing_is_missing_nothing_is_to_be_installed():
    "Present parts have no command, even if it is known"
    assert remedy([InstalledPart("libGL.so.1", True, "found", "apt-get install -y libgl1")]) == []


def test_system_libraries_share_one_line():
    "Several missing libraries are one apt-get line, each package once, in the order found"
    findings = [
        InstalledPart("libusb-1.0.so.0", False, "missing", "apt-get install -y libusb-1.0-0"),
        InstalledPart("libGL.so.1", True, "found", ""),
        InstalledPart("libEGL.so.1", False, "missing", "apt-get install -y libegl1"),
        InstalledPart("libEGL.so", False, "missing", "apt-get install -y libegl1"),
    ]
    assert remedy(findings) == ["apt-get install -y libusb-1.0-0 libegl1"]


def test_python_packages_share_one_line():
    "pip is told all missing packages at once, so that it settles their versions together"
    findings = [
        InstalledPart("lazrs", False, "missing", "pip install lazrs"),
        InstalledPart("numba", False, "missing", "pip install numba"),
    ]
    assert remedy(findings) == ["pip install lazrs numba"]


def test_each_installer_has_its_line():
    "apt-get, pip and pyproj each install their own; what is optional is offered as well"
    findings = [
        InstalledPart("geoid grids", False, "0", "pyproj sync --area-of-use COUNTRY", needed=False),
        InstalledPart("jinja2", False, "missing", "pip install jinja2"),
        InstalledPart("libGL.so.1", False, "missing", "apt-get install -y libgl1"),
    ]
    assert remedy(findings) == [
        "apt-get install -y libgl1",
        "pip install jinja2",
        "pyproj sync --area-of-use COUNTRY",
    ]


def test_a_failure_without_a_remedy_gives_no_line():
    "A picture that can't be drawn is told, but the drivers' own finding says what to install"
    assert remedy([InstalledPart("off-screen picture", False, "failed", needed=False)]) == []


def test_a_notebook_shows_state_and_remedy():
    "Each part with its state in a word, and the lines that install what is missing"
    shown = Installation((InstalledPart("lazrs", False, "none", "pip install lazrs"),))
    assert not shown.is_complete
    assert "<td>lazrs</td><td>MISSING</td><td>none</td>" in shown._repr_html_()
    assert "pip install lazrs" in shown._repr_html_()
