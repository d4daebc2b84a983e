"""The law of the house: imports point strictly downward, heavy libraries stay in their rooms."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import mlscorr

PACKAGE = Path(mlscorr.__file__).parent
FLOORS = (  # from the ground up; rooms on one floor do not know each other
    ("survey", "covariance", "accuracy"),
    ("georeference", "collocation"),
    ("effects", "matching", "io", "uncertainty"),
    ("targets", "correction", "calibration", "baselines"),
    ("simulate", "evaluation", "quality"),
    ("gap", "report"),
    ("pipeline", "doctor"),
    ("cli",),
)
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
ROOMS_OF = {
    "laspy": {"io"},
    "open3d": {"baselines", "simulate", "report"},
    "sklearn": {"targets"},
}
MODULES = sorted(
    path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.stem[0] != "_"
)


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports_of(path):
    "Dotted names of all that a module imports, inside functions too"
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the floor"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_downward(path):
    "Every module stands on a floor and imports only its own room and floors below"
    room = room_of(path)
    for name in imports_of(path):
        parts = name.split(".")
        if parts[0] != "mlscorr" or len(parts) == 1 or parts[1] == room:
            continue
        assert FLOOR[parts[1]] < FLOOR[room], f"{room} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    "laspy is known to io alone, open3d to baselines, simulate and report, sklearn to targets"
    for name in imports_of(path):
        library = name.split(".")[0]
        assert library not in ROOMS_OF or room_of(path) in ROOMS_OF[library], name


def loaded_by(statement):
    "Names of the modules that a fresh interpreter holds after a statement"
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    return set(subprocess.check_output([sys.executable, "-c", code], text=True).split())


def test_the_package_loads_nothing_until_it_is_used():
    "import mlscorr loads no library at all"
    loaded = loaded_by("import mlscorr")
    assert loaded.isdisjoint({"numpy", "scipy", "laspy", "open3d", "sklearn", "numba"})


def test_the_simulator_does_not_know_the_estimator():
    "The simulator cannot draw its drift from the estimator's model: it never loads it"
    loaded = loaded_by("import mlscorr.simulate")
    assert loaded.isdisjoint({"mlscorr.covariance", "mlscorr.collocation", "mlscorr.correction"})


def test_open3d_is_loaded_only_to_cast_rays():
    "Importing the simulator or the report does not load Open3D"
    assert "open3d" not in loaded_by("import mlscorr.simulate, mlscorr.report")
