"""RIEGL's POF and POQ: written from their public layout, the trajectory comes back."""

import re
from datetime import date

import numpy as np
import pytest

from mlscorr.io.trajectories import TrajectorySection, read_trajectory
from mlscorr.io.trajectories.pof import HEADER, read_pof
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from tests.beds.pof import pof_bytes, poq_bytes
from tests.io.trajectories.test_trajectory_files import assert_same
from tests.io.trajectories.test_trajectory_io import drive

CRS = "EPSG:32650"
THURSDAY = date(2026, 5, 7)  # 413 200 s in the GPS week are on a Thursday


def put(path, content):
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("minor", [0, 1])
def test_a_pof_and_its_poq_give_the_trajectory_back(tmp_path, minor):
    "With and without distance and counts of GLONASS: 0.1 mm, 1e-7 deg, sigmas as they were"
    expected = drive(200)
    pof = put(tmp_path / "LINE.POF", pof_bytes(expected, CRS, minor))
    poq = put(tmp_path / "LINE.POQ", poq_bytes(expected, minor))
    file = read_trajectory_file(pof, CRS, poq)
    assert_same(file.trajectory, expected, metres=1e-4, degrees=1e-6)
    assert np.abs(file.trajectory.position_sigma - expected.position_sigma).max() < 1e-12
    assert np.abs(file.trajectory.attitude_sigma - expected.attitude_sigma).max() < 1e-12
    assert f"POF 1.{minor} of 2026-05-07, times of seconds of the week (GPS)" in file.layout
    assert f"in the datum of {CRS}" in file.layout and "clockwise from true north" in file.layout


@pytest.mark.parametrize(
    ("unit", "system", "seconds", "words"),
    [
        (1, 0, 4 * 86_400.0, r"of the day \(GPS\), \+345600 s to Thursday in the GPS week"),
        (2, 1, 18.0, r"of the week \(UTC\), \+18 leap seconds"),
        (1, 1, 4 * 86_400.0 + 18.0, r"of the day \(UTC\), \+345600 s .*, \+18 leap seconds"),
    ],
)
def test_times_of_day_and_in_utc_become_seconds_of_the_week(unit, system, seconds, words, tmp_path):
    "By the header's date and the table of leap seconds, for the sigmas too, and it is said"
    expected = drive(200)
    pof = pof_bytes(expected, CRS, 1, THURSDAY, unit, system, seconds)
    poq = put(tmp_path / "a.poq", poq_bytes(expected, seconds=seconds))
    file = read_trajectory_file(put(tmp_path / "a.pof", pof), CRS, poq)
    assert np.abs(file.trajectory.gps_time - expected.gps_time).max() < 1e-9
    assert np.abs(file.trajectory.position_sigma - expected.position_sigma).max() < 1e-6
    assert re.search(words, file.layout), file.layout


def test_times_of_an_unknown_system_are_warned_of(tmp_path):
    "They are taken as GPS, and where they are UTC the clouds lie 18 s beside"
    expected = drive(100)
    path = put(tmp_path / "a.pof", pof_bytes(expected, CRS, system=2))
    with pytest.warns(UserWarning, match="does not state whether its times are GPS or UTC"):
        assert_same(read_trajectory(path, CRS), expected, metres=1e-4)


def changed(**fields):
    "A POF with other values in its header"
    content = pof_bytes(drive(100), CRS)
    header = np.frombuffer(content[: HEADER.itemsize], HEADER).copy()
    for name, value in fields.items():
        header[name] = value
    return header.tobytes() + content[HEADER.itemsize :]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (pof_bytes(drive(100), CRS)[:-1], "6799 bytes.*100 records of 64 bytes, 6800"),
        (pof_bytes(drive(100), CRS) + b"\0", "6801 bytes .* may have another layout"),
        (pof_bytes(drive(100), CRS)[:100], "not a POF of RIEGL .*100 bytes.* truncated"),
        (bytes(1000), "not a POF of RIEGL"),
        (changed(month=13), "date 2026-13-07"),
        (changed(major=2), r"version 2\.1"),
        (changed(minor=0), "100 records of 56 bytes, 6000 in all: its version may have"),
        (changed(entries=-1), "-1 records"),
        (changed(entries=1 << 62), "truncated"),
        (changed(box=[[117.0, 118.0], [30.0, 31.0], [50.0, 60.0]]), "heights of 42.* 50.000000 to"),
        (changed(box=np.nan), "longitudes of .* nan to nan: it is damaged"),
        (changed(unit=0), "normalized time with an unknown start. Export it with"),
        (changed(unit=7), "not a POF of RIEGL"),
    ],
)
def test_what_is_no_whole_pof_is_refused(content, message, tmp_path):
    "Cut off, damaged, of another version, times without a start: one sentence with the way out"
    with pytest.raises(ValueError, match=message) as refusal:
        read_trajectory(put(tmp_path / "a.pof", content), CRS)
    assert "Export it" in str(refusal.value)


@pytest.mark.long
def test_every_cut_of_a_pof_and_a_poq_is_refused_or_whole(tmp_path):
    "At any byte: a sentence, or a POQ that ends between two records and covers less"
    expected = drive(10)
    pof = pof_bytes(expected, CRS)
    poq = poq_bytes(expected)
    path = put(tmp_path / "a.pof", pof)
    for end in range(len(poq) - 2 * 68):  # two steps of it may lack
        with pytest.raises(ValueError, match=r"truncated|cut off|covers"):
            read_trajectory(path, CRS, put(tmp_path / "a.poq", poq[:end]))
    for end in range(len(pof)):
        with pytest.raises(ValueError, match="truncated"):
            read_pof(put(path, pof[:end]))


def test_a_pof_takes_no_conventions_and_needs_a_crs(tmp_path):
    "Known conventions need no setting; a POFX has no public layout"
    path = put(tmp_path / "a.pof", pof_bytes(drive(100), CRS))
    section = TrajectorySection(file="", roll="right side up")
    with pytest.raises(ValueError, match=r"is a POF.*remove roll from \[trajectory\]"):
        read_trajectory_file(path, CRS, None, section)
    with pytest.raises(ValueError, match=r"a POF with latitude and longitude: set crs"):
        read_trajectory(path)
    with pytest.raises(ValueError, match="POFX of RIEGL, whose layout is not public"):
        read_trajectory(put(tmp_path / "a.pofx", bytes(1000)), CRS)


def test_negative_sigmas_are_no_poq(tmp_path):
    "The sentence names the kind that was expected"
    expected = drive(100)
    content = bytearray(poq_bytes(expected))
    content[63 + 8 : 63 + 16] = np.array([-1.0]).tobytes()
    pof = put(tmp_path / "a.pof", pof_bytes(expected, CRS))
    with pytest.raises(ValueError, match="negative sigmas: it may not be a POQ"):
        read_trajectory(pof, CRS, put(tmp_path / "a.poq", bytes(content)))
