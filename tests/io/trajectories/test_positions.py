"""Positions without attitude, and geocentric ones, are named with what to export instead."""

import shutil

import numpy as np
import pytest
from pyproj import Transformer

import mlscorr
from mlscorr.io.surveys import sort_files
from mlscorr.io.trajectories import read_trajectory
from tests.beds.shared import shared
from tests.io.surveys.test_survey_file import CONTROL, TOML, write_las
from tests.io.trajectories.test_trajectory_io import HEADER, csv_of, drive, table_of

CRS = "EPSG:32650"
TAIL = "  Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio"
RTKLIB = """% program   : RTKPOST ver.2.4.3 b34
% inp file  : C:\\data\\rover.obs
% obs start : 2024/02/08 18:46:40.0 GPST (week2300 413200.0s)
%
% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)
%  {clock}    {place}
{rows}
"""
PLACES = {
    "geographic": "latitude(deg) longitude(deg)  height(m)",
    "geocentric": "x-ecef(m)      y-ecef(m)      z-ecef(m)",
}
CLOCKS = {
    "GPST": "2024/02/08 18:46:4{}.000",
    "UTC": "2024/02/08 18:46:2{}.000",
    "sow": "2300 41320{}.000",
}


def geocentric(table):
    "The positions of a table of E, N, H in geocentric X, Y, Z (m)"
    to_earth = Transformer.from_crs("EPSG:32650", "EPSG:4978", always_xy=True)
    return np.column_stack(to_earth.transform(*table[:, 1:4].T))


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("frame", PLACES)
def test_a_position_file_of_rtklib_is_named(frame, clock, tmp_path):
    "By any clock and in either frame: no column is offered, the export that is needed is"
    place = "30.460432544  114.472504669    23.0000"
    if frame == "geocentric":
        place = "-2279828.1234  5004704.1234  3214376.1234"
    rows = [
        f"{CLOCKS[clock].format(k)}  {place}  1  12 {'0.0080 ' * 6} 0.00  12.3" for k in range(5)
    ]
    names = "GPST" if clock == "sow" else clock
    text = RTKLIB.format(clock=names, place=PLACES[frame] + TAIL, rows="\n".join(rows))
    (tmp_path / "rover.pos").write_text(text)
    with pytest.raises(ValueError, match="is an RTKLIB position file without attitude") as error:
        read_trajectory(tmp_path / "rover.pos", CRS)
    said = str(error.value)
    assert "SBET (POSPac, Qinertia)" in said and "age" not in said and "columns." not in said
    assert ("(ECEF)" in said) == (frame == "geocentric")
    assert sort_files(tmp_path)[0].role == "trajectory"


def test_a_real_position_file_without_a_header_is_named(tmp_path):
    "GNSS_RTK.pos of a drive in Wuhan: init and check say what it is, and write nothing"
    real = shared("data/real_pos_error/GNSS_RTK.pos")
    with pytest.raises(ValueError, match=r"position file without column names \(7 numbers per"):
        read_trajectory(real)
    shutil.copy(real, tmp_path)
    write_las(tmp_path / "pass-1.las", np.linspace(357_480.0, 357_490.0, 100))
    with pytest.raises(ValueError, match=r"GNSS_RTK\.pos is a position file .* Nothing was"):
        mlscorr.init(tmp_path)
    (tmp_path / "survey.toml").write_text(TOML.replace("trajectory.csv", "GNSS_RTK.pos"))
    (tmp_path / "control.csv").write_text(CONTROL)
    faults = mlscorr.check(tmp_path).faults
    assert any("is a position file without column names" in fault.sentence for fault in faults)


def test_a_table_of_positions_alone_is_named(tmp_path):
    "Time and place without another column that could be an angle; with one its names are asked for"
    table = table_of(drive(50))
    path = csv_of(tmp_path / "t.csv", table[:, :4], "GPSTime,Easting,Northing,H-Ell")
    with pytest.raises(ValueError, match="is a file of positions without attitude"):
        read_trajectory(path)
    path = csv_of(tmp_path / "u.csv", table, "GPSTime,Easting,Northing,H-Ell,W1,W2,W3")
    with pytest.raises(ValueError, match=r"no column roll, pitch, heading; it has .*columns\.roll"):
        read_trajectory(path)


@pytest.mark.parametrize(
    "header",
    [
        HEADER,
        HEADER.replace("easting,northing,height", "X,Y,Z"),
        HEADER.replace("easting,northing,height", "X-ECEF [m],Y-ECEF [m],Z-ECEF [m]"),
    ],
)
def test_geocentric_coordinates_are_named(header, tmp_path):
    "ECEF in our columns, as X, Y, Z and by their own names: refused with what to export"
    table = table_of(drive(50))
    table[:, 1:4] = geocentric(table)
    with pytest.raises(ValueError, match=r"geocentric coordinates .*\(ECEF\).* Export easting"):
        read_trajectory(csv_of(tmp_path / "t.csv", table, header))


def test_a_map_place_at_the_earths_radius_is_no_geocentric_one(tmp_path):
    "At latitude 57.3 deg a northing is 6 357 km, and so is the distance from the origin"
    table = table_of(drive(50))
    table[:, 2] += 6_357_000.0 - table[0, 2]
    assert len(read_trajectory(csv_of(tmp_path / "t.csv", table))) == 50
