"""Trajectories out: SBET with smrmsg, and TUM."""

import numpy as np
import pytest

from mlscorr.io.trajectories import check_exports, export_trajectory, read_trajectory
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from tests.io.trajectories.test_trajectory_files import CRS, assert_same
from tests.io.trajectories.test_trajectory_io import drive


@pytest.mark.parametrize("name", ["drive.sbet", "drive.out"])
def test_an_sbet_comes_back(name, tmp_path):
    "Positions to 10 um, attitudes to 1e-7 deg, and the sigmas of each epoch"
    written = drive(400)
    names = export_trajectory(tmp_path / name, written, CRS)
    assert names == [name, "smrmsg_drive.out"]
    read = read_trajectory(tmp_path / name, CRS, tmp_path / "smrmsg_drive.out")
    assert_same(read, written, metres=1e-5, degrees=1e-7)
    assert np.abs(read.position_sigma - written.position_sigma).max() < 1e-12
    assert np.abs(read.attitude_sigma - written.attitude_sigma).max() < 1e-12
    unsure = type(written)(written.gps_time, written.position, written.attitude)
    assert export_trajectory(tmp_path / "b.sbet", unsure, CRS) == ["b.sbet"]


def test_tum_comes_back(tmp_path):
    "Times to 1 us, positions to 10 um, quaternions of right, forward, up"
    written = drive(400)
    assert export_trajectory(tmp_path / "drive.tum", written, None) == ["drive.tum"]
    file = read_trajectory_file(tmp_path / "drive.tum")
    assert_same(file.trajectory, written, metres=6e-6, degrees=1e-6)
    assert file.layout.endswith("body axes right-forward-up.")


def test_what_can_not_be_written_is_refused_before_the_work():
    "Folders, unknown suffixes, an SBET without a CRS"
    for name in ("a/b.sbet", "drive.csv", "drive"):
        with pytest.raises(ValueError, match=r"give the name of a file without a folder"):
            check_exports([name])
    check_exports(["drive.sbet", "drive.tum"])
    check_exports(["drive.tum"], None, is_read=True)
    with pytest.raises(ValueError, match=r"drive\.out.* is geographic: set crs"):
        check_exports(["drive.out"], None, is_read=True)
