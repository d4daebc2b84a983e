"""Quaternions in tables with a header: its names say which column is what."""

import numpy as np
import pytest

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.surveys import read_survey, sort_files
from tests.io.surveys.test_survey_file import CONTROL, TOML, write_las
from tests.io.trajectories.test_trajectory_files import CRS, assert_same, geographic, read
from tests.io.trajectories.test_trajectory_io import drive

START = 1_706_500_000.0  # s since 1970
CHOSEN = {"gps_time": "a", "easting": "b", "northing": "c", "height": "d"}
CHOSEN |= {"qw": "e", "qx": "f", "qy": "g", "qz": "h"}


def table_of(trajectory):
    "Time, place, and the quaternion with w first"
    quaternion = trajectory.attitude.as_quat()[:, [3, 0, 1, 2]]
    return np.column_stack([trajectory.gps_time, trajectory.position, quaternion])


def put(path, header, table, separator=" ", time="{:.6f}"):
    "A table below its header, which keeps nanoseconds whole"
    rows = [[time.format(row[0]), *(f"{value:.9f}" for value in row[1:])] for row in table]
    path.write_text("\n".join([header, *(separator.join(row) for row in rows), ""]))
    return path


@pytest.mark.parametrize(
    ("header", "separator"),
    [
        ("%time x y z qw qx qy qz", " "),
        ("# timestamp tx ty tz qw qx qy qz", " "),
        ("time x y z qw qx qy qz", " "),
        ("time,x,y,z,qw,qx,qy,qz", ","),
        ("#time;x;y;z;q_w;q_x;q_y;q_z", ";"),
        ("timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z", ","),
        ("time,easting,northing,height,quat_w,quat_x,quat_y,quat_z", ","),
        (
            "time,pose.position.x,pose.position.y,pose.position.z,pose.orientation.w,"
            "pose.orientation.x,pose.orientation.y,pose.orientation.z",
            ",",
        ),
    ],
)
def test_names_in_a_header_say_where_w_is(header, separator, tmp_path):
    "qw before qx: attitudes are right to 1e-6 deg, where they were 160 deg off by place"
    expected = drive(100, sigmas=False)
    file = read(put(tmp_path / "t.txt", header, table_of(expected), separator))
    assert_same(file.trajectory, expected)
    assert "qw" in file.layout and "right-forward-up" in file.layout
    assert sort_files(tmp_path)[0].role == "trajectory"


@pytest.mark.parametrize(
    ("header", "time"),
    [
        (
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
            "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]",
            "nanoseconds",
        ),
        ("#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],v_x", "nanoseconds"),
        ("timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v", "microseconds"),
        ("timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v", "milliseconds"),
    ],
)
def test_times_of_euroc_are_read_in_nanoseconds(header, time, tmp_path):
    "Unix time in whole ns, us or ms becomes seconds, by its unit or by its size, and it is said"
    expected = drive(100, sigmas=False)
    factor = {"nanoseconds": 1e9, "microseconds": 1e6, "milliseconds": 1e3}[time]
    table = np.column_stack([table_of(expected), np.zeros(len(expected))])
    seconds = expected.gps_time - expected.gps_time[0] + START
    table[:, 0] = seconds * factor
    file = read(put(tmp_path / "data.csv", header, table, ",", "{:.0f}"))
    assert np.abs(file.trajectory.gps_time - seconds).max() < 1e-6
    assert np.abs(file.trajectory.position - expected.position).max() < 1e-6
    assert "[ns]" in header or f"times in {time} by their size" in file.layout


def test_columns_of_survey_toml_name_the_quaternion(tmp_path):
    "columns.qw and its kin name what a header does not, or number it; else the header is refused"
    expected = drive(100, sigmas=False)
    path = put(tmp_path / "t.txt", "a b c d e f g h", table_of(expected))
    assert_same(read(path, columns=CHOSEN).trajectory, expected)
    numbers = {name: "abcdefgh".index(letter) + 1 for name, letter in CHOSEN.items()}
    assert_same(read(path, columns=numbers).trajectory, expected)
    path = put(tmp_path / "u.txt", "# zeit rechts hoch h q1 q2 q3 q4", table_of(expected))
    with pytest.raises(ValueError, match=r"qx, qy, qz, qw.*qw = 8"):
        read(path)
    assert_same(read(path, columns=numbers).trajectory, expected)


def test_a_quaternion_beside_angles_is_left_unless_it_is_chosen(tmp_path):
    "Angles that are there count; with columns.qw the quaternion does"
    expected = drive(100, sigmas=False)
    angles = np.degrees(np.column_stack(angles_from_attitude(expected.attitude))) + 1.0
    header = "time easting northing height qw qx qy qz roll pitch heading"
    path = put(tmp_path / "t.txt", header, np.column_stack([table_of(expected), angles]))
    heading = angles_from_attitude(read(path).trajectory.attitude)[2]
    true = angles_from_attitude(expected.attitude)[2]
    assert np.degrees(heading - true) == pytest.approx(1.0, abs=1e-6)
    chosen = {name: name for name in ("qx", "qy", "qz", "qw")}
    assert_same(read(path, columns=chosen).trajectory, expected)


def test_quaternions_beside_a_latitude_are_from_true_north(tmp_path):
    "Headings lose the meridian convergence, and places are projected: 0.1 mm, 1e-6 deg"
    expected = drive(100, sigmas=False)
    place = geographic(expected)
    true = angles_from_attitude(expected.attitude)[2] + np.radians(place[:, 2])
    roll, pitch, _ = angles_from_attitude(expected.attitude)
    quaternion = attitude_from_angles(roll, pitch, true).as_quat()
    columns = [expected.gps_time, place[:, 1], place[:, 0], expected.position[:, 2], quaternion]
    header = "time latitude longitude height qx qy qz qw"
    path = tmp_path / "t.txt"
    np.savetxt(path, np.column_stack(columns), fmt="%.12f", header=header, comments="")
    assert_same(read(path, crs=CRS).trajectory, expected, metres=1e-4, degrees=1e-6)


def test_a_survey_names_the_columns_of_its_quaternions(tmp_path):
    "survey.toml with columns.qw is read, and the heading is the course"
    (tmp_path / "control.csv").write_text(CONTROL)
    named = "\n".join(f'{name} = "{column}"' for name, column in CHOSEN.items())
    file = 'file = "trajectory.csv"'
    text = TOML.replace(file, f"{file}\n[trajectory.columns]\n{named}")
    (tmp_path / "survey.toml").write_text(text)
    turned = f"{0.5**0.5},0,0,{-(0.5**0.5)}"  # to the east: -90 deg about up
    times = 413_200.0 + 0.05 * np.arange(800)
    rows = [f"{t:.4f},{532_000 + 5 * (t - times[0]):.4f},3374000,42,{turned}" for t in times]
    rows = ["a,b,c,d,e,f,g,h", *rows]
    (tmp_path / "trajectory.csv").write_text("\n".join([*rows, ""]))
    write_las(tmp_path / "pass-1.las", np.linspace(413202.0, 413215.0, 100))
    write_las(tmp_path / "pass-2.las", np.linspace(413220.0, 413235.0, 100))
    heading = angles_from_attitude(read_survey(tmp_path).trajectory.attitude)[2]
    assert np.degrees(heading) == pytest.approx(90.0, abs=1e-6)
