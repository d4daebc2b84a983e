"""Seconds of week that start again within a file: trajectories of every kind count on."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from mlscorr.frames import angles_from_attitude
from mlscorr.io.surveys import read_survey
from mlscorr.io.trajectories import (
    SMRMSG_FIELDS,
    export_trajectory,
    read_poses,
    read_trajectory,
    write_trajectory_csv,
)
from tests.beds.pof import pof_bytes, poq_bytes
from tests.io.surveys.test_survey_file import CONTROL, TOML, write_las
from tests.io.trajectories.test_trajectory_io import drive, table_of

CRS = "EPSG:32650"
# s
WEEK = 604_800.0
DAY = 86_400.0
SATURDAY = date(2026, 5, 9)


def over_week_end(late=8.0):
    "The drive of 20 s, of which some seconds are of the new week, and its times as files have them"
    whole = drive()
    whole = replace(whole, gps_time=whole.gps_time - whole.gps_time[-1] + WEEK + late)
    return whole, whole.gps_time % WEEK


def with_times(whole, own):
    "The drive with times that nobody has checked"
    return replace(whole.select(slice(None)), gps_time=own)


def sbet(path, whole):
    export_trajectory(path, whole, CRS)
    return path


def smrmsg(path, times):
    "Sigmas of 0.01 m that grow by 1 mm a second, from some times on"
    record = np.zeros((len(times), len(SMRMSG_FIELDS)))
    record[:, 0] = times % WEEK
    record[:, 1:4] = 0.01 + 0.001 * (times - times[0])[:, None]
    record[:, 7:] = 1.0
    record.tofile(path)
    return path


def csv(path, table):
    header = "gps_time,easting,northing,height,roll,pitch,heading"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.8f")
    return path


def files(folder, whole, own):
    "The drive as CSV, TerraScan's TRJ, SBET and POF, each with times that start again"
    table = np.column_stack([own, table_of(whole)[:, 1:]])
    yield csv(folder / "a.csv", table)
    records = np.zeros(len(table), [("values", "<f8", 7), ("rest", "V8")])
    records["values"] = table[:, [0, 1, 2, 3, 6, 4, 5]]
    head = b"TSCANTRJ" + np.array([20010715, 1376, len(table), 64], "<i4").tobytes()
    (folder / "a.trj").write_bytes(head.ljust(1376, b"\0") + records.tobytes())
    yield folder / "a.trj"
    parts = replace(whole, weeks=(whole.gps_time >= WEEK).astype(int))
    yield sbet(folder / "a.out", parts)
    (folder / "a.sbet.bin").write_bytes((folder / "a.out").read_bytes())
    yield folder / "a.sbet.bin"
    (folder / "a.pof").write_bytes(pof_bytes(with_times(whole, own), CRS))
    yield folder / "a.pof"


def test_every_kind_of_trajectory_counts_on(tmp_path):
    "Positions and headings lie at 604 792 to 604 808 s; times are written as they came"
    whole, own = over_week_end()
    for path in files(tmp_path, whole, own):
        read = read_trajectory(path, CRS)
        assert np.abs(read.gps_time - whole.gps_time).max() < 1e-6, path
        assert np.abs(read.position - whole.position).max() < 2e-4, path
        turned = (read.attitude * whole.attitude.inv()).magnitude()
        assert np.degrees(turned).max() < 1e-5, path
        assert np.array_equal(read.weeks, whole.gps_time >= WEEK), path
        write_trajectory_csv(tmp_path / "again.csv", read)
        written = np.loadtxt(tmp_path / "again.csv", delimiter=",", skiprows=1)[:, 0]
        assert np.abs(written - own).max() < 1e-6, path
        export_trajectory(tmp_path / "again.sbet", read, CRS)
        written = np.fromfile(tmp_path / "again.sbet").reshape(-1, 17)[:, 0]
        assert np.abs(written - own).max() < 1e-6, path


@pytest.mark.parametrize("late", [8.0, 30.0])
def test_sigmas_of_an_sbet_count_on_with_it(tmp_path, late):
    "An smrmsg over the week's end gives the sigma of each epoch, before and behind it: 0.1 mm"
    whole, _ = over_week_end(late)
    weeks = (whole.gps_time >= WEEK).astype(int)
    path = sbet(tmp_path / "a.sbet", replace(whole, weeks=weeks))
    times = np.arange(np.floor(WEEK - 20.0), np.ceil(WEEK + late) + 1.0)
    read = read_trajectory(path, CRS, smrmsg(tmp_path / "smrmsg.out", times))
    expected = 0.01 + 0.001 * (whole.gps_time - times[0])
    assert np.abs(read.position_sigma[:, 0] - expected).max() < 1e-4


@pytest.mark.parametrize(("unit", "period"), [(1, DAY), (2, WEEK)])
def test_a_pof_and_its_poq_count_on_over_midnight(tmp_path, unit, period):
    "Seconds of the day start again, too: Saturday's 86 400 s are followed by Sunday's"
    whole, _ = over_week_end()
    own = with_times(whole, whole.gps_time % period)
    (tmp_path / "a.pof").write_bytes(pof_bytes(own, CRS, day=SATURDAY, unit=unit))
    (tmp_path / "a.poq").write_bytes(poq_bytes(own))
    read = read_trajectory(tmp_path / "a.pof", CRS, tmp_path / "a.poq")
    assert np.abs(read.gps_time - whole.gps_time).max() < 1e-6
    assert np.abs(read.position_sigma - whole.position_sigma).max() < 1e-6


def test_a_gnss_path_counts_on(tmp_path):
    "A .pos for the simulator lasts 2 s over the end of the week"
    rows = [f"{t} 30.46 114.4{n} 20.0" for n, t in enumerate((604_799.0, 0.0, 1.0))]
    (tmp_path / "a.pos").write_text("\n".join(rows))
    assert read_poses(tmp_path / "a.pos").gps_time.tolist() == [WEEK - 1.0, WEEK, WEEK + 1.0]


def test_a_cloud_counts_on_with_its_trajectory(tmp_path):
    "Trajectory and cloud start again: all is placed, and notes name the epoch and the seconds"
    (tmp_path / "survey.toml").write_text(TOML)
    (tmp_path / "control.csv").write_text(CONTROL)
    counted = WEEK - 15.0 + 0.05 * np.arange(800)
    table = np.tile([0.0, 532_000.0, 3_374_000.0, 42.0, 0.1, -0.2, 90.0], (800, 1))
    table[:, 0] = counted % WEEK
    table[:, 1] = 532_000.0 + 5.0 * (counted - counted[0])
    csv(tmp_path / "trajectory.csv", table)
    times = np.linspace(WEEK - 5.0, WEEK + 10.0, 301)
    write_las(tmp_path / "pass-1.las", times % WEEK)
    write_las(tmp_path / "pass-2.las", np.linspace(15.0, 20.0, 20))
    survey = read_survey(tmp_path)
    assert np.abs(survey.trajectory.gps_time - counted).max() < 1e-6
    first, second = survey.clouds
    assert np.abs(first.trajectory_time(times % WEEK) - times).max() < 1e-6
    assert (second.time_constant, second.new_week) == (WEEK, -np.inf)
    said = " ".join(survey.notes)
    assert "The GPS week ends before epoch 301 of trajectory.csv (0.000 s)" in said
    assert "pass-1.las" in said and "604800 s are added after the rollover" in said


def test_a_heading_keeps_its_epoch(tmp_path):
    "The heading of the first epoch of the new week is that of its row: 1e-6 deg"
    whole, own = over_week_end()
    read = read_trajectory(csv(tmp_path / "a.csv", np.column_stack([own, table_of(whole)[:, 1:]])))
    heading = angles_from_attitude(read.at([WEEK]).attitude)[2]
    true = angles_from_attitude(whole.at([WEEK]).attitude)[2]
    assert np.degrees(heading - true) == pytest.approx(0.0, abs=1e-6)
