"""A survey folder in: survey.toml, control.csv, and what must fit together."""

import re
import shutil
import warnings
from dataclasses import replace

import laspy
import numpy as np
import pytest

from mlscorr.io.surveys import read_survey
from mlscorr.io.surveys.survey_file import read_survey_file
from mlscorr.io.tables import read_control
from mlscorr.survey import Pos, ProjectNames, Scanner
from tests.beds.shared import shared

TOML = """
name = "street"
crs = "EPSG:32650"

[cloud]
files = ["pass-*.las"]

[trajectory]
file = "trajectory.csv"

[control]
file = "control.csv"
"""
CONTROL = """name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role
T01,532012.4919,3373991.4813,44.4800,0.003,0.004,circle,0.6,control
T02,532030.0000,3373978.1746,44.5047,0.003,0.004,square,0.5,check
T03,532060.0000,3374008.1746,42.5047,0.002,0.005,circle,0.6,control
"""
WEEK = 604800.0 * 2300  # s


@pytest.fixture
def folder(tmp_path):
    "A survey of 40 s along a street at UTM coordinates, in GPS seconds of week"
    (tmp_path / "survey.toml").write_text(TOML)
    (tmp_path / "control.csv").write_text(CONTROL)
    gps_time = 413200 + 0.05 * np.arange(800)
    rows = [f"{t:.4f},{532000 + 5 * (t - 413200):.4f},3374000,42,0.1,-0.2,90.0" for t in gps_time]
    header = "gps_time,easting,northing,height,roll,pitch,heading\n"
    (tmp_path / "trajectory.csv").write_text(header + "\n".join(rows) + "\n")
    write_las(tmp_path / "pass-1.las", np.linspace(413202.0, 413215.0, 100))
    write_las(tmp_path / "pass-2.las", np.linspace(413220.0, 413235.0, 200) + WEEK - 1e9, True)
    return tmp_path


def write_las(path, gps_time, is_standard=False):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.001] * 3
    header.offsets = [532000.0, 3374000.0, 0.0]
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType(int(is_standard))
    las = laspy.LasData(header)
    las.x = 532000.0 + np.arange(len(gps_time))
    las.y = np.full(len(gps_time), 3374010.0)
    las.z = np.full(len(gps_time), 40.0)
    las.gps_time = gps_time
    las.write(path)


def toml(folder, old, new):
    "Change survey.toml"
    text = (folder / "survey.toml").read_text()
    assert old in text
    (folder / "survey.toml").write_text(text.replace(old, new))
    return folder


# ---- survey.toml


def test_a_time_constant_brings_a_trajectory_in_utc_to_gps_time(folder):
    "UTC is 18 s behind: 18 s more, and cloud and trajectory agree; without them they don't"
    right = read_survey(folder)
    path = folder / "trajectory.csv"
    header, *rows = path.read_text().splitlines()
    times = [f"{float(row[:11]) - 18.0:.4f}{row[11:]}" for row in rows]
    path.write_text("\n".join([header, *times]) + "\n")
    with pytest.raises(ValueError, match=r"UTC.*add 18 to trajectory.time_constant"):
        read_survey(folder)
    (folder / "survey.toml").write_text(TOML.replace('.csv"', '.csv"\ntime_constant = 18.0', 1))
    survey = read_survey(folder)
    np.testing.assert_allclose(survey.trajectory.gps_time, right.trajectory.gps_time, atol=1e-6)
    assert survey.clouds == right.clouds


def test_a_survey_is_read_with_its_defaults(folder):
    "Only what must be given is given: beliefs come from the nouns, the mounting stays open"
    survey = read_survey(folder)
    assert (survey.name, survey.crs, survey.path) == (
        "street",
        "EPSG:32650",
        folder / "survey.toml",
    )
    assert [cloud.path.name for cloud in survey.clouds] == ["pass-1.las", "pass-2.las"]
    assert [cloud.points for cloud in survey.clouds] == [100, 200]
    assert survey.control.name == ("T01", "T03")
    assert survey.check.name == ("T02",)
    assert survey.mounting is None
    assert survey.reference is None
    assert replace(survey.scanner, assumed=()) == Scanner()
    assert survey.pos.attitude_sigma == pytest.approx(Pos().attitude_sigma)
    assert len(survey.trajectory) == 800


def test_what_nobody_states_is_assumed(folder):
    "Without [pos] and [scanner] five defaults stand in; what is given there is none of them"
    survey = read_survey(folder)
    rows = (*survey.assumed_pos, *survey.assumed_scanner)
    assert {row.key: row.unit for row in rows} == {
        "pos.position_sigma": "m",
        "pos.attitude_sigma": "deg",
        "pos.correlation_time": "s",
        "scanner.range_noise": "m",
        "scanner.angle_noise": "deg",
    }
    values = {row.key: row.value for row in rows}
    assert values["pos.position_sigma"] == Pos.position_sigma
    assert values["scanner.angle_noise"] == pytest.approx(0.002)
    assert survey.has_assumed_position
    with (folder / "survey.toml").open("a") as file:
        file.write("[pos]\nposition_sigma = 0.02\n[scanner]\nrange_noise = 0.005\n")
    stated = read_survey(folder)
    keys = [row.key for row in (*stated.assumed_pos, *stated.assumed_scanner)]
    assert keys == ["pos.attitude_sigma", "pos.correlation_time", "scanner.angle_noise"]
    assert not stated.has_assumed_position
    epochs = np.ones((len(survey.trajectory), 3))
    columns = replace(survey.trajectory, position_sigma=0.03 * epochs, attitude_sigma=1e-4 * epochs)
    (left,) = replace(survey, trajectory=columns).assumed_pos
    assert left.key == "pos.correlation_time"


def test_each_cloud_has_its_own_time_constant(folder):
    "One file in week seconds, one in adjusted standard time: both reach the trajectory, and say so"
    survey = read_survey(folder / "survey.toml")
    assert [cloud.time_constant for cloud in survey.clouds] == [0.0, 1e9 - WEEK]
    assert [cloud.time_system for cloud in survey.clouds] == ["week", "standard"]
    assert "WGS 84 / UTM zone 50N" in survey.notes[0]
    assert "pass-2.las: adjusted standard GPS time" in survey.notes[2]


def test_only_a_planned_survey_may_have_no_cloud(folder):
    "Without [cloud] a survey is refused; planned, it is read"
    text = (folder / "survey.toml").read_text()
    start = text.index("[cloud]")
    end = text.index("[trajectory]")
    (folder / "survey.toml").write_text(text[:start] + text[end:])
    with pytest.raises(ValueError, match="cloud is missing"):
        read_survey(folder)
    assert read_survey(folder, planned=True).clouds == ()


def test_degrees_become_radians_and_the_mounting_a_rotation(folder):
    "R_L^P = Rz(c) Ry(b) Rx(a): with [90, 0, 0] the scanner's y axis points up"
    with (folder / "survey.toml").open("a") as file:
        file.write("[mounting]\nlever_arm = [0.1, -0.6, 0]\nboresight = [90.0, 0.0, 30.0]\n")
        file.write("[scanner]\nrange_noise = 0.004\nangle_noise = 0.002\nlines_per_second = 150\n")
        file.write("[pos]\nposition_sigma = 0.5\nattitude_sigma = [0.006, 0.006, 0.014]\n")
        file.write('[scene]\nreference = "trajectory.csv"\n')
    survey = read_survey(folder)
    assert survey.mounting.lever_arm == pytest.approx([0.1, -0.6, 0.0])
    turned = survey.mounting.boresight.apply([[0, 1, 0], [1, 0, 0]])
    assert turned == pytest.approx(np.array([[0, 0, 1], [np.cos(np.pi / 6), 0.5, 0]]), abs=1e-12)
    assert survey.scanner == Scanner(0.004, np.radians(0.002), 150)
    assert np.degrees(survey.pos.attitude_sigma) == pytest.approx([0.006, 0.006, 0.014])
    assert (survey.pos.position_sigma, survey.pos.correlation_time) == (0.5, 30.0)
    assert survey.reference == folder / "trajectory.csv"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "files =",
            "file =",
            r"cloud\.files is missing.*cloud\.file is an unknown key.* is cloud\.f",
        ),
        ("[trajectory]", "[trajectroy]", "trajectroy is an unknown key; .* is trajectory"),
        ('name = "street"', "lever_arm = [0.0, 0.0, 0.0]", r"lever_arm .* is mounting\.lever_arm"),
        ("[control]\nfile =", "[control]\npath =", r"control\.file is missing"),
        (
            'file = "trajectory.csv"',
            "file = 3",
            r"trajectory\.file = 3.*valid string",
        ),
        ('["pass-*.las"]', '"pass-1.las"', r"cloud\.files = 'pass-1.las' .*valid list"),
        ("[cloud]", 'cloud = "a.las"\n[other]', r"cloud = 'a.las' .* be a section, in brackets\."),
        ('["pass-*.las"]', "[]", r"cloud\.files = \[\] .*at least 1 item"),
        ("[cloud]", '[cloud]\ngps_time = "utc"', r"cloud\.gps_time = 'utc' .*'auto', 'week'"),
        ("[control]", "[mounting]\nlever_arm = [0.0, 1.0]\n[control]", r"mounting\.boresight is m"),
        (
            "[control]",
            "[pos]\nposition_sigma = -1\n[control]",
            r"pos\.position_sigma = -1 .*greater",
        ),
        ("[control]", '[pos]\nposition_sigma = "1"\n[control]', "valid number"),
        ("[control]", "[pos]\nattitude_sigma = [1.0, nan, 1.0]\n[control]", r"attitude_sigma\.1 ="),
        ("[control]", "[matching]\nradius = 3\n[control]", r"matching\.radius is an unknown key"),
        ("[control]", "[matching]\nsearch_radius = 0\n[control]", r"search_radius = 0 .*greater"),
        ("[control]", "[scanner]\nrange_noise = inf\n[control]", "finite number"),
        ('crs = "EPSG:32650"', "crs = 32650", "crs = 32650 .*string in quotation marks"),
        (
            "[control]",
            '[control]\ncrs = "EPSG:32650"',
            r"control\.crs .* crs belongs above the first",
        ),
        ("[control]", "[mounting]\nlever_arm = [100.5, 0.0, 0.0]\n[control]", "less than or equal"),
    ],
)
def test_wrong_keys_are_named(folder, old, new, message):
    "Unknown (then with the nearest known one), missing, of the wrong type or size: all named"
    with pytest.raises(ValueError, match=message):
        read_survey_file(toml(folder, old, new))


def test_ties_are_used_unless_survey_toml_says_off(folder):
    "[ties] use is auto or off, and nothing else"
    assert read_survey(folder).use_ties
    toml(folder, "[control]", '[ties]\nuse = "off"\n[control]')
    assert not read_survey(folder).use_ties
    toml(folder, '"off"', '"sometimes"')
    with pytest.raises(ValueError, match="use"):
        read_survey(folder)


def test_the_search_radius_is_ten_metres_or_what_survey_toml_says(folder):
    "3.5 m reach the Survey that matching and extraction take it from"
    assert read_survey(folder).search_radius == 10.0  # m
    toml(folder, "[control]", "[matching]\nsearch_radius = 3.5\n[control]")
    assert read_survey(folder).search_radius == 3.5


def test_all_wrong_keys_come_in_one_error(folder):
    "One error lists all three mistyped keys"
    toml(folder, "[cloud]", "nam = 1\n[cloud]\nfilez = 2\n[scaner]\nx = 1\n[scanner]")
    with pytest.raises(ValueError, match=r"cloud\.filez .*cloud\.files.*scaner .* is scanner") as e:
        read_survey_file(folder)
    assert str(e.value).count("unknown key") >= 3


def test_the_known_keys_beside_unknown_ones_come_once(folder):
    "Three keys that are like none are named, then what is known there; numbers are counted plainly"
    toml(folder, "[cloud]", "qq = 1\nzzz = 2\nxxx = 3\n[cloud]")
    toml(
        folder,
        "[control]",
        "[mounting]\nlever_arm = [1, 1, 1, 1]\nboresight = [1, 1, 1]\n[control]",
    )
    with pytest.raises(ValueError, match="should have at most 3 items, not 4") as error:
        read_survey_file(folder)
    assert str(error.value).count("unknown key") == 3
    assert str(error.value).count("known are name, crs") == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'name = "street\n', "not valid TOML: .*at line 1"),
        (b"crs = EPSG:32650\n", "at line 1, .*Put text and paths in quotation marks"),
        (TOML.replace("[cloud]", "[cloud").encode(), "not valid TOML: .*at line 5"),
        (b"name = 'a'\nname = 'b'\n", "not valid TOML"),
        (b"name = '\xff\xfe'\n", "file in UTF-8.*mlscorr init"),
        (b"", "cloud is missing. trajectory is missing"),
    ],
)
def test_bad_toml_is_located(folder, content, message):
    "Bad syntax, bad encoding, nothing: the line is named"
    (folder / "survey.toml").write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_survey(folder)


def test_a_byte_order_mark_is_no_syntax_error(folder):
    "Some editors put one in front"
    (folder / "survey.toml").write_bytes(b"\xef\xbb\xbf" + TOML.encode())
    assert read_survey_file(folder).name == "street"


def test_a_missing_survey_says_what_is_expected(tmp_path):
    "A folder without survey.toml, or a path that isn't there"
    for path in (tmp_path, tmp_path / "nowhere" / "survey.toml"):
        with pytest.raises(FileNotFoundError, match=r"does not exist.*survey is a folder with"):
            read_survey(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "trajectory.csv",
            "trajectori.csv",
            r"trajectory\.file of .*trajectori.csv, which does not exist; .* is trajectory.csv",
        ),
        ("control.csv", "points.csv", r"control\.file of .*points.csv, which does not exist"),
        ("pass-*.las", "drive-*.las", r"cloud\.files of .*no file matches .*drive-\*"),
        (
            "control.csv",
            "Control.csv ",
            "Control.csv , which .*; the nearest existing name is control.csv",
        ),
        ("pass-*.las", ".", r"cloud\.files of .*is a folder: .*clouds as a pattern"),
        ("pass-*.las", "pass-9.las", r"cloud\.files of .*pass-9.las, which does not exist"),
        ("[control]", '[scene]\nreference = "r.ply"\n[control]', r"scene\.reference of"),
        ('trajectory.csv"', 'trajectory.csv"\naccuracy = "s.out"', r"trajectory\.accuracy of"),
    ],
)
def test_missing_files_are_named_with_their_key(folder, old, new, message):
    "A name or a glob without a file: key and path are named"
    with pytest.raises(FileNotFoundError, match=message):
        read_survey(toml(folder, old, new))


def test_the_same_cloud_twice_is_refused(folder):
    "Listed by name and caught by the glob: it would be counted twice"
    toml(folder, '["pass-*.las"]', '["./pass-1.las", "pass-*.las"]')
    with pytest.raises(ValueError, match=r"lists the file .*pass-1\.las 2 times"):
        read_survey(folder)


def test_clouds_of_the_same_name_are_refused(folder):
    "Outputs keep their names, so two folders can't hold one each: both are named"
    (folder / "other").mkdir()
    write_las(folder / "other" / "pass-1.las", np.linspace(413202.0, 413214.0, 90))
    toml(folder, '["pass-*.las"]', '["**/pass-1.las"]')
    words = r"same name.*pass-1\.las.*/other/pass-1\.las,.*/pass-1\.las\. Rename"
    with pytest.raises(ValueError, match=words):
        read_survey(folder)


@pytest.mark.parametrize("mark", ["out/report.json", "project.json"])
def test_a_pattern_of_all_folders_takes_no_results_for_input(folder, mark):
    "Results of a run or project below the survey are excluded with a note; the input stays"
    (folder / "out").mkdir()
    shutil.copy(folder / "pass-1.las", folder / "out" / "pass-1.las")
    (folder / mark).write_text("{}")
    toml(folder, '["pass-*.las"]', '["**/*.las"]')
    with pytest.warns(UserWarning, match=r"excludes results of an earlier run in \S+/out\."):
        paths = read_survey(folder).cloud_paths
    assert [*paths] == [folder / "pass-1.las", folder / "pass-2.las"]


@pytest.mark.parametrize(
    ("crs", "message"),
    [
        ("EPSG:326500", "'EPSG:326500' is unknown"),
        ("EPSG:4326", "projected CRS is needed"),
        ("EPSG:2227", "not in meters"),
    ],
)
def test_a_crs_that_can_not_be_meant_is_refused(folder, crs, message):
    "Unknown, geographic, in feet"
    with pytest.raises(ValueError, match=message):
        read_survey(toml(folder, "EPSG:32650", crs))


def test_an_sbet_without_a_crs_is_refused(folder):
    "Latitude and longitude can't be brought anywhere"
    shutil.copy(shared("data", "leeward_sbet", "sbet.out"), folder / "sbet.out")
    toml(folder, 'crs = "EPSG:32650"\n', "")
    with pytest.raises(ValueError, match=r"set crs in survey\.toml"):
        read_survey(toml(folder, "trajectory.csv", "sbet.out"))


def test_clouds_outside_the_trajectory_are_refused(folder):
    "A cloud of the next day: the file and both spans are named"
    write_las(folder / "pass-3.las", np.linspace(499602.0, 499615.0, 100))
    with pytest.raises(ValueError, match=r"None of the sampled times of pass-3.las, \[499602.000"):
        read_survey(folder)


def test_the_asked_time_system_is_obeyed(folder):
    "Both files as week seconds: the one in standard time fits no more, and the key is named"
    toml(folder, "[cloud]", '[cloud]\ngps_time = "week"')
    with pytest.raises(ValueError, match=r'pass-2.las.*cloud.gps_time = "week"'):
        read_survey(folder)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", r"is empty \(0 bytes\): .* interrupted"),
        (b"LASF" + bytes(100), "truncated: it has 104 b"),
    ],
)
def test_a_broken_cloud_is_refused(folder, content, words):
    "Empty, or cut off within the header: its size is told beside that of a header"
    (folder / "pass-1.las").write_bytes(content)
    with pytest.raises(ValueError, match=rf"pass-1\.las .*{words}"):
        read_survey(folder)


# ---- control against trajectory


def exchange(folder, change):
    "Rewrite easting and northing of every control point"
    lines = [line.split(",") for line in CONTROL.strip().splitlines()]
    for cells in lines[1:]:
        cells[1:3] = change(float(cells[1]), float(cells[2]))
    text = "".join(",".join(map(str, cells)) + "\n" for cells in lines)
    (folder / "control.csv").write_text(text)
    return folder


def test_swapped_control_is_refused(folder):
    "Northing in the column of easting: 4000 km away, but 25 m when exchanged"
    with pytest.raises(ValueError, match=r"swapped in .*control.csv.* 40\d\d km .*Exchange"):
        read_survey(exchange(folder, lambda e, n: (n, e)))


def test_control_of_another_zone_is_refused(folder):
    "The same points in the next zone lie hundreds of km off: distance and cause are named"
    with pytest.raises(
        ValueError,
        match=r"is 57\d\.\d km from the trajectory .limit 5 km.*CRS "
        "or zones",
    ):
        read_survey(exchange(folder, lambda e, n: (e - 573_000.0, n + 12_000.0)))


def test_the_number_of_a_zone_in_front_of_eastings_is_named(folder):
    "50 532 010 for 532 010 m, as offices write it: 50 000 km off, and metres without the 50"
    with pytest.raises(ValueError, match=r"the zone number 50 .* distance is \d+ m: .* 50 000"):
        read_survey(exchange(folder, lambda e, n: (e + 50e6, n)))


@pytest.mark.parametrize(
    ("name", "heights"),
    [("trajectory.csv", ["42"]), ("control.csv", ["44.4800", "44.5047", "42.5047"])],
)
def test_heights_in_feet_are_named(name, heights, folder):
    "Metres on one side and feet on the other, though the plan agrees: whose heights they are"
    text = (folder / name).read_text()
    for height in heights:
        text = text.replace(f",{height},", f",{float(height) / 0.3048:.4f},")
    (folder / name).write_text(text)
    with pytest.warns(UserWarning, match=rf"heights of .*{name[:-4]}\S* may be in feet"):
        read_survey(folder)


def test_far_control_points_beside_near_ones_are_normal(folder):
    "One control file may serve a whole town: what is near counts"
    with (folder / "control.csv").open("a") as file:
        file.write("T99,552012.0,3373991.0,44.4,0.003,0.004,circle,0.6,control\n")
    assert len(read_survey(folder).control) == 3


def test_a_control_list_of_others_is_read_and_said(folder):
    "Semicolons, decimal commas, German names, X as northing: points, and a note on what they mean"
    rows = [line.split(",") for line in CONTROL.splitlines()[1:]]
    lines = [f"{name};{n};{e};{h}".replace(".", ",") for name, e, n, h, *_ in rows]
    (folder / "list.txt").write_text("\n".join(["Punkt;X;Y;Höhe", *lines, ""]), encoding="cp1252")
    given = 'file = "list.txt"\nkind = "circle"\nsize = 0.6\nsigma = [0.003, 0.004]'
    plain = read_survey(folder)
    survey = read_survey(toml(folder, 'file = "control.csv"', given + '\ncheck = ["T02"]'))
    assert np.array_equal(survey.control.position, plain.control.position)
    assert (survey.check.name, plain.layouts) == (("T02",), ())
    (layout,) = survey.layouts
    assert layout in survey.notes
    assert "northing = X, easting = Y, height = Höhe (semicolons, decimal comma" in layout


def test_heights_among_places_are_named(folder):
    "Columns in the order H, E, N under the names of E, N, H: which stands where is said"
    folder = exchange(folder, lambda e, n: (44.0, e))
    text = (folder / "control.csv").read_text()
    for height in ("44.4800", "44.5047", "42.5047"):
        text = text.replace(height, "3373991")
    (folder / "control.csv").write_text(text)
    match = "northing, northing.*height, height"
    with pytest.raises(ValueError, match=match):
        read_survey(folder)


# ---- control.csv


def declared(folder, text):
    return toml(folder, 'file = "control.csv"', f'file = "control.csv"\n{text}')


def test_control_is_scaled_about_its_own_middle(folder):
    "By 0.9996: control points keep their middle, check points follow, heights stay; and it is said"
    plain = read_survey(folder)
    survey = read_survey(declared(folder, "scale_factor = 0.9996"))
    middle = plain.control.position.mean(axis=0)
    for role in ("control", "check"):
        before, after = (getattr(each, role).position - middle for each in (plain, survey))
        assert after[:, :2] == pytest.approx(0.9996 * before[:, :2], abs=1e-6)
        assert after[:, 2] == pytest.approx(before[:, 2], abs=1e-9)
    (note,) = [note for note in survey.notes if "scale_factor" in note]
    assert "multiplied by 0.9996000 about E 532036.246, N 3373999.828 m" in note


def test_control_is_scaled_about_a_stated_origin(folder):
    "A point 1 km to the west stays: the first target moves 40 cm towards it"
    plain = read_survey(folder).control.position[0]
    origin = plain[:2] - [1000.0, 0.0]
    text = f"scale_factor = 0.9996\nscale_origin = {origin.tolist()}"
    scaled = read_survey(declared(folder, text)).control.position[0]
    assert scaled - plain == pytest.approx([-0.4, 0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("heights", ["", "+5773"])
def test_ground_distances_take_the_factor_of_the_map(folder, heights):
    """32 km beside the central meridian of UTM 0.9996 (1 + x^2 / 2 R^2) of the ground at sea level,
    and less by h / R at 42 m where the CRS has heights: to 1e-7
    """
    toml(folder, "EPSG:32650", f"EPSG:32650{heights}")
    plain = read_survey(folder).control.position
    scaled = read_survey(declared(folder, 'scale_factor = "ground"')).control.position
    radius = 6371000.0
    expected = 0.9996 * (1 + (32036.2 / 0.9996 / radius) ** 2 / 2)
    if heights:
        expected *= 1 - 43.5 / radius
    ratio = np.linalg.norm(np.diff(scaled[:, :2], axis=0)) / np.linalg.norm(
        np.diff(plain[:, :2], axis=0)
    )
    assert ratio == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    "text, message",
    [
        ("scale_factor = 0.3048", r"control\.scale_factor"),
        ('scale_factor = "grid"', r"control\.scale_factor"),
        ("scale_origin = [1.0, 2.0]", "scale_origin needs a scale_factor"),
        ("scale_factor = 0.9996\nscale_origin = [1.0]", r"control\.scale_origin"),
    ],
)
def test_scales_that_can_not_be_meant_are_refused(folder, text, message):
    "Feet, another word, an origin of nothing, half an origin"
    with pytest.raises(ValueError, match=message):
        read_survey(declared(folder, text))


def test_ground_distances_need_a_crs(folder):
    "Nothing else tells the scale of the map"
    toml(folder, 'crs = "EPSG:32650"', "")
    with pytest.raises(ValueError, match=r"has no crs.*it, or give scale_factor as a number"):
        read_survey(declared(folder, 'scale_factor = "ground"'))


def control(tmp_path, old="", new="", text=CONTROL):
    assert old in text
    (tmp_path / "control.csv").write_text(text.replace(old, new, 1) if old else text)
    return tmp_path / "control.csv"


def test_control_is_split_by_role(tmp_path):
    "Control and check points: names, positions, sigmas of E, N, H, kinds, sizes"
    points, check, _ = read_control(control(tmp_path))
    assert points.position[1] == pytest.approx([532060.0, 3374008.1746, 42.5047], abs=1e-9)
    assert points.sigma[1].tolist() == [0.002, 0.002, 0.005]
    assert (points.kind, check.kind) == (("circle", "circle"), ("square",))
    assert check.size.tolist() == [0.5]
    assert np.isnan(points.normal).all()
    assert len(points + check) == 3


def test_control_tolerates_how_tables_are_typed(tmp_path):
    "A byte order mark, blank lines, spaces, quotes, capitals and empty lines of commas are free"
    text = "\ufeff\n" + CONTROL.replace(",", " , ").replace("T01", '"T01, gate"').upper()
    (tmp_path / "control.csv").write_text(text + "\n\n,,,,,,,,\n", encoding="utf-8")
    points, check, _ = read_control(tmp_path / "control.csv")
    assert points.name == ("T01, GATE", "T03")
    assert check.kind == ("square",)


def test_control_may_be_of_one_role_only(tmp_path):
    "No check points: an empty ControlPoints, not None"
    points, check, _ = read_control(control(tmp_path, text=CONTROL.replace("check", "control")))
    assert (len(points), len(check)) == (3, 0)
    assert (points + check).position.shape == (3, 3)


def test_normals_are_optional_by_point(tmp_path):
    "Given normals come out with length one, others as NaN"
    lines = CONTROL.strip().splitlines()
    lines = [lines[0] + ",normal_e,normal_n,normal_h", lines[1] + ",3,0,4", lines[3] + ",,,"]
    points, _, _ = read_control(control(tmp_path, text="\n".join([*lines, ""])))
    assert points.normal[0] == pytest.approx([0.6, 0.0, 0.8])
    assert np.isnan(points.normal[1]).all()
    with pytest.raises(ValueError, match=r"T01 .* normal .*not all zero"):
        read_control(control(tmp_path, "3,0,4", "0,0,0", "\n".join([*lines, ""])))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sigma_vertical", "sigma_v", "no column sigma_vertical;.*'sigma_v'"),
        ("T02", "T01", "T01 more than once"),
        ("T02", "", "Line 3 .* has no name"),
        ("44.4800", "nan", "Line 2 .* height 'nan', which is not a finite number"),
        ("44.4800", "", "Line 2 .* height '', which is not a number"),
        ("44.4800", "4_4.48", "Line 2 .* height '4_4.48', which is not a number"),
        ("532012.4919", "117 20 11.1", "Line 2 .* '117 20 11.1', .* It looks like an angle: proj"),
        ("532012.4919", "117°20'11.1", "Line 2 .* It looks like an angle: project it"),
        ("44.4800", "44;48", "Line 2 .* height '44;48'"),
        ("circle", "ball", "T01 .* unknown kind 'ball'; known are circle .disc, .*, board"),
        (
            "check",
            "chek",
            "T02.*unknown role 'chek'; known are control",
        ),
        ("circle,0.6", "circle,600", "T01 .* size 600 m, .*millimeters"),
        ("circle,0.6", "circle,0", "T01 .* size 0 m.* positive"),
        ("0.003,0.004", "0,0.004", "T01 .* sigma_horizontal 0 m; it must be greater"),
        ("0.003,0.004", "0.003,-1", "T01 .* sigma_vertical -1 m"),
        ("44.4800", "44,4800", "Line 2.*has 10 columns where the header has 9"),
        (",circle,0.6,control", "", "Line 2.*has 6 columns where 9"),
        (CONTROL, "", "is empty"),
        (CONTROL, "\n \n", "is empty"),
        (CONTROL, CONTROL.splitlines()[0], "header but no points"),
        (CONTROL, CONTROL[: CONTROL.index("T03") + 20], "Line 4"),
    ],
)
def test_bad_control_is_refused(tmp_path, old, new, message):
    "Bad cells are named with line or point, value, and what is expected; lacking content too"
    with pytest.raises(ValueError, match=message):
        read_control(control(tmp_path, old, new))


def test_sigmas_in_millimetres_are_one_warning(tmp_path):
    "A list in another unit is named once, not twice a point, so that other warnings can be read"
    text = CONTROL.replace(",0.003,", ",3,").replace(",0.004,", ",4,")
    with pytest.warns(UserWarning) as warned:
        read_control(control(tmp_path, text=text))
    assert len(warned) == 1
    sentence = str(warned[0].message)
    assert re.search(r"T01 .* 3 m .*; 3 more sigmas are as large\.", sentence)


def test_a_place_under_two_names_is_warned_of(tmp_path):
    "Control points listed again as check points are reported: neither of the two counts"
    again = CONTROL.strip().splitlines()[1].replace("T01", "K01").replace("control", "check")
    with pytest.warns(
        UserWarning, match="two names for one position: T01 and K01. .* remove one of the two"
    ):
        read_control(control(tmp_path, text=CONTROL.strip() + f"\n{again}\n"))


def test_a_sigma_in_millimetres_is_warned_of(tmp_path):
    "A surveyed point with a sigma of 3 m corrects nothing: 3 mm is meant"
    with pytest.warns(UserWarning, match="T01.*sigma_horizontal 3 m"):
        read_control(control(tmp_path, "0.003,0.004", "3,0.004"))


# ---- surveys that lie beside the project


@pytest.mark.parametrize(
    ("name", "passes"),
    [
        ("wuhan_drive", 1),
        ("practice_none", 1),
        ("practice_time_offset", 1),
        ("practice_lever_arm", 2),
        ("practice_position_bump", 1),
    ],
)
def test_shared_surveys_are_read_without_a_warning(name, passes):
    "16 control and 8 check points, every cloud in the trajectory's own time, nothing to remark"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        survey = read_survey(shared("surveys", name))
    assert (len(survey.control), len(survey.check)) == (16, 8)
    assert [cloud.time_constant for cloud in survey.clouds] == [0.0] * passes
    assert len(survey.trajectory.gaps) == passes - 1
    assert survey.mounting.lever_arm == pytest.approx([0.1, -0.6, 0.4])


def test_an_sbet_survey_says_what_was_assumed(folder):
    "Datum, heights and heading of a geographic trajectory are written down"
    source = shared("data", "leeward_sbet")
    for name in ("sbet.out", "points.las"):
        shutil.copy(source / name, folder / name)
    toml(folder, "EPSG:32650", "EPSG:32611")
    toml(folder, "pass-*.las", "points.las")
    toml(folder, "trajectory.csv", "sbet.out")
    exchange(folder, lambda e, n: (e - 212_000, n + 807_000))
    with pytest.warns(UserWarning, match="points.las have a resolution of 0.01 m"):
        survey = read_survey(folder)
    assert "WGS 84, the datum of WGS 84 / UTM zone 11N" in survey.notes[1]
    assert "ellipsoidal heights were kept" in survey.notes[2]
    assert "meridian convergence" in survey.notes[3]


# ---- several scanners

MOUNTED = """
[[scanner]]
name = "left"
files = ["pass-1.*"]
range_noise = 0.01
[scanner.mounting]
lever_arm = [0.1, -0.6, 0.4]
boresight = [90.0, 0.0, 35.0]
lever_arm_sigma = [0.01, 0.02, 0.03]

[[scanner]]
files = ["./pass-2.las"]
"""


@pytest.fixture
def mounted(folder):
    "The survey with a scanner for each of its files"
    (folder / "survey.toml").write_text(TOML + MOUNTED)
    return folder


def test_each_of_several_scanners_has_its_files_and_mounting(mounted):
    "Patterns and names find files of [cloud]; one without a name has its number, and no mounting"
    survey = read_survey(mounted)
    left, other = survey.scanners
    assert (left.name, other.name, survey.mounting) == ("left", "2", None)
    assert [file.path.name for file in left.clouds] == ["pass-1.las"]
    assert [file.path.name for file in other.clouds] == ["pass-2.las"]
    assert left.mounting.lever_arm.tolist() == [0.1, -0.6, 0.4]
    assert (left.scanner.range_noise, other.mounting) == (0.01, None)
    assert replace(other.scanner, assumed=()) == Scanner()
    assert any("left wrote pass-1.las; 2 wrote pass-2.las" in note for note in survey.notes)


def test_one_in_the_list_is_one_scanner(mounted):
    "[[scanner]] once, for all files, is the same as [scanner] and [mounting]"
    text = MOUNTED[: MOUNTED.rindex("[[scanner]]")].replace("pass-1.*", "pass-*")
    (mounted / "survey.toml").write_text(TOML + text)
    survey = read_survey(mounted)
    assert survey.scanners == () and survey.scanner.range_noise == 0.01
    assert survey.mounting.lever_arm.tolist() == [0.1, -0.6, 0.4]


def test_a_measured_lever_arm_needs_no_boresight_sigma(mounted):
    "Sigmas of either are those of a measurement, and of both, which have a covariance as well"
    lever_arm = read_survey(mounted).scanners[0].mounting
    assert lever_arm.covariance is None
    assert lever_arm.measured[:3].tolist() == [0.01, 0.02, 0.03]
    assert np.isnan(lever_arm.measured[3:]).all()
    toml(mounted, "lever_arm_sigma = [0.01, 0.02, 0.03]", "boresight_sigma = [1.0, 1.0, 2.0]")
    assert np.degrees(read_survey(mounted).scanners[0].mounting.measured[5]) == pytest.approx(2.0)
    toml(mounted, "boresight_sigma", "lever_arm_sigma = [0.1, 0.1, 0.1]\nboresight_sigma")
    both = read_survey(mounted).scanners[0].mounting
    assert np.allclose(both.measured[:3], 0.1) and not np.isnan(both.measured).any()
    assert np.allclose(both.covariance, np.diag(both.measured**2))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("./pass-2.las", "pass-1.las", r"2 of the 2 .* one .*pass-1.las \(2, left\), .* none"),
        (
            '["./pass-2.las"]',
            '["trajectory.csv"]',
            "trajectory.csv of scanner 2 is not among the 2",
        ),
        ("./pass-2.las", "drive-*", r"scanner\.files of .*: no file matches .*drive-\*"),
        ('"left"', '"2"', r"unique names, and these are 2, 2 \(the"),
        ('files = ["./pass-2.las"]', "", r"scanner\.1: files is missing"),
        ('files = ["./pass-2.las"]', "point_source_ids = [2]", r"1 of the 2 .*1.las \(2, left"),
        ("range_noise", "range_nose", r"scanner\.0\.range_nose .* scanner\.range_noise"),
        (
            "[control]",
            "[mounting]\nlever_arm = [0, 0, 0]\nboresight = [0, 0, 0]\n[control]",
            r"\[mounting\] applies to a single scanner",
        ),
    ],
)
def test_scanners_that_do_not_part_the_files_are_refused(mounted, old, new, message):
    "Files of none or of two, patterns of none, doubled names, keys of one scanner: a sentence each"
    toml(mounted, old, new)
    with pytest.raises((ValueError, FileNotFoundError), match=message):
        read_survey(mounted)


def test_keys_of_one_of_several_do_not_stand_in_a_single_section(folder):
    "[scanner] with files is refused with advice to write [[scanner]]"
    (folder / "survey.toml").write_text(TOML + '[scanner]\nfiles = ["pass-1.las"]\n')
    with pytest.raises(
        ValueError, match=r"scanner.files .* write \[\[scanner\]\], not \[scanner\]"
    ):
        read_survey(folder)


def test_names_of_the_project_head_what_is_handed_over(folder):
    "All five are optional texts; a key that is none of them is refused with the nearest one"
    assert read_survey(folder).project == ProjectNames()
    section = '\n[project]\ntitle = " Ring road "\nclient = "City"\noperator = "J. Meyer"\n'
    (folder / "survey.toml").write_text(TOML + section)
    names = read_survey(folder).project
    assert names == ProjectNames(title="Ring road", client="City", operator="J. Meyer")
    assert names.known == {"Client": "City", "Operator": "J. Meyer"}
    (folder / "survey.toml").write_text(TOML + '\n[project]\nclent = "City"\n')
    with pytest.raises(ValueError, match="client"):
        read_survey(folder)
