"""The law of the house: imports point strictly downward, heavy libraries stay in their rooms."""

import ast
import subprocess
import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import mlscorr

PACKAGE = Path(mlscorr.__file__).parent
TESTS = Path(__file__).parent
FLOORS = (  # from the ground up; rooms on one floor do not know each other
    ("compiled_loops",),
    ("wording",),
    ("survey",),
    ("frames",),
    ("correction", "collocation"),
    ("pos",),
    ("effects", "io", "matching"),
    ("simulate", "baselines", "targets", "estimate", "surfaces"),
    ("ties",),
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
    "open3d": {"baselines", "simulate", "report", "survey"},
    "sklearn": {"baselines", "gap"},
}
SIMULATOR = (  # floors inside simulate; its rooms on one floor do not know each other
    ("settings", "vehicle", "scenario", "columns"),
    ("scene",),
    ("drive", "pos", "scan"),
    ("recording", "simulator_file"),
    ("survey",),
    ("_mechanisms", "_random_survey"),
)
SIMULATOR_FLOOR = {room: number for number, rooms in enumerate(SIMULATOR) for room in rooms}
MODULES = sorted(
    path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.stem[0] != "_"
)
PROJECT_FLOORS = (  # of the modules within pipeline/project, which stands on top of one survey
    ("settings", "engine", "tasks", "wording"),
    ("joint", "file_tasks", "running", "progress"),
    ("areas", "drive_estimate"),
    ("corrected",),
    ("merged",),
    ("city",),
    ("stages",),
    ("document",),
    ("correction", "checking"),
    ("status",),
)
PROJECT_FLOOR = {room: number for number, rooms in enumerate(PROJECT_FLOORS) for room in rooms}


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def statements(path):
    "Imports of a module, inside functions too"
    kinds = ast.Import | ast.ImportFrom
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, kinds)]


def imports_of(path):
    "Dotted names of all that a module imports, inside functions too"
    for node in statements(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: relative imports hide the floor"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def imports_within(room):
    """Imports of a room's modules from the room itself: (path in the room, part, dotted name)

    Of mlscorr.gap: (evidence/decision.py, "residuals", "mlscorr.gap.residuals.Residuals").
    """
    folder = PACKAGE.parent / room.replace(".", "/")
    for path in sorted(folder.rglob("*.py")):
        for name in imports_of(path):
            if name.startswith(f"{room}."):
                yield path.relative_to(folder), name.removeprefix(f"{room}.").split(".")[0], name


def assert_none(offenders):
    "All that break a law stand in one message"
    distinct = list(dict.fromkeys(offenders))
    assert not distinct, "\n".join(distinct)


def test_imports_point_downward():
    "Every module stands on a floor and imports only its own room and floors below"
    offenders = []
    for path in MODULES:
        room = room_of(path)
        for name in imports_of(path):
            parts = name.split(".")
            if parts[0] != "mlscorr" or len(parts) == 1 or parts[1] == room:
                continue
            if FLOOR[parts[1]] >= FLOOR[room]:
                offenders.append(f"{path}: {name}")
    assert_none(offenders)


def test_imports_within_the_gap_point_downward():
    "Residuals, signatures, evidence, closure and plan, document: each knows those before it"
    offenders = []
    for path, other, name in imports_within("mlscorr.gap"):
        room = path.parts[0].removesuffix(".py")
        if other not in GAP_FLOOR or other == room:
            continue
        if GAP_FLOOR[other] >= GAP_FLOOR.get(room, len(GAP_FLOORS)):
            offenders.append(f"{path}: {name}")
    assert_none(offenders)


def test_a_survey_knows_no_project():
    "Commands for one survey do without those for many"
    assert_none(
        f"{path}: {name}"
        for path, other, name in imports_within("mlscorr.pipeline")
        if other == "project" and path.parts[0] != "project"
    )


def test_imports_within_a_project_point_downward():
    "Tasks and engines, what touches files, what joins drives, the story: each knows those below"
    assert_none(
        f"{path}: {name}"
        for path, other, name in imports_within("mlscorr.pipeline.project")
        if path.stem != "__init__" and PROJECT_FLOOR[other] >= PROJECT_FLOOR[path.stem]
    )


IO_FLOORS = ("store", "tables", "trajectories", "clouds", "surveys")  # from the ground up


def test_imports_within_the_files_point_downward():
    "Bytes, tables, trajectories, clouds, surveys: each knows what comes before it alone"
    offenders = []
    for path, other, name in imports_within("mlscorr.io"):
        if other not in IO_FLOORS or len(path.parts) == 1:
            continue
        if IO_FLOORS.index(other) > IO_FLOORS.index(path.parts[0]):
            offenders.append(f"{path}: {name}")
    assert_none(offenders)


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


def imported_modules(path):
    "(module, name) of each `from mlscorr.module import name`"
    for node in statements(path):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("mlscorr."):
            yield from ((node.module, alias.name) for alias in node.names)


def test_no_import_reaches_past_a_face():
    "A module of another room is known by what the room's __init__ offers"
    offenders = []
    for path in MODULES:
        own = room_of_module(dotted(path).removesuffix(".__init__"))
        for module, name in imported_modules(path):
            room = room_of_module(module)
            is_inside = f"{own}.".startswith(f"{room}.")  # a room within another knows its parent
            if not is_inside and room not in (module, "mlscorr"):
                offenders.append(f"{path}: {module}.{name}")
    assert_none(offenders)


def test_tests_enter_other_rooms_by_their_faces():
    "No test outside tests/ROOM knows a private module of ROOM, or takes past its face what it has"
    offenders = []
    for path in sorted(TESTS.rglob("*.py")):
        own = path.relative_to(TESTS).parts[0]
        for module, name in imported_modules(path):
            room = room_of_module(module)
            if room == "mlscorr" or room.split(".")[1] == own:
                continue
            is_private = any(part.startswith("_") for part in (*module.split("."), name))
            is_past_face = module != room and hasattr(import_module(room), name)
            if is_private or is_past_face:
                offenders.append(f"{path.relative_to(TESTS)}: {module}.{name}")
    assert_none(offenders)


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


def test_rooms_of_the_simulator_know_those_below():
    "A scene knows no drive, and scanners no POS; other rooms enter by the door of each"
    offenders = []
    for path, other, _ in imports_within("mlscorr.simulate"):
        own = path.parts[0].removesuffix(".py")
        if own in ("__init__", other) or other not in SIMULATOR_FLOOR:
            continue
        if SIMULATOR_FLOOR[other] >= SIMULATOR_FLOOR[own]:
            offenders.append(f"{path}: {other}")
    assert_none(offenders)


def test_heavy_libraries_stay_in_their_rooms():
    "laspy and pye57 are known to io alone, open3d and sklearn to the rooms that ROOMS_OF names"
    offenders = []
    for path in MODULES:
        for name in imports_of(path):
            library = name.split(".")[0]
            if library in ROOMS_OF and room_of(path) not in ROOMS_OF[library]:
                offenders.append(f"{path}: {name}")
    assert_none(offenders)


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
        for node in statements(path):
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
