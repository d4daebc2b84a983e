"""Folders as vendors, offices and students would have them, made of one small survey.

``python -m tests.beds.folders_of_others`` takes each through init, check and correct.
"""

import re
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import laspy
import numpy as np
import pyproj
from openpyxl import Workbook

import mlscorr
from mlscorr.frames import angles_from_attitude
from mlscorr.io.trajectories import export_trajectory, read_trajectory, write_trajectory_csv
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import Trajectory
from tests.beds.checked import verdicts
from tests.beds.foreign_clouds import points_of, write_e57, write_ply
from tests.beds.las_crs import add_crs
from tests.beds.pof import geographic, pof_bytes, poq_bytes

CRS = "EPSG:32650"
SIZE = {"control.kind": "circle", "control.size": 0.6, "control.sigma": [0.003, 0.004]}
CHECK = {"control.check": ["C*"]}
TRUE = {"trajectory.heading": "clockwise from true north"}
OUR_NAMES = "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role"


@dataclass(frozen=True)
class Bed:
    "The survey that all folders are made of: a LAS for each of two passes, trajectory, points"

    clouds: list[Path]
    trajectory: Trajectory
    points: list[tuple[str, float, float, float, str]]  # name, E, N, H, role

    @property
    def table(self):
        "Time, E, N, H, roll, pitch, heading (s, m, deg)"
        angles = np.degrees(np.column_stack(angles_from_attitude(self.trajectory.attitude)))
        return np.column_stack([self.trajectory.gps_time, self.trajectory.position, angles])

    @property
    def all_points(self):
        "Fields of the points of both passes, in order of time"
        parts = [points_of(path) for path in self.clouds]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@cache
def bed():
    "Simulated once: two passes of 8 s there and back, four control points and a check point"
    place = Path(tempfile.mkdtemp(prefix="folders-of-others-"))
    scenario = Scenario(
        drive={
            "duration": 8.0,
            "speed": 4.5,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 4, "check": 1, "hidden": 0.0, "kinds": ["circle"]},
        scanner=[{"lines_per_second": 40, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(5)).write(place)
    rows = [line.split(",") for line in (place / "control.csv").read_text().splitlines()[1:]]
    points = [
        ("CP"[row[-1] == "control"] + row[0][1:], *map(float, row[1:4]), row[-1]) for row in rows
    ]
    for path in place.glob("*.laz"):  # in which init finds times quickly
        laspy.read(path).write(path.with_suffix(".las"))
    return Bed(sorted(place.glob("*.las")), read_trajectory(place / "trajectory.csv"), points)


@dataclass(frozen=True)
class OthersFolder:
    """Folder as others make it, with its true properties.

    ``sentence``: what init says, None where it needs nothing; ``given`` and ``mend``: what that
    sentence asks for; ``clouds``: names of what is corrected; ``control`` points that are used;
    ``fault``: what check finds and correct refuses alike, None where both pass.
    """

    name: str
    make: Callable[[Path, Bed], object]
    sentence: str | None = None
    given: dict = field(default_factory=dict)
    mend: Callable[[Path, Bed], object] | None = None
    clouds: tuple[str, ...] = ("pass-1.las", "pass-2.las")
    control: int = 4
    check: int = 1
    fault: str | None = None


# ---- parts of folders


def las(folder, bed):
    for path in bed.clouds:
        shutil.copy(path, folder)


def rewritten(path, source, version="1.4", form=6, crs=None, rows=slice(None), seconds=None):
    "Rows of a cloud in another version and format, its times in standard time by added seconds"
    old = laspy.read(source)
    header = laspy.LasHeader(point_format=form, version=version)
    header.scales = old.header.scales
    header.offsets = old.header.offsets
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType(int(seconds is not None))
    add_crs(header, crs)
    las = laspy.LasData(header)
    las.xyz = np.asarray(old.xyz)[rows]
    las.gps_time = np.asarray(old.gps_time)[rows] + (seconds or 0.0)
    las.intensity = np.asarray(old.intensity)[rows]
    las.write(path)


def trajectory_csv(folder, bed, name="trajectory.csv"):
    write_trajectory_csv(folder / name, bed.trajectory)


def table(path, header, rows, form, separator=",", decimal=".", encoding="utf-8"):
    "A table of rows by a format for each cell"
    lines = [separator.join(header)] if header else []
    for row in rows:
        cells = [one.format(cell) for one, cell in zip(form, row, strict=True)]
        numbers = [cell.replace(".", decimal) if decimal != "." else cell for cell in cells]
        lines.append(separator.join(numbers))
    path.write_bytes(("\n".join(lines) + "\n").encode(encoding))


def control_csv(folder, bed, name="control.csv", points=None):
    rows = [(*point[:4], 0.003, 0.004, "circle", 0.6, point[4]) for point in points or bed.points]
    form = ["{}", "{:.4f}", "{:.4f}", "{:.4f}", "{}", "{}", "{}", "{}", "{}"]
    table(folder / name, OUR_NAMES.split(","), rows, form)


def places(path, header, bed, order=(0, 1, 2, 3), **layout):
    "A list of names and places"
    rows = [[point[k] for k in order] for point in bed.points]
    table(path, header, rows, ["{}" if k == 0 else "{:.4f}" for k in order], **layout)


def poses(path, header, bed, **layout):
    "A table of a trajectory"
    table(path, header, bed.table, ["{:.6f}", *["{:.5f}"] * 3, *["{:.7f}"] * 3], **layout)


def others(*parts):
    def make(folder, bed):
        for part in parts:
            part(folder, bed)

    return make


OURS = (las, trajectory_csv, control_csv)


# ---- folders


def sbet(folder, bed):
    for path in bed.clouds:
        rewritten(folder / path.name, path)
    export_trajectory(folder / "sbet_Mission 1.out", bed.trajectory, CRS)


def pof(folder, bed):
    (folder / "line.pof").write_bytes(pof_bytes(bed.trajectory, CRS))
    (folder / "line.poq").write_bytes(poq_bytes(bed.trajectory))


def pofx(folder, bed):
    (folder / "line.pofx").write_bytes(bytes(range(256)) * 100)


def inertial_explorer(folder, bed):
    rows = bed.table
    rows[:, 6] = geographic(bed.trajectory, CRS)[:, 5]
    lines = ["Project:     street", "Program:     Inertial Explorer Version 8.90", ""]
    lines += [
        "GPSTime  Easting  Northing  H-Ell  Roll  Pitch  Heading",
        "(sec)  (m)  (m)  (m)  (deg)  (deg)  (deg)",
    ]
    lines += ["  ".join(f"{value:.7f}" for value in row) for row in rows]
    (folder / "export.txt").write_text("\n".join([*lines, ""]))


def terrascan(folder, bed):
    kind = np.dtype([("values", "<f8", 7), ("quality", "u1", 4), ("rest", "<i2", 2)])
    records = np.zeros(len(bed.table), kind)
    records["values"] = bed.table[:, [0, 1, 2, 3, 6, 4, 5]]
    head = b"TSCANTRJ" + np.array([20010715, 1376, len(records), 64], "<i4").tobytes()
    (folder / "line 1.trj").write_bytes(head.ljust(1376, b"\0") + records.tobytes())


def tum(folder, bed):
    export_trajectory(folder / "poses.tum", bed.trajectory, CRS)
    shutil.move(folder / "poses.tum", folder / "poses.txt")


def german(folder, bed):
    names = ["GPS-Zeit", "Rechtswert", "Hochwert", "Höhe", "Roll", "Nick", "Kurs"]
    poses(folder / "Trajektorie.txt", names, bed, separator=";", decimal=",", encoding="cp1252")
    names = ["Punkt-Nr.", "Rechtswert", "Hochwert", "Höhe"]
    places(folder / "Passpunkte.csv", names, bed, separator=";", decimal=",", encoding="cp1252")


def office(folder, bed):
    "Kinds with their sizes, and roles, in words of an office"
    rows = [
        (*point[:4], "Scheibe 0,6", "Kontrolle" if point[4] == "check" else "Pass")
        for point in bed.points
    ]
    names = ["Punkt", "Rechtswert", "Hochwert", "Höhe", "Bemerkung", "Rolle"]
    form = ["{}", *["{:.4f}"] * 3, "{}", "{}"]
    table(folder / "Passpunkte.csv", names, rows, form, ";", ",", "cp1252")


def french(folder, bed):
    names = ["Temps", "E", "N", "Altitude", "Roulis", "Tangage", "Cap"]
    poses(folder / "trajectoire.csv", names, bed, separator=";", decimal=",")
    names = ["Matricule", "Est", "Nord", "Altitude"]
    places(folder / "points de contrôle.csv", names, bed, separator=";", decimal=",")


def spanish(folder, bed):
    names = ["Tiempo", "Este", "Norte", "Altura", "Alabeo", "Cabeceo", "Rumbo"]
    poses(folder / "trayectoria.csv", names, bed, separator=";")
    names = ["Punto", "Este", "Norte", "Cota"]
    places(folder / "puntos.csv", names, bed, separator=";")


def chinese(folder, bed):
    names = ["GPS时间", "东坐标", "北坐标", "高程", "横滚角", "俯仰角", "航向角"]
    poses(folder / "轨迹.csv", names, bed, encoding="gb18030")
    places(
        folder / "控制点.csv",
        ["点号", "东坐标(m)", "北坐标(m)", "高程(m)"],
        bed,
        encoding="gb18030",
    )


def total_station(folder, bed):
    places(folder / "points.txt", [], bed, separator=" ")


def workbook(folder, bed):
    book = Workbook()
    book.active.append(["Point", "Easting", "Northing", "Elevation", "Role"])
    for point in bed.points:
        book.active.append(point)
    book.save(folder / "control.xlsx")


def las_1_2(folder, bed):
    for path in bed.clouds:
        rewritten(folder / path.name, path, "1.2", 1)


def with_wkt(folder, bed):
    for path in bed.clouds:
        rewritten(folder / f"{path.stem}.laz", path, crs=CRS)


def standard_time(folder, bed):
    for path in bed.clouds:
        rewritten(folder / path.name, path, seconds=604_800.0 * 2300 - 1e9)


def tiles(folder, bed):
    "By place, so that each holds both passes"
    east = bed.all_points["x"]
    edges = np.quantile(east, np.linspace(0, 1, 7))[1:-1]
    (folder / "tiles").mkdir()
    for k in range(6):
        parts = [laspy.read(path) for path in bed.clouds]
        header = parts[0].header
        las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
        las.header.scales = header.scales
        las.header.offsets = header.offsets
        chosen = [np.searchsorted(edges, part.x) == k for part in parts]
        for name in ("xyz", "gps_time", "intensity"):
            values = [getattr(part, name)[c] for part, c in zip(parts, chosen, strict=True)]
            setattr(las, name, np.concatenate(values))
        las.write(folder / "tiles" / f"tile_{k}.las")


def two_runs(folder, bed):
    first = bed.trajectory.gps_time < bed.trajectory.gps_time.mean()
    for name, rows in (("run 1.csv", first), ("run 2.csv", ~first)):
        whole = bed.trajectory
        sigmas = whole.position_sigma[rows], whole.attitude_sigma[rows]
        part = Trajectory(whole.gps_time[rows], whole.position[rows], whole.attitude[rows], *sigmas)
        write_trajectory_csv(folder / name, part)


def two_scanners(folder, bed):
    "Every second point of each"
    for k, side in enumerate(("left", "right")):
        for number, path in enumerate(bed.clouds, 1):
            rewritten(folder / f"{side} {number}.las", path, rows=slice(k, None, 2))


def e57(folder, bed):
    fields = bed.all_points
    names = {"x": "cartesianX", "y": "cartesianY", "z": "cartesianZ", "gps_time": "timeStamp"}
    columns = {names.get(name, name): values for name, values in fields.items()}
    write_e57(folder / "scan.e57", [{"fields": columns | {"intensity": fields["intensity"]}}])


def ply(folder, bed):
    fields = bed.all_points
    names = {"gps_time": "scalar_GpsTime", "intensity": "scalar_Intensity"}
    write_ply(folder / "scan.ply", {names.get(name, name): v for name, v in fields.items()})


def timeless(folder, bed):
    "As most programs export an E57"
    fields = bed.all_points
    places = {f"cartesian{axis.upper()}": fields[axis] for axis in "xyz"}
    write_e57(folder / "scan.e57", [{"fields": places | {"intensity": fields["intensity"]}}])


def apart(folder, bed):
    control_csv(folder, bed, "control.csv", [p for p in bed.points if p[4] == "control"])
    control_csv(folder, bed, "check.csv", [p for p in bed.points if p[4] == "check"])


def together(folder, bed):
    (folder / "check.csv").unlink()
    control_csv(folder, bed)


def clutter(folder, bed):
    "Pictures and their places, a report, a shortcut, a file of a GIS, an archive, notes"
    (folder / "Photos").mkdir()
    (folder / "Photos" / "0001.jpg").write_bytes(b"\xff\xd8\xff\xe0" + bytes(1000))
    (folder / "0002.JPG").write_bytes(b"\xff\xd8\xff\xe0" + bytes(1000))
    (folder / "Bericht.pdf").write_bytes(b"%PDF-1.7\n" + bytes(500))
    (folder / "Thumbs.db").write_bytes(bytes(2000))
    (folder / ".DS_Store").write_bytes(bytes(100))
    (folder / "area.prj").write_text(pyproj.CRS(CRS).to_wkt())
    (folder / "raw.zip").write_bytes(b"PK\x03\x04" + bytes(100))
    (folder / "read me.txt").write_text("Scanned on Monday, from 10 to 12, with Peter.\n")
    (folder / "lastlog.log").write_text("10:00:01 started\n10:00:02 stopped\n")


def photographs(folder, bed):
    "A list of pictures with their places and angles, as cameras beside scanners have it"
    rows = [(f"{k:04}.jpg", *row) for k, row in enumerate(bed.table[::100])]
    names = ["file", "gps_time", "easting", "northing", "height", "omega", "phi", "kappa"]
    table(folder / "images.csv", names, rows, ["{}", *["{:.4f}"] * 7])


def nested(folder, bed):
    "Folders two deep, as delivered"
    for name, part in (
        ("01_Scans/LAS", las),
        ("02_POS/export", trajectory_csv),
        ("03_Control", control_csv),
    ):
        (folder / name).mkdir(parents=True)
        part(folder / name, bed)


def smoothed(folder, bed):
    trajectory_csv(folder, bed, "smoothed.csv")


def no_control(folder, bed):
    (folder / "weather.csv").write_text("station,temperature,pressure\nA,12.1,1013\nB,12.4,1012\n")


def exchanged(folder, bed):
    control_csv(
        folder, bed, points=[(n, north, east, *rest) for n, east, north, *rest in bed.points]
    )


def no_heights(folder, bed):
    places(folder / "points.csv", ["Point", "Easting", "Northing"], bed, (0, 1, 2))


def dated(folder, bed):
    rows = bed.table
    names = ["Time", "Easting", "Northing", "Height", "Roll", "Pitch", "Heading"]
    times = [f"2026-05-07 03:{int(t // 60) % 60:02}:{t % 60:09.6f}" for t in rows[:, 0]]
    rows = [(time, *row[1:]) for time, row in zip(times, rows, strict=True)]
    table(folder / "trajectory.csv", names, rows, ["{}", *["{:.5f}"] * 3, *["{:.7f}"] * 3])


def in_feet(folder, bed):
    rows = [(n, *(v / 0.3048 for v in place), role) for n, *place, role in bed.points]
    control_csv(folder, bed, points=rows)


def uppercase(folder, bed):
    for part in OURS:
        part(folder, bed)
    for path in list(folder.iterdir()):
        path.rename(folder / path.name.upper())


def surveyed_twice(folder, bed):
    "By two epochs of GNSS, as P1 and P1.1"
    again = [(f"{name}.1", *rest) for name, *rest in bed.points]
    control_csv(folder, bed, points=[*bed.points, *again])


def in_two_encodings(folder, bed):
    "LAS beside LAZ"
    las(folder, bed)
    for path in bed.clouds:
        laspy.read(path).write(folder / f"{path.stem}.laz")


def remove(name):
    return lambda folder, _: (folder / name).unlink()


LAZ_OF_SCAN = ("scan.laz",)
NAMED = "no column .*kind, size"
FOLDERS = (
    OthersFolder("our own layout", others(*OURS)),
    OthersFolder("SBET, smrmsg, LAZ, CSV", others(sbet, control_csv)),
    OthersFolder("POF and POQ of RIEGL", others(las, pof, control_csv)),
    OthersFolder(
        "text of Inertial Explorer",
        others(las, inertial_explorer, control_csv),
        'Inertial Explorer.* heading = "clockwise from true north"',
        {**TRUE, "crs": CRS},
    ),
    OthersFolder("TRJ of TerraScan", others(las, terrascan, control_csv)),
    OthersFolder("TUM", others(las, tum, control_csv)),
    *(
        OthersFolder(name, others(las, *parts), NAMED, SIZE | CHECK)
        for name, parts in (
            ("total station: P1 E N H", (trajectory_csv, total_station)),
            ("German, decimal commas", (german,)),
            ("French", (french,)),
            ("Spanish", (spanish,)),
            ("Chinese", (chinese,)),
        )
    ),
    OthersFolder(
        "words of an office",
        others(las, trajectory_csv, office),
        "Bemerkung holds Scheibe 0,6: .*control.words.Kontrolle = ",
        {
            "control.columns.kind": "Bemerkung",
            "control.sigma": [0.003, 0.004],
            "control.words": {"Scheibe 0,6": "circle 0.6", "Pass": "control", "Kontrolle": "check"},
        },
    ),
    OthersFolder("workbook", others(las, trajectory_csv, workbook), NAMED, SIZE),
    OthersFolder(
        "LAS 1.2 without a CRS",
        others(las_1_2, trajectory_csv, control_csv),
    ),
    OthersFolder(
        "LAZ with WKT",
        others(with_wkt, trajectory_csv, control_csv),
        clouds=("pass-1.laz", "pass-2.laz"),
    ),
    OthersFolder("standard time against week", others(standard_time, trajectory_csv, control_csv)),
    OthersFolder(
        "tiles by place",
        others(tiles, trajectory_csv, control_csv),
        clouds=tuple(f"tile_{k}.las" for k in range(6)),
    ),
    OthersFolder(
        "two runs, two trajectories",
        others(las, two_runs, control_csv),
    ),
    OthersFolder(
        "two scanners' files",
        others(two_scanners, trajectory_csv, control_csv),
        clouds=tuple(f"{side} {k}.las" for side in ("left", "right") for k in (1, 2)),
        control=3,  # half of the points show one target too thinly
    ),
    OthersFolder("E57", others(e57, trajectory_csv, control_csv), clouds=LAZ_OF_SCAN),
    OthersFolder(
        "PLY of CloudCompare", others(ply, trajectory_csv, control_csv), clouds=LAZ_OF_SCAN
    ),
    OthersFolder(
        "E57 without times",
        others(timeless, trajectory_csv, control_csv),
        "have no times in scan 1 of 1.* export it with the field timeStamp, or as LAS",
        mend=others(remove("scan.e57"), las),
    ),
    OthersFolder(
        "POFX of RIEGL",
        others(las, pofx, control_csv),
        "POFX of RIEGL, whose layout is not public: export it as POF, SBET or text",
        mend=pof,
    ),
    OthersFolder(
        "check points in a file of their own",
        others(las, trajectory_csv, apart),
        "2 files may be the control .*check.csv.* Combine those that belong together",
        mend=together,
    ),
    OthersFolder("pictures, PDF and clutter", others(*OURS, clutter, photographs)),
    OthersFolder("folders in folders", nested),
    OthersFolder(
        "two plausible trajectories",
        others(*OURS, smoothed),
        "2 files may be the trajectory.*smoothed.csv.*--set 'trajectory.file",
        {"trajectory.file": "smoothed.csv"},
    ),
    OthersFolder(
        "a table that is no control",
        others(las, trajectory_csv, no_control),
        "weather.csv is neither .*: its columns are station, temperature, pressure. Name its",
        mend=others(remove("weather.csv"), control_csv),
    ),
    OthersFolder(
        "easting and northing exchanged",
        others(las, trajectory_csv, exchanged),
        "Easting and northing seem to be swapped",
        mend=control_csv,
    ),
    OthersFolder(
        "no heights",
        others(las, trajectory_csv, no_heights),
        "no column height",
        SIZE | CHECK,
        mend=lambda folder, bed: places(
            folder / "points.csv", ["Point", "Easting", "Northing", "Height"], bed
        ),
    ),
    OthersFolder(
        "dates in place of seconds",
        others(las, dated, control_csv),
        "'2026-05-07 .*where a number is expected.* a date or time of day: give seconds",
        mend=trajectory_csv,
    ),
    OthersFolder("control in feet", others(las, trajectory_csv, in_feet), "feet", mend=control_csv),
    OthersFolder(
        "each point surveyed twice",
        others(las, trajectory_csv, surveyed_twice),
        fault="each point is listed twice",
    ),
    OthersFolder("LAS beside LAZ", others(in_two_encodings, trajectory_csv, control_csv)),
    OthersFolder("uppercase endings", uppercase, clouds=("PASS-1.LAS", "PASS-2.LAS")),
)


def nested_tables(given):
    "Tables of dotted keys"
    document = {}
    for key, value in given.items():
        *sections, name = key.split(".")
        table = document
        for section in sections:
            table = table.setdefault(section, {})
        table[name] = value
    return document


def asked(folder):
    "Questions of init and the options that answer them, or what it refuses a folder by"
    try:
        begun = mlscorr.init(folder)
    except ValueError as error:
        return str(error)
    return " ".join([*begun.questions, *(place.option for place in begun.places)])


def started(case, folder):
    """Path of the survey.toml that init makes of a folder, after what its sentence asks for.

    Raises AssertionError where it says another sentence, or none.
    """
    folder.mkdir(parents=True)
    case.make(folder, bed())
    with warnings.catch_warnings(action="ignore"):
        if case.sentence is not None:
            said = asked(folder)
            assert re.search(case.sentence, said), said or "init says nothing"
        if case.mend is not None:
            case.mend(folder, bed())
        return mlscorr.init(folder, given=nested_tables(case.given)).write()


def check_result(case, survey, out):
    "Check that correct gives the expected result; ties take too long here"
    with warnings.catch_warnings(action="ignore"):
        report = mlscorr.correct(mlscorr.read_survey(survey), ties="off").write(out, page=False)
    names = sorted(file["name"] for file in report["files"])
    assert names == sorted(case.clouds), names
    assert all((out / name).exists() for name in names)
    seen = report["control"]["n_seen"], report["check"]["n_seen"]
    assert seen == (case.control, case.check), seen


def check_verdicts(case, survey, out):
    "Check that check passes what correct corrects, and finds the fault that correct refuses"
    if case.fault is None:
        with warnings.catch_warnings(action="ignore"):
            checked = mlscorr.check(survey)
        assert checked.is_searched and not checked.faults, checked
        check_result(case, survey, out)
        return
    said = verdicts(survey)
    assert len(said.faults) == 1 and re.search(case.fault, said.faults[0]), said
    assert said.refusal == said.faults[0], said


def outcome(case, place):
    "Outcome of a folder: a result, a sentence and then a result, or the fault"
    try:
        survey = started(case, place / case.name)
        check_verdicts(case, survey, place / f"{case.name} out")
    except (AssertionError, ValueError, OSError) as error:
        return f"{type(error).__name__}: {error}"
    if case.fault is not None:
        return "fault of both"
    if case.sentence is None:
        return "result"
    return "sentence, result"


if __name__ == "__main__":
    names = sys.argv[1:]
    chosen = [case for case in FOLDERS if not names or any(name in case.name for name in names)]
    outcomes = []
    with tempfile.TemporaryDirectory() as place:
        for case in chosen:
            outcomes.append(outcome(case, Path(place)))
            print(f"{case.name:40} {outcomes[-1]}", flush=True)
    right = sum(outcome in ("result", "sentence, result", "fault of both") for outcome in outcomes)
    print(f"{right} of {len(outcomes)} give a result, or the right sentence and then a result")
