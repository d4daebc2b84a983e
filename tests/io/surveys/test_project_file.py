"""project.toml: what is wrong in it or between its drives is said in a sentence."""

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.io.surveys import is_project, read_project

TRAJECTORY = "gps_time,easting,northing,height,roll,pitch,heading\n" + "".join(
    f"{357700 + 0.1 * k:.1f},{532000 + k},3374000,42,0,0,90\n" for k in range(50)
)
DRIVE = (
    '[[drive]]\nname = "{0}"\nfiles = ["{0}/*.laz"]\n\n[drive.trajectory]\nfile = "{0}/way.csv"\n'
)
IDS = DRIVE.replace('"{0}/*.laz"', '"a/*.laz"').replace('"]\n\n', '"]\npoint_source_ids = {1}\n\n')
SCANNER = """
[[drive.scanner]]
point_source_ids = [1]

[[drive.scanner]]
point_source_ids = [2]
"""
SURVEY = '{}[cloud]\nfiles = ["*.laz"]\n\n[trajectory]\nfile = "way.csv"\n'


@pytest.fixture
def city(tmp_path):
    "A folder of two drives whose clouds nobody opens"
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "way.csv").write_text(TRAJECTORY)
        (tmp_path / name / f"tile-{name}.laz").write_bytes(b"")
    return tmp_path


def write_cloud(path, points):
    "A cloud of some points, all in one place"
    cloud = laspy.create(point_format=1, file_version="1.2")
    cloud.x = cloud.gps_time = np.zeros(points)
    cloud.write(path)


def write(folder, *parts):
    "project.toml of some parts"
    path = folder / "project.toml"
    path.write_text("\n".join(parts))
    return path


def test_drives_are_read_by_their_files(city):
    "Names, files and trajectories of both, relative to project.toml"
    project = read_project(write(city, DRIVE.format("a"), DRIVE.format("b")))
    assert [drive.name for drive in project.drives] == ["a", "b"]
    assert [drive.parts.files.clouds[0].name for drive in project.drives] == [
        "tile-a.laz",
        "tile-b.laz",
    ]
    assert is_project(city) and is_project(city / "project.toml")
    assert not is_project(city / "survey.toml")


def test_the_crs_of_a_project_is_that_of_a_drive_without(city):
    "A survey.toml that says none is of the project's; its latitudes are projected into that"
    lines = [line.split(",") for line in TRAJECTORY.splitlines()[1:]]
    rows = [
        ",".join((t, f"30.4900{t[-3]}{t[-1]}", "117.3334", *row[1:-1], "0")) for t, _, *row in lines
    ]
    way = "Time,Latitude,Longitude,Height,Roll,Pitch,Heading\n" + "\n".join([*rows, ""])
    (city / "a" / "way.csv").write_text(way)
    (city / "a" / "survey.toml").write_text(SURVEY.format(""))
    drive = '[[drive]]\nsurvey = "a"\n'
    project = read_project(write(city, 'crs = "EPSG:32650"', drive, DRIVE.format("b")))
    assert project.drives[0].parts.settings.crs == "EPSG:32650"
    assert abs(project.drives[0].trajectory.position[0, 0] - 532_000.0) < 100.0


def test_a_project_may_have_any_name(city):
    "A TOML file with drives is one; a survey under another name, a cloud and nothing are none"
    project = write(city, DRIVE.format("a"), DRIVE.format("b"))
    project.rename(city / "old-town.toml")
    (city / "street.toml").write_text('name = "street"\n')
    names = ("old-town.toml", "street.toml", "tile-a.laz", "nothing.toml")
    assert [is_project(city / name) for name in names] == [True, False, False, False]


WRONG = [
    ([DRIVE.format("a"), DRIVE.format("a")], r": 1 names are repeated \(first: a\)"),
    ([DRIVE.format("a"), DRIVE.format("b").replace("b/*", "a/*")], "belong to two drives"),
    ([DRIVE.format("a").replace('name = "a"', 'name = "tiles"')], "can't be a folder"),
    ([IDS.format("a", "[1, 2]"), IDS.format("b", "[2]")], "point_source_id 2 of"),
    ([IDS.format("a", "[1]") + SCANNER, IDS.format("b", "[2]")], "one id can't do both"),
    (['[cloud]\nfiles = ["*/*.laz"]\n', DRIVE.format("a")], "belong to no drive"),
    ([DRIVE.format("a").replace("a/*.laz", "s4://bucket/a.laz")], "unknown scheme s4://"),
    (['[[drive]]\nname = "a"\n'], "a drive needs survey"),
    (["name = 1", DRIVE.format("a")], "name = 1 is invalid"),
    (['nmae = "x"\n', DRIVE.format("a")], "the nearest known one is name"),
]


@pytest.mark.parametrize(("parts", "words"), WRONG)
def test_what_is_wrong_is_said(city, parts, words):
    "Drives without names or files of their own, files of no drive, unknown schemes and keys"
    with pytest.raises(ValueError, match=words):
        read_project(write(city, *parts))


def exit_codes(project):
    "Set of exit codes of `check` and `correct`, which are the same"
    commands = (["check", str(project)], ["correct", str(project), "-o", f"{project}.out"])
    return {CliRunner().invoke(app, command).exit_code for command in commands}


@pytest.mark.parametrize("parts", [parts for parts, _ in WRONG])
def test_what_project_toml_states_wrong_is_wrong_use(city, parts):
    "Exit code 2, as of a fault in survey.toml, between its drives too"
    assert exit_codes(write(city, *parts)) == {2}


def test_a_fault_of_a_drives_survey_toml_is_wrong_use_and_one_of_its_data_is_not(city):
    "Exit code 2 for an unknown key and for two CRS; 3 for a trajectory of another time system"
    both = ['[[drive]]\nsurvey = "a"\n', '[[drive]]\nsurvey = "b"\n']
    (city / "a" / "survey.toml").write_text(SURVEY.format('crs = "EPSG:32650"\n\n'))
    for head in ('crs = "EPSG:32649"\n\n', 'nmae = "b"\n\n'):
        (city / "b" / "survey.toml").write_text(SURVEY.format(head))
        assert exit_codes(write(city, *both)) == {2}
    (city / "b" / "survey.toml").write_text(SURVEY.format('crs = "EPSG:32650"\n\n'))
    (city / "b" / "way.csv").write_text(TRAJECTORY.replace("\n357", "\n1234357"))
    assert exit_codes(write(city, *both)) == {3}


@pytest.mark.parametrize(
    ("head", "row", "words"),
    [
        (
            "name,easting,northing,height",
            "T1,532010,3374002,44",
            r"\[control\] in project.toml, len",
        ),
        ("name,x,y,height", "T1,1,2,44", r"under \[control.columns\] in project.toml"),
    ],
)
def test_what_a_control_list_lacks_is_wanted_in_project_toml(city, head, row, words):
    "Kinds and sizes, and which of X and Y is easting: a project has no survey.toml for these"
    (city / "control.csv").write_text(f"{head}\n{row}\n")
    control = '[control]\nfile = "control.csv"\nsigma = [0.003, 0.004]\n'
    control += 'kind = "circle"\nsize = 0.6\n' if "x,y" in head else ""
    with pytest.raises(ValueError, match=words) as refusal:
        read_project(write(city, control, DRIVE.format("a"), DRIVE.format("b")))
    assert "survey.toml" not in str(refusal.value)


def test_the_key_of_a_drives_clouds_is_named(city):
    "`files` of the [[drive]], which is what stands in project.toml, for none and for one twice"
    for files, words in (('"a/b*.laz"', "no file matches .*b"), ('"a/*.laz", "a/t*"', "2 times")):
        drive = DRIVE.format("a").replace('"a/*.laz"', files)
        with pytest.raises((ValueError, OSError), match=rf"^files of \[\[drive\]\] a of .*{words}"):
            read_project(write(city, drive))


def test_a_copy_of_another_drives_cloud_is_refused(city):
    "Both files and drives are named; by point_source_ids of their own two drives may share copies"
    for name in ("a", "b"):
        write_cloud(city / name / f"tile-{name}.laz", points=9)
    words = r"tile-b\.laz, of drive b, is a copy of.*tile-a\.laz, of drive a"
    for parts in (
        [DRIVE.format("a"), DRIVE.format("b")],
        [IDS.format("a", "[1]"), DRIVE.format("b")],
    ):
        with pytest.raises(ValueError, match=words):
            read_project(write(city, *parts))
    parts = [IDS.format(n, f"[{i}]").replace('["a/', f'["{n}/') for i, n in enumerate("ab")]
    assert len(read_project(write(city, *parts)).drives) == 2


def test_files_without_points_are_no_copies(city):
    "No point counts twice where there is none, or none that can be read: each file says it itself"
    for name in ("a", "b"):
        write_cloud(city / name / f"tile-{name}.laz", points=0)
        (city / name / f"half-{name}.laz").write_bytes(b"LASF and half a header")
    assert len(read_project(write(city, DRIVE.format("a"), DRIVE.format("b"))).drives) == 2


def test_drives_of_two_systems_are_refused(city):
    "Two CRS, two time systems, two beliefs about the POS, and a second control list"
    for name, head in (("a", 'crs = "EPSG:32650"\n\n'), ("b", 'crs = "EPSG:32649"\n\n')):
        (city / name / "survey.toml").write_text(SURVEY.format(head))
    both = ['[[drive]]\nsurvey = "a"\n', '[[drive]]\nsurvey = "b"\n']
    with pytest.raises(ValueError, match=r"1 of 2 drives of .* are in another CRS"):
        read_project(write(city, *both))
    for name, sigma in (("a", 0.1), ("b", 0.2)):
        belief = f"\n[pos]\nposition_sigma = {sigma}\n"
        (city / name / "survey.toml").write_text(SURVEY.format("") + belief)
    with pytest.raises(ValueError, match=r"share it. Set"):
        read_project(write(city, *both))
    assert read_project(write(city, "[pos]\nposition_sigma = 0.3\n", *both)).drives
    (city / "b" / "survey.toml").write_text(SURVEY.format("") + '\n[control]\nfile = "c.csv"\n')
    with pytest.raises(ValueError, match="one list for all drives"):
        read_project(write(city, *both))
    (city / "b" / "survey.toml").write_text(SURVEY.format(""))
    (city / "b" / "way.csv").write_text(TRAJECTORY.replace("\n357", "\n1234357"))
    with pytest.raises(ValueError, match="one time system"):
        read_project(write(city, *both))


def test_control_of_a_project_is_excluded_and_included_by_name(city):
    "P1 takes no part, P2 does in any case; a name that is none of the list is refused by its file"
    (city / "control.csv").write_text(
        "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role\n"
        + "".join(f"P{k},{532000 + k},3374000,40,0.01,0.01,circle,0.6,control\n" for k in (1, 2))
    )
    drives = [DRIVE.format(name) for name in ("a", "b")]
    control = '[control]\nfile = "control.csv"\nexclude = ["{}"]\ninclude = ["P2"]\n'
    project = read_project(write(city, control.format("P1"), *drives))
    assert project.control.name == ("P2",)
    assert project.excluded.name == ("P1",)
    assert project.included == ("P2",)
    with pytest.raises(ValueError, match=r"project.toml: exclude lists P3, .* nearest name is P"):
        read_project(write(city, control.format("P3"), *drives))
