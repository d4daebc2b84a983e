"""Compiled loops are kept somewhere on every machine, and used again wherever they fit."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from shutil import copy

import pytest

import mlscorr
from mlscorr.compiled_loops import writable_folder

COUNTS = """
from typing import NamedTuple
from mlscorr.compiled_loops import loop

class Counts(NamedTuple):
    first: int
    second: int
"""
LOOPS = """
from mlscorr.compiled_loops import loop
from mlscorr.{module} import Counts

@loop
def total(counts):
    return counts.first + counts.second
"""
RUN = """
from mlscorr.{module} import Counts
from mlscorr.loops import total
assert total(Counts(1, 2)) == 3
print(sum(total.stats.cache_hits.values()))
"""


def write_package(folder, module):
    "A package of one loop and, in a module by this name, what the loop takes"
    package = folder / "mlscorr"
    package.mkdir(parents=True, exist_ok=True)
    (package / "__init__.py").touch()
    copy(Path(mlscorr.__file__).parent / "compiled_loops.py", package)
    (package / f"{module}.py").write_text(COUNTS)
    (package / "loops.py").write_text(LOOPS.format(module=module))


def hits(package, home, module, **environment):
    "Number of compiled loops that a run of the package finds"
    words = {"PATH": os.environ["PATH"], "HOME": str(home), "PYTHONPATH": str(package)}
    command = [sys.executable, "-c", RUN.format(module=module)]
    return int(subprocess.check_output(command, env={**words, **environment}, cwd=package))


def test_two_environments_share_what_was_compiled(tmp_path):
    "The second copy of a package, in another place, compiles nothing"
    for name, expected in (("first", 0), ("second", 1)):
        write_package(tmp_path / name, "counts")
        assert hits(tmp_path / name, tmp_path, "counts") == expected
    assert (tmp_path / ".cache" / "mlscorr" / "loops").is_dir()


def test_a_module_that_moved_is_compiled_anew(tmp_path):
    "Loops are compiled again if a function they use is in another module"
    write_package(tmp_path / "package", "counts")
    assert hits(tmp_path / "package", tmp_path, "counts") == 0
    (tmp_path / "package" / "mlscorr" / "counts.py").unlink()
    write_package(tmp_path / "package", "quantities")
    assert hits(tmp_path / "package", tmp_path, "quantities") == 0


def test_the_folder_that_a_user_names_is_taken(tmp_path):
    "NUMBA_CACHE_DIR goes before the home"
    write_package(tmp_path / "package", "counts")
    named = tmp_path / "named"
    assert hits(tmp_path / "package", tmp_path, "counts", NUMBA_CACHE_DIR=str(named)) == 0
    assert hits(tmp_path / "package", tmp_path, "counts", NUMBA_CACHE_DIR=str(named)) == 1
    assert [path.name for path in named.iterdir()] == ["mlscorr"]


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    "The system's temporary folder"
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_the_first_folder_that_can_be_written_is_taken(temporary):
    "It is made where it is missing"
    folder = temporary / "home" / "loops"
    assert writable_folder(Path("/proc/nowhere"), folder) == folder
    assert folder.is_dir()


def test_loops_are_kept_without_a_home(temporary):
    "They go to a folder of the user's own, the same each time, which nobody else can open"
    for _ in range(2):
        folder = writable_folder(Path("/proc/nowhere"))
        assert folder == temporary / f"mlscorr-{os.getuid()}"
        assert folder.stat().st_mode & 0o777 == 0o700


def test_a_folder_that_leads_elsewhere_is_not_trusted(temporary):
    "Code in the folder is run, so a link in its place is replaced by a new folder"
    (temporary / "elsewhere").mkdir()
    (temporary / f"mlscorr-{os.getuid()}").symlink_to(temporary / "elsewhere")
    folder = writable_folder(Path("/proc/nowhere")).resolve()
    assert folder != temporary / "elsewhere"
    assert folder.parent == temporary
