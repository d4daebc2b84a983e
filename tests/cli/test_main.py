"""The command line as a module of Python."""

import subprocess
import sys
import tomllib

from tests.beds.places import ROOT


def test_the_module_states_its_version():
    "`python -m mlscorr --version` prints that of pyproject.toml and nothing else"
    command = [sys.executable, "-m", "mlscorr", "--version"]
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert subprocess.check_output(command, text=True) == f"{version}\n"
