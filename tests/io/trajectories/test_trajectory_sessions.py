"""Several trajectories of one survey: joined in order of time, or refused with both names."""

import re
import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.effects import make_effect
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import read_chunks
from mlscorr.io.surveys import read_survey
from mlscorr.io.trajectories import join_sessions, read_trajectory, write_trajectory_csv
from mlscorr.survey import Pos, Trajectory
from tests.io.surveys.test_survey_file import CONTROL, TOML, write_las
from tests.pipeline.test_starting import write_sbet

# s, m
START = 413_200.0
CORNER = np.array([532_000.0, 3_374_000.0, 42.0])
NAMES = ["run-1.csv", "run-2.csv", "run-3.csv"]


def drive(start, seconds=10.0, step=0.05, aside=0.0, sigma=None, turned=0.0):
    "5 m/s to the east from a second, as if it were part of one drive, perhaps some way aside"
    time = START + start + step * np.arange(round(seconds / step))
    position = CORNER + np.outer(time - START, [5.0, 0.0, 0.0]) + [0.0, aside, 0.0]
    heading = np.full(len(time), np.radians(90.0 + turned))
    if sigma is None:
        sigma = None
    else:
        sigma = np.full((len(time), 3), sigma)
    return Trajectory(time, position, attitude_from_angles(0.0, 0.0, heading), sigma)


def rows_of(trajectory, rows):
    "Part of a trajectory"
    pose = (trajectory.gps_time, trajectory.position, trajectory.attitude)
    return Trajectory(*(values[rows] for values in pose))


def joined(*parts):
    return join_sessions(NAMES[: len(parts)], parts, Pos())


def test_sessions_after_each_other_are_the_trajectory_that_was_cut():
    "Three runs with pauses, given in any order, are bit for bit the one that they were cut of"
    parts = drive(0.0), drive(20.0), drive(60.0)
    whole, notes = joined(parts[2], parts[0], parts[1])
    assert whole.session is None and notes == []
    assert np.array_equal(whole.gps_time, np.concatenate([p.gps_time for p in parts]))
    assert np.array_equal(whole.position, np.concatenate([p.position for p in parts]))
    assert whole.attitude.as_quat() == pytest.approx(
        np.concatenate([p.attitude.as_quat() for p in parts]), abs=0
    )
    assert len(whole.passes) == 3


def test_a_session_that_begins_at_the_next_epoch_begins_a_pass():
    "Nothing is interpolated from one to the next, be it 50 ms later; points between have no pose"
    whole, _ = joined(drive(0.0), drive(10.0))
    assert whole.gaps == pytest.approx(START + np.array([[9.95, 10.0]]))
    assert whole.segment(START + np.array([9.95, 9.97, 10.0])).tolist() == [0, -1, 1]
    with pytest.raises(ValueError, match="in one of its 1 gaps"):
        whole.at(START + 9.97)


def test_each_session_has_its_own_rate():
    "Beside 200 Hz an export of 1 Hz is no row of gaps, and a pause of either is one"
    slow = rows_of(drive(40.0, 60.0, 1.0), np.r_[0:20, 40:60])
    whole, _ = joined(drive(0.0, 30.0, 0.005), slow)
    assert whole.passes - START == pytest.approx(
        np.array([[0.0, 29.995], [40.0, 59.0], [80.0, 99.0]])
    )
    steps = Trajectory(whole.gps_time, whole.position, whole.attitude)
    assert len(steps.passes) == 41  # by the steps alone each second is a gap


def test_sessions_outlive_the_file(tmp_path):
    "trajectory.csv keeps in its column session what its steps don't tell"
    whole, _ = joined(drive(0.0, sigma=0.01), drive(10.0, sigma=0.02))
    write_trajectory_csv(tmp_path / "trajectory.csv", whole)
    again = read_trajectory(tmp_path / "trajectory.csv")
    assert np.array_equal(again.session, whole.session)
    assert np.array_equal(again.passes, whole.passes)
    once_more, _ = joined(again, replace(drive(20.0), position_sigma=np.full((200, 3), 0.1)))
    assert len(once_more.passes) == 3


def test_an_export_that_was_cut_with_an_overlap_goes_on():
    "Epochs that two files have in common are taken once, and are no gap; a note says so"
    one = drive(0.0, 20.0)
    for end in (390, 351):  # 2 s in common, and one epoch
        whole, notes = joined(rows_of(one, slice(350, None)), rows_of(one, slice(0, end)))
        assert whole.session is None and len(whole.gaps) == 0
        assert np.array_equal(whole.gps_time, one.gps_time)
        assert np.array_equal(whole.position, one.position)
        assert f"{end - 350} epochs of run-1.csv overlap run-2.csv and are identical" in notes[0]


def test_two_solutions_that_agree_are_used_once_and_part():
    "2 cm apart where each states 2 cm: the first counts where both are, and a gap follows"
    whole, notes = joined(drive(0.0, 10.0), drive(8.0, 10.0, aside=0.02))
    assert whole.gaps == pytest.approx(START + np.array([[9.95, 10.0]]))
    assert "40 epochs of run-2.csv overlap run-1.csv and are equal within their sigmas" in notes[0]
    aside = whole.position[:, 1] - CORNER[1]
    assert np.array_equal(aside > 0.01, whole.gps_time > START + 9.97)


def test_one_within_another_adds_nothing():
    "An excerpt beside its trajectory changes no epoch"
    whole, _ = joined(drive(0.0, 20.0), rows_of(drive(0.0, 20.0), slice(100, 200)))
    assert np.array_equal(whole.position, drive(0.0, 20.0).position)
    assert len(whole.gaps) == 0


@pytest.mark.parametrize("change", [{"aside": 3.0}, {"turned": 1.0}])
def test_two_vehicles_are_refused(change):
    "Both files, the seconds that they overlap and by how much they differ are named"
    with pytest.raises(ValueError) as error:
        joined(drive(0.0, 10.0), drive(8.0, 10.0, **change))
    if "aside" in change:
        apart = "differ by 3.000 m"
    else:
        apart = "0.000 m and 1.0000 deg"
    for words in (
        "run-1.csv and run-2.csv overlap by 2.0 s",
        apart,
        "sigmas are 0.049 m",
        "two surveys",
    ):
        assert re.search(words, str(error.value)), error.value


# ---- files


@pytest.fixture
def folder(tmp_path):
    "A survey of two runs of 15 s with a pause of 5 s, a cloud of each"
    runs = "".join(f'[[trajectory]]\nfile = "run-{n}.csv"\n\n' for n in (2, 1))
    old = '[trajectory]\nfile = "trajectory.csv"\n\n'
    assert old in TOML
    (tmp_path / "survey.toml").write_text(TOML.replace(old, runs))
    (tmp_path / "control.csv").write_text(CONTROL)
    for number, start in ((1, 0.0), (2, 20.0)):
        write_trajectory_csv(tmp_path / f"run-{number}.csv", drive(start, 15.0))
        times = START + start + np.linspace(1.0, 14.0, 100)
        write_las(tmp_path / f"pass-{number}.las", times)
    return tmp_path


def change(folder, old, new):
    text = (folder / "survey.toml").read_text()
    assert old in text
    (folder / "survey.toml").write_text(text.replace(old, new))


def test_a_survey_of_two_trajectories_is_that_of_one(folder):
    "Nouns are the same as with both in one file; both are inputs, and a note says how they lie"
    survey = read_survey(folder)
    whole, _ = joined(drive(0.0, 15.0), drive(20.0, 15.0))
    write_trajectory_csv(folder / "whole.csv", whole)
    expected = read_trajectory(folder / "whole.csv")
    assert np.array_equal(survey.trajectory.gps_time, expected.gps_time)
    assert np.array_equal(survey.trajectory.position, expected.position)
    assert np.array_equal(survey.trajectory.passes, expected.passes)
    read = [file.path.name for file in survey.inputs if file.what == "trajectory"]
    assert read == ["run-2.csv", "run-1.csv"]
    assert (
        "joined from 2 files in time order (run-1.csv [413200.000, 413214.950] s, run-2"
        in (survey.notes[1])
    )


def test_what_is_added_to_times_is_noted(folder):
    "18 s of one of two trajectories are said with its name, and that what is written has them"
    assert not any("time_constant" in note for note in read_survey(folder).notes)
    late = replace(drive(20.0, 15.0), gps_time=drive(20.0, 15.0).gps_time - 18.0)
    write_trajectory_csv(folder / "run-2.csv", late)
    change(folder, '"run-2.csv"', '"run-2.csv"\ntime_constant = 18.0')
    (note,) = (note for note in read_survey(folder).notes if "time_constant" in note)
    assert note.startswith("+18 s (trajectory.time_constant) were added to the times of run-2.csv;")


def test_an_sbet_may_stand_beside_a_table(folder):
    "Each is read as it would be alone: latitudes projected, map coordinates as they are"
    (folder / "run-2.csv").unlink()
    write_sbet(folder / "second.out", START + 16.0)
    change(folder, '"run-2.csv"', '"second.out"\nfiles = ["pass-2.las"]')
    survey = read_survey(folder)
    assert len(survey.trajectory.passes) == 2
    second = survey.trajectory.gps_time > START + 15.5
    along = survey.trajectory.position[second, 0] - CORNER[0]
    assert along == pytest.approx(
        5.0 * (survey.trajectory.gps_time[second] - START - 16.0), abs=1e-3
    )
    assert any("ellipsoid" in note for note in survey.notes)


def test_trajectories_of_two_time_systems_are_refused(folder):
    "Seconds of week beside adjusted standard GPS time: both are named"
    other = replace(drive(20.0, 15.0), gps_time=drive(20.0, 15.0).gps_time + 604_800 * 2300 - 1e9)
    write_trajectory_csv(folder / "run-2.csv", other)
    with pytest.raises(ValueError, match=r"run-1\.csv .* adjusted standard|run-2\.csv .* adjusted"):
        read_survey(folder)
    faults = mlscorr.check(folder).faults
    assert any("one time system" in fault.sentence for fault in faults)


def test_seconds_of_week_may_start_again_between_two(folder):
    "Saturday night, then Sunday morning, a week later: each cloud finds its run, and all is said"
    # s, added to each run
    late = 604_000.0 - START
    early = 100.0 - START - 20.0
    week = 604_800.0 * 2300 - 1e9
    for number, start, added, weeks in ((1, 0.0, late, 0), (2, 20.0, early, 1)):
        run = drive(start, 15.0)
        write_trajectory_csv(
            folder / f"run-{number}.csv", replace(run, gps_time=run.gps_time + added)
        )
        times = START + start + np.linspace(1.0, 14.0, 100) + added + week + weeks * 604_800.0
        write_las(folder / f"pass-{number}.las", times, is_standard=True)
    survey = read_survey(folder)
    assert len(survey.trajectory.passes) == 2
    for cloud, run in zip(survey.clouds, (0, 1), strict=True):
        chunk = next(read_chunks(cloud))
        assert (survey.trajectory.segment(chunk.gps_time) == run).all()
    assert survey.trajectory.gps_time[-1] == pytest.approx(604_800.0 + 114.95, abs=1e-6)
    assert any(
        "The GPS week ends before epoch 1 of run-2.csv (100.000 s)" in n for n in survey.notes
    )
    write_trajectory_csv(folder / "again.csv", survey.trajectory)
    own = np.loadtxt(folder / "again.csv", delimiter=",", skiprows=1)[:, 0]
    assert own[[0, -1]] == pytest.approx([604_000.0, 114.95], abs=1e-6)
    assert np.array_equal(read_trajectory(folder / "again.csv").weeks, survey.trajectory.weeks)


def test_sigmas_that_one_lacks_are_those_of_pos_or_asked_for(folder):
    "With [pos] the run without sigmas has these; without it a sentence says what to add"
    write_trajectory_csv(folder / "run-1.csv", drive(0.0, 15.0, sigma=0.03))
    with pytest.raises(ValueError, match=r"1 of the 2 .* no sigma of position \(run-2\.csv\)"):
        read_survey(folder)
    change(folder, "[control]", "[pos]\nposition_sigma = 0.5\n[control]")
    survey = read_survey(folder)
    first = survey.trajectory.gps_time < START + 17.0
    assert survey.trajectory.position_sigma[first] == pytest.approx(0.03)
    assert survey.trajectory.position_sigma[~first] == pytest.approx(0.5)
    assert survey.trajectory.attitude_sigma is None
    assert any("run-2.csv has no sigma" in note for note in survey.notes)


def test_points_that_belong_to_a_trajectory_lie_within_it(folder):
    "files and point_source_ids that are right say nothing; a file under the wrong run is refused"
    one = '"run-1.csv"'
    other = '"run-2.csv"'
    change(folder, one, f'{one}\nfiles = ["pass-1.*"]\npoint_source_ids = [0]')
    change(folder, other, f'{other}\nfiles = ["pass-2.las"]')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_survey(folder)
    change(folder, '"pass-2.las"', '"pass-1.las", "pass-2.las"')  # of both: the time tells
    read_survey(folder)
    change(folder, '["pass-1.*"]', '["pass-2.las"]')
    change(folder, '["pass-1.las", "pass-2.las"]', '["pass-1.las"]')
    message = r"65 of 65 points sampled from pass-1\.las.*outside run-2\.csv,"
    with pytest.raises(ValueError, match=message):
        read_survey(folder)
    assert any("outside run-2.csv" in fault.sentence for fault in mlscorr.check(folder).faults)


def test_some_points_outside_their_trajectory_are_warned_of(folder):
    "A cloud that goes on into the next run: they are counted, and that run is taken"
    write_las(folder / "pass-1.las", START + np.linspace(1.0, 22.0, 100))
    change(folder, '"run-1.csv"', '"run-1.csv"\npoint_source_ids = [0, 7]\nfiles = ["pass-1.las"]')
    with pytest.warns(UserWarning, match=r"of 65 points.*outside run-1\.csv"):
        read_survey(folder)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"run-1.csv"', '"./run-2.csv"', r"2 of the .* name the file .*run-2"),
        ('"run-1.csv"', '"run-7.csv"', r"trajectory\.file of .* names .*run-7\.csv, which"),
        ('"run-1.csv"', '"run-1.csv"\nfiles = ["control.csv"]', r"control\.csv is not among the 2"),
        ('"run-1.csv"', '"run-1.csv"\npoint_source_ids = [70000]', r"1\.point_source_ids\.0 = 700"),
        ('"run-1.csv"', '"run-1.csv"\nfile_s = []', r"\.1\.file_s .* is trajectory\.file"),
        ("[control]", "[[trajectory]]\n[control]", r"trajectory\.2\.file is missing"),
    ],
)
def test_wrong_keys_of_several_trajectories_are_named(folder, old, new, message):
    "Doubled, missing, unknown: a sentence each, and check says the same"
    change(folder, old, new)
    with pytest.raises((ValueError, FileNotFoundError), match=message):
        read_survey(folder)
    assert any(re.search(message, fault.sentence) for fault in mlscorr.check(folder).faults)


def test_keys_of_several_do_not_stand_in_a_single_trajectory(folder):
    "[trajectory] with files is refused with advice to write [[trajectory]]"
    text = TOML.replace('"trajectory.csv"', '"run-1.csv"\nfiles = ["pass-1.las"]')
    (folder / "survey.toml").write_text(text)
    with pytest.raises(ValueError, match=r"write \[\[trajectory\]\], not \[trajectory\]"):
        read_survey(folder)


def test_a_copied_survey_names_the_same_trajectories(folder):
    "apply writes clouds and survey.toml into a folder; a clock joins the runs in one file"
    change(folder, '"run-1.csv"', '"run-1.csv"\nfiles = ["pass-1.*"]')
    with (folder / "survey.toml").open("a") as described:
        described.write("[mounting]\nlever_arm = [0.1, -0.6, 0.4]\nboresight = [90.0, 0, 35.0]\n")
    survey = read_survey(folder)
    moved = make_effect("boresight", magnitude=[0.1, 0.0, 0.0])
    mlscorr.apply(survey, [moved]).write(folder / "turned")
    document = tomllib.loads((folder / "turned" / "survey.toml").read_text())
    assert [entry["file"] for entry in document["trajectory"]] == ["../run-2.csv", "../run-1.csv"]
    assert document["trajectory"][1]["files"] == ["pass-1.las"]
    again = read_survey(folder / "turned")
    assert np.array_equal(again.trajectory.gps_time, survey.trajectory.gps_time)
    late = make_effect("time_offset", magnitude=0.2)
    mlscorr.apply(survey, [late]).write(folder / "late")
    document = tomllib.loads((folder / "late" / "survey.toml").read_text())
    assert document["trajectory"] == {"file": "trajectory.csv"}
    assert len(read_survey(folder / "late").trajectory.passes) == 2
