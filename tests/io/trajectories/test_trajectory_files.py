"""Trajectories as POS software, TerraScan and research write them, in their own conventions."""

import struct

import numpy as np
import pytest
from pyproj import Proj
from scipy.spatial.transform import Rotation

from mlscorr.io.trajectories import TrajectorySection
from mlscorr.io.trajectories.sbet import read_sbet
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from mlscorr.survey import Trajectory
from tests.io.trajectories.test_trajectory_io import csv_of, drive, sbet_records, table_of, written

CRS = "EPSG:32650"
TRUE = "clockwise from true north"
GRID = "clockwise from grid north"
# By the columns of a text export of NovAtel Inertial Explorer 8
EXPLORER = """Project:     street
Program:     Inertial Explorer Version 8.90
Profile:     MMS
Source:      GNSS/INS Epochs (Smoothed TC Combined)
Datum:       WGS84, (processing datum)

{names}
{units}
"""
SIGMAS = "SDEast  SDNorth  SDHeight  RollSD  PitchSD  HdngSD"


def read(path, crs=CRS, **section):
    return read_trajectory_file(path, crs, None, TrajectorySection(file="", **section))


def assert_same(trajectory, expected, metres=1e-6, degrees=1e-6):
    assert np.abs(trajectory.gps_time - expected.gps_time).max() < 1e-6
    assert np.abs(trajectory.position - expected.position).max() < metres
    turn = (trajectory.attitude * expected.attitude.inv()).magnitude()
    assert np.degrees(turn.max()) < degrees


def geographic(trajectory):
    "Longitude, latitude and meridian convergence (deg)"
    plane = Proj(CRS)
    degrees = plane(*trajectory.position[:, :2].T, inverse=True)
    return np.column_stack([*degrees, plane.get_factors(*degrees).meridian_convergence])


def explorer(path, names, units, table):
    lines = ["  ".join(f"{value:.9f}" for value in row) for row in table]
    path.write_text(EXPLORER.format(names=names, units=units) + "\n".join([*lines, ""]))
    return path


def test_an_export_of_inertial_explorer_is_read(tmp_path):
    "Below its own words: E, N, H, angles and sigmas; headings from true north lose the convergence"
    expected = drive(100)
    table = table_of(expected)
    table[:, 6] += geographic(expected)[:, 2]
    sigmas = np.column_stack([expected.position_sigma, np.degrees(expected.attitude_sigma)])
    names = f"GPSTime  Easting  Northing  H-Ell  Roll  Pitch  Heading  {SIGMAS}"
    units = "(sec)  (m)  (m)  (m)  (deg)  (deg)  (deg)  (m)  (m)  (m)  (deg)  (deg)  (deg)"
    path = explorer(tmp_path / "ie.txt", names, units, np.hstack([table, sigmas]))
    with pytest.raises(ValueError, match=f'Inertial Explorer or .* heading = "{TRUE}" or "{GRID}"'):
        read(path)
    file = read(path, heading=TRUE)
    assert_same(file.trajectory, expected)
    assert np.abs(file.trajectory.position_sigma - expected.position_sigma).max() < 1e-8
    assert np.abs(file.trajectory.attitude_sigma - expected.attitude_sigma).max() < 1e-9
    assert "height = H-Ell" in file.layout and f"heading {TRUE}, pitch nose up" in file.layout
    with pytest.raises(ValueError, match="headings from true north: set crs"):
        read(path, None, heading=TRUE)


def test_an_export_of_pospac_is_read(tmp_path):
    "Names by commas, rows by blanks, words on units between, and a height that stands there twice"
    expected = drive(100)
    table = table_of(expected)
    place = geographic(expected)
    table[:, 6] += place[:, 2]
    sigmas = np.column_stack([expected.position_sigma, np.degrees(expected.attitude_sigma)])
    height = table[:, 3:4]
    nothing = np.zeros((100, 1))
    rows = [table[:, :1], nothing, table[:, 1:4], place[:, 1::-1], height, table[:, 4:], sigmas]
    names = (
        "TIME, DISTANCE, EASTING, NORTHING, ELLIPSOID HEIGHT, LATITUDE, LONGITUDE, ELLIPSOID "
        "HEIGHT, ROLL, PITCH, HEADING, EAST SD, NORTH SD, HEIGHT SD, ROLL SD, PITCH SD, HEADING SD"
    )
    units = "(time in Sec, distance in Meters, orientation angles and SD in Degrees)"
    path = explorer(tmp_path / "export.txt", names, f"\n {units} \n", np.hstack(rows))
    with pytest.raises(ValueError, match=f'POSPac.* heading = "{TRUE}" or "{GRID}"'):
        read(path)
    file = read(path, heading=TRUE)
    assert_same(file.trajectory, expected)
    assert np.abs(file.trajectory.position_sigma - expected.position_sigma).max() < 1e-8
    assert "; not used: DISTANCE, LATITUDE, LONGITUDE, ELLIPSOID HEIGHT." in file.layout
    rows[4] = height + 1.0
    explorer(path, names, units, np.hstack(rows))
    with pytest.raises(
        ValueError, match=r"2 columns that may be the height .*number all.*height = 5"
    ):
        read(path, heading=TRUE)


def test_units_below_the_names_are_heeded(tmp_path):
    "Sigmas in minutes of arc are read so; unknown units and degrees in three parts are named"
    expected = drive(100)
    minutes = 60.0 * np.degrees(expected.attitude_sigma)
    table = np.hstack([table_of(expected), expected.position_sigma, minutes])
    names = f"GPSTime  Easting  Northing  H-Ell  Roll  Pitch  Heading  {SIGMAS}"
    units = "(sec) (m) (m) (m) (deg) (deg) (deg) (m) (m) (m) ({0}) ({0}) ({0})"
    path = explorer(tmp_path / "ie.txt", names, units.format("arcmin"), table)
    found = read(path, heading=GRID).trajectory.attitude_sigma
    assert np.abs(found - expected.attitude_sigma).max() < 1e-9
    explorer(path, names, units.format("turns"), table)
    with pytest.raises(ValueError, match="sigma_roll in 'turns'; supported units are m, mm, deg"):
        read(path, heading=GRID)
    parts = np.hstack([table[:, :1], np.ones((100, 6)), table[:, 3:7]])
    names = names.replace("Easting  Northing", "Latitude  Longitude").replace(SIGMAS, "")
    explorer(path, names, "(sec) (+/-D M S) (+/-D M S) (m) (deg) (deg) (deg)", parts)
    with pytest.raises(
        ValueError, match=r"11 columns where 7 .*minutes and seconds: export decimal"
    ):
        read(path)


def test_latitude_and_longitude_in_radians_are_not_taken_for_degrees(tmp_path):
    "No land lies within pi degrees of 0, 0: radians are refused, and read with angles = 'rad'"
    expected = drive(100, sigmas=False)
    table = table_of(expected)
    place = geographic(expected)
    table[:, 6] += place[:, 2]
    table = np.column_stack([table[:, 0], np.radians(place[:, 1::-1]), table[:, 3:]])
    table[:, 4:] = np.radians(table[:, 4:])
    header = "Time,Lat,Lon,Height,Roll,Pitch,Heading"
    np.savetxt(tmp_path / "t.txt", table, "%.12f", ",", header=header, comments="")
    with pytest.raises(ValueError, match=r"longitudes of .* seem to be radians.* angles = \"rad\""):
        read(tmp_path / "t.txt")
    assert_same(read(tmp_path / "t.txt", angles="rad").trajectory, expected, metres=2e-4)


def test_latitude_and_longitude_are_projected(tmp_path):
    "Geographic positions in degrees come into the CRS, and their headings to grid north"
    expected = drive(100)
    table = table_of(expected)
    place = geographic(expected)
    table = np.column_stack([table[:, 0], place[:, 1::-1], table[:, 3:]])
    table[:, 6] += place[:, 2]
    names = "GPSTime Latitude Longitude H-Ell Roll Pitch Heading"
    units = "(sec) (deg) (deg) (m)"
    path = explorer(tmp_path / "ie.txt", names, f"{units} (deg) (deg) (deg)", table)
    file = read(path)
    assert_same(file.trajectory, expected, metres=2e-4)
    assert f"in the datum of {CRS}; heading {TRUE}" in file.layout
    with pytest.raises(ValueError, match=r"latitude and longitude: set crs in survey\.toml"):
        read(path, None)


def test_another_convention_is_named_in_survey_toml(tmp_path):
    "Radians, yaw counterclockwise from east, nose down, right side up, chosen columns: ours again"
    expected = drive(100, sigmas=False)
    table = table_of(expected)
    angles = np.radians([[-1.0, -1.0, -1.0]] * table[:, 4:] + [0.0, 0.0, 90.0])
    lines = ["Stempel;Y;X;Z;Roll;Pitch;Yaw"]
    rows = np.column_stack([table[:, :4], angles])
    lines += [";".join(f"{value:.10f}" for value in row).replace(".", ",") for row in rows]
    (tmp_path / "t.txt").write_text("\n".join([*lines, ""]))
    columns = {"gps_time": "Stempel", "easting": "Y", "northing": "X"}
    with pytest.raises(
        ValueError,
        match=r"no column heading; .* yaw column may count in "
        "different directions",
    ):
        read(tmp_path / "t.txt", columns=columns)
    with pytest.raises(ValueError, match=r"\[trajectory\.columns\] .* which of X and Y is easting"):
        read(tmp_path / "t.txt", heading=GRID)
    east = "counterclockwise from east"
    named = {"heading": east, "pitch": "nose down", "roll": "right side up", "angles": "rad"}
    file = read(tmp_path / "t.txt", columns=columns, **named)
    assert_same(file.trajectory, expected)
    assert "pitch, yaw by name (semicolons, decimal comma); heading counterclockwise" in file.layout


def test_our_own_columns_may_be_in_radians(tmp_path):
    "Angles refused without angles = 'rad' are read with it, and reported"
    expected = drive(100, sigmas=False)
    path = csv_of(tmp_path / "t.csv", table_of(expected, degrees=False))
    with pytest.raises(ValueError, match=r"seem to be in radians"):
        read(path)
    file = read(path, angles="rad")
    assert_same(file.trajectory, expected)
    assert "roll, pitch, heading by name (commas, decimal point); heading clock" in file.layout
    assert read(csv_of(path, table_of(expected))).layout is None


def test_columns_without_names_are_numbered(tmp_path):
    "A table without a header is read by numbers from 1; without them it is refused"
    expected = drive(100, sigmas=False)
    np.savetxt(tmp_path / "t.txt", table_of(expected), fmt="%.8f", header="by nobody")
    with pytest.raises(ValueError, match="no column gps_time"):
        read(tmp_path / "t.txt")
    names = ("gps_time", "easting", "northing", "height", "roll", "pitch", "heading")
    file = read(tmp_path / "t.txt", columns={name: i for i, name in enumerate(names, start=1)})
    assert_same(file.trajectory, expected)
    assert "heading = column 7 (blanks, decimal point)" in file.layout


def test_what_a_table_in_other_letters_lacks_is_named(tmp_path):
    "Windows-1252 is read, so its umlauts are not the fault: Gier is a yaw, and counts in some way"
    table = table_of(drive(100, sigmas=False))
    lines = ["Zeit;Ost;Nord;Höhe;Roll;Nick;Gier", *(";".join(map(str, row)) for row in table)]
    (tmp_path / "t.txt").write_bytes("\n".join([*lines, ""]).encode("cp1252"))
    with pytest.raises(ValueError, match=r"no column heading; it has .* Höhe, .*A yaw column"):
        read(tmp_path / "t.txt")
    assert len(read(tmp_path / "t.txt", heading=GRID).trajectory) == 100


def test_a_column_in_utc_is_named_with_the_seconds_that_it_needs(tmp_path):
    "UTC may be meant by gps_time, 18 s behind; other columns need nothing added"
    text = csv_of(tmp_path / "t.csv", table_of(drive(100, sigmas=False))).read_text()
    for name, is_utc in (("UTC", True), ("Stempel", False)):
        path = tmp_path / f"{name}.csv"
        path.write_text(text.replace("gps_time", name))
        with pytest.raises(ValueError, match=f"columns.gps_time = '{name}'") as error:
            read(path)
        assert ("UTC also need trajectory.time_constant: 18 s" in str(error.value)) is is_utc


AXES = {  # theirs from ours
    "right-forward-up": np.eye(3),
    "forward-left-up": np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "forward-right-down": np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}


@pytest.mark.parametrize("axes", AXES)
def test_quaternions_of_tum_are_read_by_the_course(axes, tmp_path):
    "time x y z qx qy qz qw: the body axes are those whose forward goes along, or those named"
    expected = drive(100, sigmas=False)
    quaternion = (expected.attitude * Rotation.from_matrix(AXES[axes].T)).as_quat()
    table = np.column_stack([expected.gps_time, expected.position, quaternion])
    np.savetxt(tmp_path / "t.tum", table, fmt="%.9f", header="timestamp tx ty tz qx qy qz qw")
    file = read(tmp_path / "t.tum")
    assert_same(file.trajectory, expected)
    assert file.layout.endswith(f"body axes {axes}.")
    table[:, 1:3] = table[0, 1:3]  # at rest there is no course
    np.savetxt(tmp_path / "t.tum", table, fmt="%.9f")
    with pytest.raises(
        ValueError, match="the course over ground does not identify their body axes"
    ):
        read(tmp_path / "t.tum")
    still = Trajectory(
        expected.gps_time,
        read(tmp_path / "t.tum", axes=axes).trajectory.position,
        expected.attitude,
    )
    assert_same(read(tmp_path / "t.tum", axes=axes).trajectory, still)


def terrascan(trajectory, version=20010715):
    "The bytes of a .trj, by the TerraScan User Guide"
    header = struct.pack("<8s4i", b"TSCANTRJ", version, 1376, len(trajectory), 64).ljust(
        1376, b"\0"
    )
    rows = [[*row, 1, 2, 3, 4, 0, 0] for row in table_of(trajectory)[:, [0, 1, 2, 3, 6, 4, 5]]]
    return b"".join([header.ljust(1376, b"\0"), *(struct.pack("<7d4B2h", *row) for row in rows)])


def test_terrascan_trajectories_are_read(tmp_path):
    "Header and records by TerraScan's guide; cut off, or of another version, they are refused"
    expected = drive(100, sigmas=False)
    path = tmp_path / "line.trj"
    path.write_bytes(terrascan(expected))
    file = read(path)
    assert_same(file.trajectory, expected)
    assert f"TerraScan trajectory; heading {GRID}, pitch nose up" in file.layout
    for content, message in (
        (terrascan(expected)[:-1], "is truncated: it has 7775 bytes where its header states 7776"),
        (terrascan(expected, 20990101), "not a TerraScan trajectory of version 20010715"),
        (b"TSCANTRJ", "not a TerraScan trajectory"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=message):
            read(path)


def test_an_sbet_is_known_under_any_name(tmp_path):
    "By whole records whose angles are radians and whose times grow; it takes no conventions"
    expected = read_sbet(written(tmp_path / "sbet.out", sbet_records()), "EPSG:32611")
    for name in ("export.bin", "sbet.dat", "nav.csv"):
        file = read(written(tmp_path / name, sbet_records()), "EPSG:32611")
        assert file.is_sbet and file.layout is None
        assert_same(file.trajectory, expected)
    with pytest.raises(ValueError, match=r"is an SBET.*remove angles from \[trajectory\]"):
        read(tmp_path / "export.bin", angles="rad")


def test_a_date_in_place_of_seconds_is_named(tmp_path):
    "The error quotes the cell and states that it is a date"
    for cell in ("2026-05-01", "12:30:01.5", "01.05.2026"):
        text = "Time;Easting;Northing;Height;Roll;Pitch;Heading\n"
        (tmp_path / "t.txt").write_text(f"{text}{cell};532000;3374000;40;0;0;0\n")
        with pytest.raises(ValueError, match=f"'{cell}' where .* a date or time of day: give"):
            read(tmp_path / "t.txt")
