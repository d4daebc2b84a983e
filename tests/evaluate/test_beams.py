"""Clouds that the vehicle can't have measured at the times that they state."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate import BeamCheck
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import read_chunks
from mlscorr.io.surveys import read_survey
from mlscorr.survey import PointCloud, Trajectory


@pytest.fixture(scope="module")
def survey(street):
    return read_survey(street)


def said(survey, change=lambda cloud: cloud):
    "Doubts about a street whose chunks are changed"
    check = BeamCheck(survey)
    read = check.watched(lambda file: (change(chunk) for chunk in read_chunks(file, 20_000)))
    for file in survey.clouds:
        for _ in read(file):
            pass
    return list(check.doubts())


def backwards(cloud):
    # s
    first = 357_700.0
    last = 357_708.0
    return PointCloud(cloud.xyz, first + last - cloud.gps_time, cloud.intensity)


def turned(cloud):
    "The street of another survey: turned about where the vehicle is half way"
    middle = cloud.xyz.mean(axis=0)
    across = (cloud.xyz - middle) @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return PointCloud(middle + across, cloud.gps_time, cloud.intensity)


def test_a_good_cloud_hears_nothing(survey):
    "Points lie in the scan plane, near the trajectory, in order of time; without a mounting too"
    assert said(survey) == said(replace(survey, mounting=None)) == []


def test_samples_hold_no_chunk(survey):
    "A view of a chunk's times would hold them all: 8 B for each point of a file of any size"
    check = BeamCheck(survey)
    for _ in check.watched(read_chunks)(survey.clouds[0]):
        pass
    assert all(times.base is None for times in check.times[survey.clouds[0]])


def test_times_that_run_backwards_are_named(survey):
    "No sampled point is later than the one before, and the scan plane is missed"
    doubt = said(survey, backwards)[0]
    assert (doubt.key, doubt.values["file"]) == ("backwards", "pass-1.laz")


def test_a_tile_of_another_survey_is_named(survey):
    "The same times, another street: points lie beside the scan plane, by more than its limit"
    (doubt,) = said(survey, turned)
    assert doubt.key == "other survey"
    assert doubt.values["off"] > doubt.values["off_plane"]


def test_a_tile_of_another_town_is_named_without_a_mounting(survey):
    "Points kilometres beside the trajectory were not measured from it"
    far = [3e3, 0.0, 0.0]  # m

    def moved(cloud):
        return PointCloud(cloud.xyz + far, cloud.gps_time, cloud.intensity)

    (doubt,) = said(replace(survey, mounting=None), moved)
    assert doubt.key == "other survey"
    assert doubt.values["beside"] == pytest.approx(3000.0, abs=1.5)


def clocks(survey, late, beam=((0.0, -8.0), (0.0, 8.0)), speed=5.0, start=357_700.0, system="week"):
    "Doubts where the trajectory's times are late (s), and beams go ahead and to the left (m)"
    times = np.linspace(0.0, 100.0, 1001)  # s
    path = np.outer(speed * times, [1.0, 0.0, 0.0])
    level = attitude_from_angles(np.zeros(len(times)), 0.0, 0.0)
    trajectory = Trajectory(start + late + times, path, level)
    seen = times[200:800]
    ahead, left = np.resize(beam, (len(seen), 2)).T
    xyz = np.column_stack([speed * seen + ahead, left, np.zeros(len(seen))])
    cloud = PointCloud(xyz, start + seen, np.zeros(len(seen), np.uint16))
    file = replace(survey.clouds[0], time_constant=0.0, time_system=system)
    check = BeamCheck(replace(survey, trajectory=trajectory, clouds=(file,), mounting=None))
    list(check.watched(lambda _: [cloud])(file))
    return list(check.doubts())


def test_a_trajectory_in_utc_is_named_with_the_seconds_and_both_distances(survey):
    "Points 8 m beside the vehicle lie 90 m behind it where its times are 18 s early"
    (doubt,) = clocks(survey, -18.0)
    assert (doubt.key, doubt.values["lag"], doubt.values["later"]) == ("other clock", 18, -18)
    assert doubt.values["beside"] == pytest.approx(90.0, abs=0.5)
    assert doubt.values["shifted"] == pytest.approx(8.0, abs=0.5)


def test_a_cloud_in_utc_is_named_by_the_leap_seconds_of_its_day(survey):
    "On a day of 2016 both were 17 s apart; a trajectory of GPS seconds tells the day"
    (doubt,) = clocks(survey, 17.0, start=1_150_000_000.0, system="gps")
    assert (doubt.key, doubt.values["lag"], doubt.values["later"]) == ("other clock", 17, 17)


def test_a_right_clock_or_a_slow_vehicle_hears_nothing_of_leap_seconds(survey):
    "Half a metre a second tells nothing; a boat may look where it is 18 s later"
    assert clocks(survey, 0.0) == []
    assert clocks(survey, -18.0, speed=0.5) == clocks(survey, 18.0, speed=0.5) == []
    assert clocks(survey, 0.0, beam=((20.0, 28.0), (22.0, 30.0)), speed=1.1) == []
    assert clocks(survey, 0.0, beam=((5.0, 1.0), (20.0, 4.0), (45.0, 9.0)), speed=1.1) == []
