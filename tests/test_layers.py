"""The law of the house: imports point strictly downward, heavy libraries stay in their rooms."""

import ast
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import mlscorr

PACKAGE = Path(mlscorr.__file__).parent
FLOORS = (  # from the ground up; rooms on one floor do not know each other
    ("compiled_loops",),
    ("wording",),
    ("survey",),
    ("frames",),
    ("correction", "collocation", "pos"),
    ("effects", "io", "matching"),
    ("simulate", "baselines", "targets", "ties", "estimate"),
    ("gap", "evaluate"),
    ("blind", "report"),
    ("pipeline",),
    ("cli",),
)
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
GAP_FLOORS = (  # of the rooms within gap, likewise
    ("residuals",),
    ("signatures",),
    ("evidence",),
    ("closure", "plan", "contrast"),
    ("document",),  # and __init__, which offers the costs of mistakes
)
GAP_FLOOR = {room: number for number, rooms in enumerate(GAP_FLOORS) for room in rooms}
ROOMS_OF = {
    "laspy": {"io"},
    "openpyxl": {"io"},
    "pye57": {"io"},
    "open3d": {"baselines", "simulate", "report"},
    "sklearn": {"baselines", "gap"},
}
SIMULATOR = (  # floors inside simulate; its rooms on one floor do not know each other
    ("settings", "vehicle", "scenario", "columns"),
    ("scene",),
    ("drive", "pos", "scan"),
    ("recording", "scenario_file", "simulator_file"),
    ("survey",),
    ("displacement", "random_survey"),
    ("mechanisms",),
)
SIMULATOR_FLOOR = {room: number for number, rooms in enumerate(SIMULATOR) for room in rooms}
MODULES = sorted(
    path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.stem[0] != "_"
)
PROJECT_FLOORS = (  # of the modules within pipeline/project, which stands on top of one survey
    ("settings", "engine", "tasks", "wording"),
    ("joint", "file_tasks", "running", "progress"),
    ("areas", "drive_estimate", "joint_estimate"),
    ("corrected",),
    ("merged",),
    ("city",),
    ("stages",),
    ("document",),
    ("correction", "checking"),
    ("status",),
)
PROJECT_FLOOR = {room: number for number, rooms in enumerate(PROJECT_FLOORS) for room in rooms}
GAP_MODULES = sorted((PACKAGE / "gap").rglob("*.py"))


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


@pytest.mark.parametrize("path", GAP_MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_within_the_gap_point_downward(path):
    "Residuals, signatures, evidence, closure and plan, document: each knows those before it"
    room = path.relative_to(PACKAGE / "gap").parts[0].removesuffix(".py")
    for name in imports_of(path):
        parts = name.split(".")
        if parts[:2] == ["mlscorr", "gap"] and len(parts) > 2 and parts[2] in GAP_FLOOR:
            below = GAP_FLOOR[parts[2]] < GAP_FLOOR.get(room, len(GAP_FLOORS))
            assert below or parts[2] == room, f"{room} imports {name}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "pipeline").glob("*.py")), ids=lambda p: p.stem)
def test_a_survey_knows_no_project(path):
    "Commands for one survey do without those for many"
    assert not any(name.startswith("mlscorr.pipeline.project") for name in imports_of(path))


@pytest.mark.parametrize(
    "path", sorted((PACKAGE / "pipeline" / "project").glob("[a-z]*.py")), ids=lambda p: p.stem
)
def test_imports_within_a_project_point_downward(path):
    "Tasks and engines, what touches files, what joins drives, the story: each knows those below"
    for name in imports_of(path):
        parts = name.split(".")
        if parts[:3] == ["mlscorr", "pipeline", "project"] and len(parts) > 3:
            assert PROJECT_FLOOR[parts[3]] < PROJECT_FLOOR[path.stem], f"{path.stem}: {name}"


IO_FLOORS = ("store", "tables", "trajectories", "clouds", "surveys")  # from the ground up


@pytest.mark.parametrize(
    "path", sorted((PACKAGE / "io").rglob("*/*.py")), ids=lambda p: f"{p.parent.name}/{p.stem}"
)
def test_imports_within_the_files_point_downward(path):
    "Bytes, tables, trajectories, clouds, surveys: each knows what comes before it alone"
    room = IO_FLOORS.index(path.parent.name)
    for name in imports_of(path):
        parts = name.split(".")
        if parts[:2] == ["mlscorr", "io"] and len(parts) > 2 and parts[2] in IO_FLOORS:
            assert IO_FLOORS.index(parts[2]) <= room, name


FACES = {  # dotted name of each room -> its folder; what stands directly in mlscorr has no face
    ".".join(path.parent.relative_to(PACKAGE.parent).parts): path.parent
    for path in PACKAGE.rglob("__init__.py")
    if path.parent != PACKAGE
}


def dotted(path):
    "mlscorr.io.clouds.las of its path"
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)


def room_of_module(name):
    "The innermost room that a dotted name is, or is in"
    while name not in FACES and "." in name:
        name = name.rpartition(".")[0]
    return name


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_no_import_reaches_past_a_face(path):
    "A module of another room is known by what the room's __init__ offers"
    own = room_of_module(dotted(path).removesuffix(".__init__"))
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("mlscorr."):
            room = room_of_module(node.module)
            is_inside = f"{own}.".startswith(f"{room}.")  # a room within another knows its parent
            assert is_inside or room in (node.module, "mlscorr"), node.module


def test_no_imports_go_in_circles():
    "No module needs, by whatever way, one that needs it, for types or within functions either"
    modules = {dotted(path).removesuffix(".__init__"): path for path in MODULES}
    below = {
        name: {other for other in imports_of(path) if other in modules}
        for name, path in modules.items()
    }
    open_modules = {  # a room is not below the modules within it
        name: {other for other in others if not f"{name}.".startswith(f"{other}.")}
        for name, others in below.items()
    }
    while done := {name for name, others in open_modules.items() if not others & set(open_modules)}:
        open_modules = {name: o for name, o in open_modules.items() if name not in done}
    assert not open_modules


@pytest.mark.parametrize(
    "path",
    sorted((PACKAGE / "simulate").rglob("*/*.py")),
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_rooms_of_the_simulator_know_those_below(path):
    "A scene knows no drive, and scanners no POS; other rooms enter by the door of each"
    room = path.parent.name
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom) or not node.module.startswith("mlscorr.simulate."):
            continue
        other, *inner = node.module.split(".")[2:]
        if other != room:
            assert SIMULATOR_FLOOR[other] < SIMULATOR_FLOOR[room], node.module
            assert not inner, f"{node.module} is behind the door of {other}"


@pytest.mark.parametrize(
    "path", sorted((PACKAGE / "simulate").glob("[a-z]*.py")), ids=lambda path: path.stem
)
def test_modules_of_the_simulator_know_those_below(path):
    "Scenario and settings know nothing of what is made of them; only write opens a module later"
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module.startswith("mlscorr.simulate."):
            other, *inner = node.module.split(".")[2:]
            assert SIMULATOR_FLOOR[other] < SIMULATOR_FLOOR[path.stem], node.module
            assert not inner, f"{node.module} is behind the door of {other}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    "laspy and pye57 are known to io alone, open3d and sklearn to the rooms that ROOMS_OF names"
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
    assert loaded.isdisjoint({"numpy", "scipy", "laspy", "open3d", "sklearn", "numba", "openpyxl"})


def test_workbooks_load_openpyxl_alone():
    "Reading tables does not load openpyxl: a survey without .xlsx never pays for it"
    assert "openpyxl" not in loaded_by("import mlscorr.io.surveys.survey_file")


def test_the_simulator_does_not_know_the_estimator():
    "The simulator cannot draw its drift from the estimator's model: it never loads it"
    modules = (dotted(path) for path in (PACKAGE / "simulate").rglob("[a-z_]*.py"))
    loaded = loaded_by(f"import {', '.join(modules)}".replace(".__init__", ""))
    assert loaded.isdisjoint({"mlscorr.pos", "mlscorr.collocation", "mlscorr.estimate"})


def test_open3d_is_loaded_only_to_cast_rays():
    "Importing the simulator or the report does not load Open3D"
    assert "open3d" not in loaded_by(
        "import mlscorr.simulate.survey, mlscorr.report.correction_page"
    )


def test_what_the_terminal_says_loads_no_figures():
    "A command without a page never pays for Matplotlib"
    loaded = loaded_by("import mlscorr.cli, mlscorr.pipeline, mlscorr.report.headline")
    assert "matplotlib" not in loaded


def test_studies_import_what_there_is():
    "A benchmark whose library moved under it would be found by nobody until its figure is needed"
    folder = PACKAGE.parent / "benchmarks"
    lacking = []
    for path in sorted(folder.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            own = folder / f"{node.module}.py"
            if node.module.split(".")[0] == "mlscorr":
                module = import_module(node.module)
                lacking += [
                    f"{path.name}: {node.module}.{alias.name}"
                    for alias in node.names
                    if not hasattr(module, alias.name)
                    and find_spec(f"{node.module}.{alias.name}") is None
                ]
            elif find_spec(node.module.split(".")[0]) is None and not own.exists():
                lacking.append(f"{path.name}: {node.module}")
    assert not lacking


def test_workers_load_no_library_that_they_can_do_without():
    "Each costs a worker of a project up to a second and 40 MB"
    lines = "import sys", "import mlscorr.pipeline.project", "print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", "; ".join(lines)], capture_output=True, text=True, check=True
    ).stdout.split()
    spared = {"scipy.stats", "sklearn", "pandas", "matplotlib", "open3d", "jinja2", "distributed"}
    assert "mlscorr.pipeline.project.tasks" in loaded
    assert spared.isdisjoint(loaded)
