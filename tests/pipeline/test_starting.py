"""A folder in, a survey.toml that runs out; or a sentence on what is ambiguous and what to add."""

import re
import shutil
import tomllib
import warnings
from dataclasses import replace

import laspy
import numpy as np
import pyproj
import pytest
import tomlkit
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.io.trajectories import read_trajectory
from mlscorr.pipeline.beams import line_rate
from mlscorr.pipeline.survey_text import SurveyText
from mlscorr.survey import PointCloud, Pos, Scanner
from tests.beds.las_crs import add_crs
from tests.beds.pof import pof_bytes, poq_bytes

START = 413_200.0
EAST = 532_000.0
NORTH = 3_374_000.0
WEEK = 604_800.0 * 2300
HEADER = "gps_time,easting,northing,height,roll,pitch,heading\n"
CONTROL = "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role\n"
POINTS = [("T01", 12.5, -8.5, 44.4), ("T02", 60.0, 8.2, 42.5), ("C01", 90.0, 8.1, 42.6)]


def trajectory(start=START, seconds=40.0, row="{:.3f},{:.4f},3374000,42,0.1,-0.2,90.0"):
    times = start + np.arange(0.0, seconds, 0.1)
    return "\n".join(row.format(t, EAST + 5 * (t - start)) for t in times) + "\n"


def control(form="{},{:.3f},{:.3f},{:.3f},0.003,0.004,circle,0.6,{}", swap=False):
    rows = [(name, EAST + e, NORTH + n, h) for name, e, n, h in POINTS]
    rows = [(name, n, e, h) if swap else (name, e, n, h) for name, e, n, h in rows]
    roles = ["check" if row[0][0] == "C" else "control" for row in rows]
    return "".join(form.format(*row, role) + "\n" for row, role in zip(rows, roles, strict=True))


def write_cloud(path, crs=None, start=START + 2.0, standard=False):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.001] * 3
    header.offsets = [EAST, NORTH, 0.0]
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType(int(standard))
    add_crs(header, crs)
    las = laspy.LasData(header)
    las.xyz = np.array([EAST, NORTH, 40.0]) + np.outer(np.arange(100), [1.0, 0.1, 0.0])
    las.gps_time = np.linspace(start, start + 15.0, 100) + (WEEK - 1e9) * standard
    las.write(path)


def write_sbet(path, start=START, east=EAST):
    "A drive of 40 s, projected back to latitudes and longitudes"
    times = start + np.arange(0.0, 40.0, 0.05)
    back = pyproj.Transformer.from_crs("EPSG:32650", "EPSG:4326", always_xy=True)
    longitude, latitude = back.transform(east + 5 * (times - start), np.full(len(times), NORTH))
    record = np.zeros((len(times), 17))
    record[:, 0] = times
    record[:, 3] = 42.0
    record[:, 1], record[:, 2] = np.radians(latitude), np.radians(longitude)
    record[:, 9] = np.radians(90.0)
    record.tofile(path)


def write_smrmsg(path):
    record = np.full((42, 10), 0.02)
    record[:, 0] = START - 1.0 + np.arange(42)
    record.tofile(path)


ROW = "{:.3f} {:.4f} 3374000 42 0.1 -0.2 90.0"
EXPLORER = """Program:     Inertial Explorer Version 8.90

GPSTime  Easting  Northing  H-Ell  Roll  Pitch  Heading
(sec) (m) (m) (m) (deg) (deg) (deg)
"""


@pytest.fixture
def folder(tmp_path):
    "Clouds of two passes in UTM zone 50, a trajectory, control"
    write_cloud(tmp_path / "pass-1.las", "EPSG:32650")
    write_cloud(tmp_path / "pass-2.las", "EPSG:32650", START + 20.0, standard=True)
    (tmp_path / "trajectory.csv").write_text(HEADER + trajectory())
    (tmp_path / "control.csv").write_text(CONTROL + control())
    return tmp_path


def read(folder):
    return tomllib.loads((folder / "survey.toml").read_text())


# ---- folders that say enough


def test_a_folder_of_our_own_files_becomes_a_survey(folder):
    "Clouds, CRS, trajectory and control are named with their reasons, and the survey can be read"
    started = mlscorr.init(folder)
    assert not (folder / "survey.toml").exists()
    assert started.write() == folder / "survey.toml"
    assert read(folder) == {
        "name": folder.name,
        "crs": "EPSG:32650",
        "cloud": {"files": ["pass-1.las", "pass-2.las"], "gps_time": "auto"},
        "trajectory": {"file": "trajectory.csv"},
        "control": {"file": "control.csv"},
    }
    survey = mlscorr.read_survey(folder)
    assert (survey.control.name, survey.check.name) == (("T01", "T02"), ("C01",))
    for words in (
        "by the VLRs of pass-1.las",
        "passes: 2",
        "adjusted standard GPS time",
        "3 circle",
    ):
        assert words in started.text
    assert "# lever_arm" in started.text and "# boresight" in started.text
    assert {role.path.name: role.role for role in started.roles} == {
        "pass-1.las": "cloud",
        "pass-2.las": "cloud",
        "trajectory.csv": "trajectory",
        "control.csv": "control",
    }


def test_an_sbet_gives_the_zone_where_no_cloud_states_a_crs(folder):
    "SBET and smrmsg under the suffix .out are told by their content; the UTM zone is the drive's"
    for name in ("pass-1.las", "pass-2.las"):
        (folder / name).unlink()
    write_cloud(folder / "pass-1.las")
    (folder / "trajectory.csv").unlink()
    write_sbet(folder / "export_Mission 1.out")
    write_smrmsg(folder / "smrmsg_Mission 1.out")
    text = mlscorr.init(folder).text
    document = tomllib.loads(text)
    assert document["crs"] == "EPSG:32650"
    assert document["trajectory"] == {
        "file": "export_Mission 1.out",
        "accuracy": "smrmsg_Mission 1.out",
    }
    assert "UTM zone of export_Mission 1.out" in text


def test_a_pof_with_its_poq_is_known_by_its_ending(folder):
    "RIEGL's trajectory and its sigmas are taken, its POFX beside it is said to have no layout"
    sigmas = read_trajectory(folder / "trajectory.csv")
    sigmas = replace(
        sigmas,
        position_sigma=np.full((len(sigmas), 3), 0.02),
        attitude_sigma=np.full((len(sigmas), 3), 1e-4),
    )
    (folder / "trajectory.csv").unlink()
    (folder / "LINE.POF").write_bytes(pof_bytes(sigmas, "EPSG:32650"))
    (folder / "LINE.POQ").write_bytes(poq_bytes(sigmas))
    (folder / "LINE.pofx").write_bytes(bytes(100))
    started = mlscorr.init(folder)
    assert tomllib.loads(started.text)["trajectory"] == {"file": "LINE.POF", "accuracy": "LINE.POQ"}
    reason = next(role.reason for role in started.roles if role.path.name == "LINE.pofx")
    assert "not public. Export it as POF" in reason
    assert any("RIEGL's POF 1.1" in note for note in started.notes)


def test_lists_of_a_total_station_are_control(folder):
    "A list by German names, of which the sizes stand in survey.toml, beside a README"
    (folder / "control.csv").unlink()
    rows = control("{};{:.3f};{:.3f};{:.3f}").replace(".", ",")
    (folder / "Festpunkte.txt").write_text("Punkt;Rechtswert;Hochwert;Höhe\n" + rows)
    (folder / "README.txt").write_text("Scanned on Monday, with Peter, in the rain.\n")
    given = {"control": {"kind": "circle", "size": 0.6, "sigma": [0.003, 0.004], "check": ["C*"]}}
    started = mlscorr.init(folder, given=given)
    assert tomllib.loads(started.text)["control"] == {"file": "Festpunkte.txt", **given["control"]}
    assert [r.role for r in started.roles if r.path.name == "README.txt"] == ["none"]


def test_an_export_of_inertial_explorer_needs_its_north(folder):
    "Said by --set it is a trajectory, by the clouds' CRS; without any CRS it is none by guess"
    (folder / "trajectory.csv").unlink()
    (folder / "ie.txt").write_text(EXPLORER + trajectory(row=ROW))
    (folder / "control.csv").unlink()
    (folder / "点.csv").write_bytes(
        ("点号,东坐标(m),北坐标(m),高程(m)\n" + control("{},{:.3f},{:.3f},{:.3f}")).encode(
            "gb18030"
        )
    )
    given = {
        "trajectory": {"heading": "clockwise from true north"},
        "control": {"kind": "circle", "size": 0.6, "sigma": [0.003, 0.004]},
    }
    document = tomllib.loads(mlscorr.init(folder, given=given).text)
    assert document["trajectory"] == {"file": "ie.txt", **given["trajectory"]}
    assert document["control"]["file"] == "点.csv"
    (folder / "pass-2.las").unlink()
    write_cloud(folder / "pass-1.las")
    started = mlscorr.init(folder, given=given)
    assert [place.key for place in started.places] == ["crs"] and 'crs = "?"' in started.text
    assert "EPSG:32650" in mlscorr.init(folder, given={**given, "crs": "EPSG:32650"}).text


def test_clouds_in_a_folder_of_their_own_are_a_pattern(folder):
    "Six tiles are one pattern; results of an earlier run are no input; a mesh is the reference"
    (folder / "las").mkdir()
    for name in ("pass-1.las", "pass-2.las"):
        (folder / name).unlink()
    for i in range(6):
        write_cloud(folder / "las" / f"tile {i}.las", "EPSG:32650", START + 2.0 + i)
    (folder / "corrected").mkdir()
    write_cloud(folder / "corrected" / "tile 0.las")
    (folder / "corrected" / "report.json").write_text("{}")
    (folder / "street.ply").write_text("ply\nelement face 2\nend_header\n")
    started = mlscorr.init(folder)
    document = tomllib.loads(started.text)
    assert document["cloud"]["files"] == ["las/*.las"]
    assert document["scene"] == {"reference": "street.ply"}
    assert "Files overlap in time" in started.text
    assert "passes: 1" in started.text  # the tiles go on in time


def test_simulated_surveys_and_results_are_left_out_and_called_what_they_are(folder):
    "Each within a folder is said to be one or the other; alone, it is the folder to be given"
    (folder / "replica").mkdir()
    shutil.copy(folder / "control.csv", folder / "replica")
    (folder / "replica" / "truth.json").write_text("{}")
    (folder / "corrected").mkdir()
    (folder / "corrected" / "report.json").write_text("{}")
    reasons = {role.path.name: role.reason for role in mlscorr.init(folder).roles}
    assert reasons["replica"] == "a simulated survey of its own"
    assert reasons["corrected"] == "results of a run"
    for path in folder.glob("*.las"):
        path.unlink()
    with pytest.raises(ValueError, match=r"replica is a simulated survey.*: give that folder\."):
        mlscorr.init(folder)


def test_a_trajectory_of_another_day_is_not_taken(folder):
    "Of two trajectories that which covers the clouds is; the other is said not to"
    (folder / "yesterday.csv").write_text(HEADER + trajectory(START - 86_400.0))
    started = mlscorr.init(folder)
    assert tomllib.loads(started.text)["trajectory"]["file"] == "trajectory.csv"
    reason = next(r.reason for r in started.roles if r.path.name == "yesterday.csv")
    assert reason.startswith("None of the sampled times")


def test_control_of_another_town_is_not_taken(folder):
    "Of two lists that near the trajectory is"
    (folder / "other.csv").write_text(CONTROL + control().replace(",53", ",93"))
    started = mlscorr.init(folder)
    assert tomllib.loads(started.text)["control"]["file"] == "control.csv"
    assert any("km from the trajectory" in role.reason for role in started.roles)


def test_a_folder_without_control_has_none(folder):
    "Ties need none: the section stays a comment"
    (folder / "control.csv").unlink()
    text = mlscorr.init(folder).text
    assert "control" not in tomllib.loads(text)
    assert "# [control]" in text


def test_marks_of_an_open_workbook_are_left_alone(folder):
    "Excel puts a file of 165 bytes beside a workbook that is open: it is no workbook itself"
    (folder / "~$control.xlsx").write_bytes(bytes(165))
    assert tomllib.loads(mlscorr.init(folder).text)["control"]["file"] == "control.csv"


def test_a_copy_of_a_cloud_is_left_out_and_refused(folder):
    "A second file of the same points is no second pass: init leaves it out, check names both"
    (folder / "copy.las").write_bytes((folder / "pass-1.las").read_bytes())
    started = mlscorr.init(folder)
    reasons = {role.path.name: role.reason for role in started.roles if role.role == "none"}
    assert reasons == {"pass-1.las": "a copy of copy.las, which would count twice"}
    assert tomllib.loads(started.text)["cloud"]["files"] == ["copy.las", "pass-2.las"]
    path = started.write()
    path.write_text(started.text.replace('"copy.las"', '"*.las"').replace(', "pass-2.las"', ""))
    (fault,) = mlscorr.check(path).faults
    assert re.search(r"pass-1.las, a copy of .*copy.las\. Remove it", fault.sentence)


def test_a_las_beside_its_laz_is_one_pass(folder):
    "init takes one of the two and says why; check and correct refuse both and say what to remove"
    laspy.read(folder / "pass-1.las").write(folder / "pass-1.laz")
    started = mlscorr.init(folder)
    assert tomllib.loads(started.text)["cloud"]["files"] == ["pass-1.las", "pass-2.las"]
    reasons = {role.path.name: role.reason for role in started.roles if role.role == "none"}
    assert reasons == {"pass-1.laz": "a copy of pass-1.las, which would count twice"}
    path = started.write()
    path.write_text(started.text.replace('"pass-1.las"', '"pass-1.las", "pass-1.laz"'))
    for command in (["check", str(path)], ["correct", str(path), "-o", str(folder / "out")]):
        result = CliRunner().invoke(app, command)
        assert result.exit_code == 2, result.stderr
        assert re.search("pass-1.laz, a copy of .*pass-1.las. Remove it", result.stderr)


# ---- folders that do not


def photos(folder):
    (folder / "control.csv").unlink()
    (folder / "photos.csv").write_text("image,taken\na.jpg,12:00\nb.jpg,12:01\n")


def dates(folder):
    rows = trajectory(row="2023-05-01 10:00:{:09.3f},{:.4f},3374000,42,0.1,-0.2,90.0")
    (folder / "trajectory.csv").write_text(HEADER + rows)


def other_zone(folder):
    (folder / "trajectory.csv").unlink()
    write_sbet(folder / "a.sbet", east=EAST + 2e6)


def far(folder):
    "Clouds that state no CRS, in feet"
    (folder / "pass-2.las").unlink()
    write_cloud(folder / "pass-1.las")
    data = bytearray((folder / "pass-1.las").read_bytes())
    numbers = np.frombuffer(data, "<f8", 12, 131)  # scale, offset and box
    data[131:227] = (numbers / 0.3048).tobytes()
    (folder / "pass-1.las").write_bytes(data)


def write(name, text):
    return lambda folder: (folder / name).write_text(text)


def remove(name):
    return lambda folder: (folder / name).unlink()


def cut_sbet(folder):
    "With half a record at its end, and no other trajectory"
    (folder / "trajectory.csv").unlink()
    write_sbet(folder / "drive.out")
    (folder / "drive.out").write_bytes((folder / "drive.out").read_bytes()[:-68])


AMBIGUOUS = {
    "a cut SBET": (
        cut_sbet,
        ["^((?!No file looks).)*drive.out has .* 68 more than 799 whole SBET"],
    ),
    "a trajectory without a header": (
        write("trajectory.csv", trajectory()),
        [
            "No trajectory .*trajectory.csv .rows of numbers without column names",
            "columns.gps_time = ",
        ],
    ),
    "a trajectory by other names": (
        write(
            "trajectory.csv",
            HEADER.replace("roll,pitch,heading", "wx,wy,wz").replace("gps_time", "tick")
            + trajectory(),
        ),
        [
            "No trajectory was recognized",
            "trajectory.csv .its columns are tick",
            "trajectory.columns",
        ],
    ),
    "no trajectory": (
        remove("trajectory.csv"),
        ["No trajectory was recognized", "gps_time"],
    ),
    "trajectory of another day": (
        write("trajectory.csv", HEADER + trajectory(START + 86_400.0)),
        ["None of the sampled times of pass-1.las"],
    ),
    "dates for seconds": (dates, ["trajectory.csv", "2023-05-01", "where a number is expected"]),
    "SBET of another zone": (other_zone, ["VLRs of pass-1.las", "disagree|another CRS"]),
    "no control but a table": (
        photos,
        ["photos.csv is neither", "image, taken", "easting, northing, height"],
    ),
    "axes exchanged": (
        write("control.csv", CONTROL + control(swap=True)),
        ["Easting and northing seem to be swapped"],
    ),
    "clouds in feet": (far, ["km from the trajectory.* near it .* as feet", "map coordinates"]),
    "X and Y far away": (
        write("control.csv", "Pt,X,Y,Z\nP1,10.0,20.0,3.0\nP2,15.0,25.0,3.0\n"),
        ["neither order is", "Also needed: .*kind", "--set 'control.size = 0.6'"],
    ),
    "seconds of the day": (
        write("trajectory.csv", HEADER + trajectory(START % 86_400.0)),
        ["^((?!--set).)*seconds of the day, you can add 345600 .*instead. Nothing was written.$"],
    ),
    "a workbook of another office program": (
        lambda folder: (folder / "control.csv").rename(folder / "control.ods"),
        ["control.ods is neither .*readable once saved as .xlsx"],
    ),
    "clouds of two zones": (
        lambda folder: write_cloud(folder / "pass-3.las", "EPSG:32649"),
        ["VLRs of pass-3.las", "EPSG:32649", "km apart"],
    ),
    "a cut cloud": (
        lambda folder: (folder / "pass-2.las").write_bytes(
            (folder / "pass-2.las").read_bytes()[:-500]
        ),
        ["pass-2.las", "truncated"],
    ),
    "no cloud": (
        lambda folder: [(folder / f"pass-{i}.las").unlink() for i in (1, 2)],
        ["has no LAS, LAZ, E57 or PLY cloud"],
    ),
    "survey.toml is there": (write("survey.toml", "# mine"), ["already exists"]),
}


@pytest.mark.parametrize(("spoil", "words"), AMBIGUOUS.values(), ids=AMBIGUOUS)
def test_what_is_ambiguous_is_named_and_nothing_written(spoil, words, folder):
    "Exit code 2, one sentence with what to add, and the folder as it was"
    spoil(folder)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    result = CliRunner().invoke(app, ["init", str(folder)])
    assert result.exit_code == 2, result.stderr
    last = result.stderr.splitlines()[-1]
    assert last.startswith("Error: ") and "Traceback" not in result.stderr
    for pattern in words:
        assert re.search(pattern, last), last
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


ALL_POINTS = ["control.sigma", "control.kind", "control.size"]
LIST = control("{},{:.3f},{:.3f},{:.3f}")
ASKED = {  # what is written, words of the question, and the keys that are open
    "two trajectories": (
        write("smoothed.csv", HEADER + trajectory()),
        ["2 files may be the trajectory", "smoothed.csv"],
        ["trajectory.file"],
    ),
    "two lists": (
        write("check.csv", CONTROL + control()),
        ["2 files may be the control", "check.csv", "Combine those that belong together"],
        ["control.file"],
    ),
    "headings from some north": (
        write("trajectory.csv", EXPLORER + trajectory(row=ROW)),
        ["Inertial Explorer", "clockwise from true north"],
        ["trajectory.heading"],
    ),
    "sizes unknown": (
        write("control.csv", "Pt,E,N,H\n" + LIST),
        ["no column .*kind, size"],
        ALL_POINTS,
    ),
    "angles in radians": (
        write("trajectory.csv", HEADER + trajectory(row="{:.3f},{:.4f},3374000,42,0,0,1.5708")),
        ["seem to be in radians"],
        ["trajectory.angles"],
    ),
    "a time by another name": (
        write("trajectory.csv", HEADER.replace("gps_time", "gps_timestamp") + trajectory()),
        ["'gps_timestamp' may be the gps_time", 'column of the gps_time: "gps_timestamp"'],
        ["trajectory.columns.gps_time"],
    ),
    "a yaw": (
        write("trajectory.csv", HEADER.replace("heading", "yaw") + trajectory()),
        ["counterclockwise from east"],
        ["trajectory.heading"],
    ),
    "sigmas unknown": (
        write("control.csv", "Pt,E,N,H,kind,size\nT01,532012.5,3373991.5,44,circle,0.6\n"),
        [r"0\.003, 0\.004"],
        ["control.sigma"],
    ),
    "two heights": (
        write(
            "control.csv",
            CONTROL.replace("height", "Elevation,H-Ell")
            + control("{},{:.3f},{:.3f},{:.3f},50.0,0.003,0.004,circle,0.6,{}"),
        ),
        ["2 columns that may be the height", "Elevation"],
        ["control.columns.height"],
    ),
    "role, sigma, kind, size and heading": (
        lambda folder: (
            write("trajectory.csv", HEADER.replace("heading", "yaw") + trajectory())(folder),
            write("control.csv", "Pt,E,N,H,use\n" + control("{},{:.3f},{:.3f},{:.3f},{}"))(folder),
        ),
        ["seems to be the role", "no column", "counterclockwise"],
        [*ALL_POINTS, "control.columns.role", "trajectory.heading"],
    ),
    "words of an office": (
        write(
            "control.csv",
            CONTROL.replace(",size", "")
            + control("{},{:.3f},{:.3f},{:.3f},0.003,0.004,*,{}")
            .replace("*", "Tafel 0,6 m", 1)
            .replace("*", "Scheibe, 0.6")
            .replace("Tafel 0,6 m", '"Tafel 0,6 m"')
            .replace("Scheibe, 0.6", '"Scheibe, 0.6"'),
        ),
        ["no column size", '"circle 0.6"'],
        ['control.words."Scheibe, 0.6"', 'control.words."Tafel 0,6 m"'],
    ),
}


@pytest.mark.parametrize(("spoil", "words", "keys"), ASKED.values(), ids=ASKED)
def test_all_questions_are_asked_at_once(spoil, words, keys, folder):
    """Exit code 4 and a survey.toml with their places open, which no command takes by mistake;
    an example in each place makes it one that can be read
    """
    spoil(folder)
    result = CliRunner().invoke(app, ["init", str(folder)])
    assert result.exit_code == 4, result.stderr
    for pattern in words:
        assert re.search(pattern, result.stderr), result.stderr
    started = [line for line in result.stderr.splitlines() if line.startswith("Open: ")]
    assert sorted(line.split()[1] for line in started) == sorted(k.split()[0] for k in keys)
    survey = folder / "survey.toml"
    for command in (["check", str(survey)], ["correct", str(survey), "-o", str(folder / "out")]):
        refused = CliRunner().invoke(app, command)
        assert refused.exit_code == 2, refused.stderr
        (error,) = [line for line in refused.stderr.splitlines() if line.startswith("Error: ")]
        assert f"has {len(keys)} open place" in error and all(key in error for key in keys), error
    assert not (folder / "out").exists()
    survey.unlink()
    started = mlscorr.init(folder)
    document = tomllib.loads(started.text)
    for place in started.places:
        *sections, key = place.keys
        table = document
        for section in sections:
            table = table[section]
        assert table[key] == "?"
        table[key] = place.examples[0]
    survey.write_text(tomlkit.dumps(document))
    with warnings.catch_warnings(action="ignore"):  # a heading that is no heading is doubted
        assert len(mlscorr.read_survey(survey).surveyed)


def test_an_office_says_once_what_its_words_mean(folder):
    "Words with their kinds and sizes under [control] words: circles of 0.6 m, a plate of 0.5 m"
    header = "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,role\n"
    rows = control("{},{:.3f},{:.3f},{:.3f},0.003,0.004,*,{}").replace("*", '"Tafel 0,5"', 1)
    (folder / "control.csv").write_text(header + rows.replace("*", '"scheibe  0,6"'))
    words = {"Scheibe 0,6": "circle 0.6", "Tafel 0,5": "square 0.5"}
    path = mlscorr.init(folder, given={"control": {"words": words}}).write()
    assert tomllib.loads(path.read_text())["control"]["words"] == words
    points = mlscorr.read_survey(path).surveyed
    assert list(zip(points.kind, points.size, strict=True)) == [
        ("square", 0.5),
        ("circle", 0.6),
        ("circle", 0.6),
    ]


def cut(folder, overlap=0.0, other=""):
    "The trajectory in two files, of the times about each cloud"
    (folder / "trajectory.csv").unlink()
    for number, (start, seconds) in enumerate([(0.0, 18.0 + overlap), (18.0, 22.0)], start=1):
        text = HEADER + trajectory(START + start, seconds)
        (folder / f"run-{number}.csv").write_text(text.replace("roll", "rol") if other else text)


def test_trajectories_that_follow_each_other_are_a_list(folder):
    "One file of each run: [[trajectory]] with both, what is given said of each; a third is not"
    cut(folder)
    (folder / "yesterday.csv").write_text(HEADER + trajectory(START - 86_400.0))
    given = {"trajectory": {"roll": "right side down"}}
    started = mlscorr.init(folder, given=given)
    started.write()
    runs = [{"file": f"run-{n}.csv", **given["trajectory"]} for n in (1, 2)]
    assert read(folder)["trajectory"] == runs
    assert len(mlscorr.read_survey(folder).trajectory.passes) == 2
    roles = {role.path.name: role.role for role in started.roles}
    assert roles["run-1.csv"] == roles["run-2.csv"] == "trajectory"
    assert roles["yesterday.csv"] == "none"
    assert "# [trajectory]" not in started.text and "180 epochs, 18 s" in started.text


def test_ids_that_take_turns_are_named(folder):
    "Two scanners in one file write in turns, strips do not: init says what [[scanner]] is for"
    strips = laspy.read(folder / "pass-1.las")
    turns = laspy.read(folder / "pass-2.las")
    strips.point_source_id = np.repeat([1, 2, 3, 4], 25)
    turns.point_source_id = np.arange(100) % 3 // 2
    strips.write(folder / "pass-1.las")
    turns.write(folder / "pass-2.las")
    text = mlscorr.init(folder).text
    assert "(point_source_id) alternate in pass-2.las." in text and "[[scanner]]" in text


def test_trajectories_that_overlap_stay_ambiguous(folder):
    "Neither covers both clouds, and for 5 s there are two: both are named"
    cut(folder, overlap=5.0)
    with pytest.raises(ValueError, match=r"run-1\.csv.* run-2\.csv overlap by 4.9 s"):
        mlscorr.init(folder)


def test_sbets_that_follow_each_other_have_their_own_accuracy(folder):
    "Two SBETs without a CRS of any cloud: the UTM zone of the drive, and smrmsg beside its own"
    (folder / "trajectory.csv").unlink()
    for number, start in ((1, START), (2, START + 41.0)):
        write_cloud(folder / f"pass-{number}.las", start=start + 2.0)
        write_sbet(folder / f"run-{number}.out", start)
        accuracy = np.full((45, 10), 0.02)
        accuracy[:, 0] = start - 2.0 + np.arange(45.0)
        accuracy.tofile(folder / f"smrmsg-{number}.out")
    mlscorr.init(folder).write()
    document = read(folder)
    assert document["crs"] == "EPSG:32650"
    assert document["trajectory"] == [
        {"file": f"run-{n}.out", "accuracy": f"smrmsg-{n}.out"} for n in (1, 2)
    ]
    assert mlscorr.read_survey(folder).trajectory.position_sigma is not None


def test_what_is_said_decides(folder):
    "--set names one of two trajectories, and values that no file holds; text needs no quotes"
    (folder / "smoothed.csv").write_text(HEADER + trajectory())
    (folder / "control.csv").write_text("Pt,E,N,H\n" + control("{},{:.3f},{:.3f},{:.3f}"))
    sets = (
        "trajectory.file = smoothed.csv",
        "control.kind=square",
        "control.size = 0.4",
        "control.sigma = [0.01, 0.01]",
        "pos.position_sigma = 0.1",
    )
    arguments = [argument for line in sets for argument in ("--set", line)]
    out = folder / "other.toml"
    result = CliRunner().invoke(app, ["init", str(folder), "-o", str(out), *arguments])
    assert result.exit_code == 0, result.stderr
    assert result.stderr.splitlines()[-1].startswith(f"Written: {out}")
    survey = mlscorr.read_survey(out)
    assert survey.control.kind == ("square",) * 3
    assert survey.pos.position_sigma == 0.1
    assert tomllib.loads(out.read_text())["trajectory"]["file"] == "smoothed.csv"


@pytest.mark.parametrize(
    ("line", "words"),
    [("control.sizes = 0.6", "nearest known one is control.size"), ("= 3", "needs a key")],
)
def test_what_no_survey_can_say_is_refused(line, words, folder):
    "An unknown key is named with the nearest one"
    result = CliRunner().invoke(app, ["init", str(folder), "--set", line])
    assert result.exit_code == 2 and words in result.stderr


def test_names_of_files_are_quoted():
    "Quotation marks, blanks and breaks in values and reasons leave the text whole"
    text = SurveyText({})
    text.put("", "name", 'a "b"\nc', "of\nd")
    text.put("control", "file", "für Müller.csv", "")
    document = tomllib.loads(str(text))
    assert document == {"name": 'a "b"\nc', "control": {"file": "für Müller.csv"}}


# ---- lines a second


def test_the_rate_of_lines_is_seen_in_directions_over_time(folder):
    "A beam that turns 90 times a second, half of it met: the rate to 0.1; a swinging one: none"
    drive = mlscorr.init(folder)
    drive.write()
    survey = mlscorr.read_survey(folder)
    time = START + 10.0 + np.arange(0.0, 0.5, 1e-5)
    pose = survey.trajectory.at(time)

    def cloud(angle):
        beam = 10.0 * np.column_stack([np.cos(angle), np.zeros(len(time)), np.sin(angle)])
        xyz = pose.position + pose.attitude.apply(beam)
        return PointCloud(xyz, time, np.zeros(len(time)))

    turning = 2 * np.pi * 90.0 * (time - START)
    low = cloud(turning)[np.sin(turning) < 0]
    assert line_rate(low, survey.trajectory) == pytest.approx(90.0, abs=0.1)
    swinging = cloud(-np.pi / 2 + 0.5 * np.sin(turning))
    assert line_rate(swinging, survey.trajectory) is None
    assert line_rate(low[:50], survey.trajectory) is None


def test_a_folder_that_is_not_there_is_a_failure_to_write(folder):
    "Exit code 5 and a sentence that names it"
    out = folder / "no" / "such" / "survey.toml"
    result = CliRunner().invoke(app, ["init", str(folder), "-o", str(out)])
    assert result.exit_code == 5 and not out.parent.exists()
    assert f"{out.parent} is not a folder, so survey.toml can't be written there." in " ".join(
        result.output.split()
    ).replace("- ", "-")


def test_folders_that_link_into_themselves_are_read_once(tmp_path):
    "init and read_survey of a folder with links to itself find its one cloud once"
    data = tmp_path / "data"
    data.mkdir()
    write_cloud(data / "pass.laz")
    (data / "drive.csv").write_text(HEADER + trajectory())
    (data / "control.csv").write_text(CONTROL + control())
    for name in ("again", "once-more"):
        (data / name).symlink_to(".")
        (tmp_path / name).symlink_to("data")
    text = mlscorr.init(tmp_path, given={"crs": "EPSG:32650"}).text
    assert tomllib.loads(text)["cloud"]["files"] == ["data/pass.laz"]
    survey = tmp_path / "survey.toml"
    survey.write_text(text.replace('"data/pass.laz"', '"**/*.laz"'))
    clouds = mlscorr.read_survey(survey).clouds
    assert [file.path for file in clouds] == [data / "pass.laz"]


def test_init_and_check_state_the_same_duration_and_passes(folder):
    "A trajectory of 40 s and, 60 s later, of 30 s is one of 70 s without gaps, with 2 passes"
    rows = trajectory(seconds=40.05) + trajectory(START + 100.0, 30.05)
    (folder / "trajectory.csv").write_text(HEADER + rows)
    write_cloud(folder / "pass-1.las", "EPSG:32650", START + 2.0)
    write_cloud(folder / "pass-1b.las", "EPSG:32650", START + 17.0)
    write_cloud(folder / "pass-2.las", "EPSG:32650", START + 102.0)
    started = mlscorr.init(folder)
    assert "70 s without gaps" in started.text
    assert "passes: 2" in started.text
    started.write()
    amounts = {amount.what: amount for amount in mlscorr.check(folder).read}
    assert amounts["trajectory"].number == pytest.approx(70.0, abs=0.2)  # s
    assert amounts["passes"].number == 2


def test_accuracies_behind_a_hash_are_those_that_are_assumed():
    "Uncommented as they stand, noises and sigmas are the defaults within 1 %"
    lines = [line.removeprefix("# ") for line in str(SurveyText({})).splitlines()]
    stated = tomllib.loads("\n".join(line for line in lines if re.match(r"\w+ = |\[", line)))
    scanner, pos = Scanner(), Pos()
    assert stated["scanner"] == {
        "range_noise": pytest.approx(scanner.range_noise, rel=0.01),
        "angle_noise": pytest.approx(np.degrees(scanner.angle_noise), rel=0.01),
        "lines_per_second": scanner.lines_per_second,
    }
    assert stated["pos"] == {
        "position_sigma": pytest.approx(pos.position_sigma, rel=0.01),
        "attitude_sigma": pytest.approx(np.degrees(pos.attitude_sigma), rel=0.01),
        "correlation_time": pos.correlation_time,
    }
