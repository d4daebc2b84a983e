"""Clouds that the vehicle can't have measured at the times that they state."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate.beams import BeamCheck
from mlscorr.io.las import read_chunks
from mlscorr.io.survey_file import read_survey
from mlscorr.survey import PointCloud


@pytest.fixture(scope="module")
def survey(street):
    return read_survey(street)


def said(survey, change=lambda cloud: cloud):
    "Warnings on a street whose chunks are changed"
    check = BeamCheck(survey)
    read = check.watched(lambda file: (change(chunk) for chunk in read_chunks(file, 20_000)))
    for file in survey.clouds:
        for _ in read(file):
            pass
    return list(check.warnings())


def backwards(cloud):
    first, last = 357_700.0, 357_708.0  # s
    return PointCloud(cloud.xyz, first + last - cloud.gps_time, cloud.intensity)


def turned(cloud):
    "The street of another survey: turned about where the vehicle is half way"
    middle = cloud.xyz.mean(axis=0)
    across = (cloud.xyz - middle) @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return PointCloud(middle + across, cloud.gps_time, cloud.intensity)


def test_a_good_cloud_hears_nothing(survey):
    "Points lie in the scan plane, near the trajectory, in order of time; without a mounting too"
    assert said(survey) == said(replace(survey, mounting=None)) == []


def test_times_that_run_backwards_are_named(survey):
    "No sampled point is later than the one before, and the scan plane is missed"
    sentences = said(survey, backwards)
    assert "pass-1.laz run backwards" in sentences[0]


def test_a_tile_of_another_survey_is_named(survey):
    "The same times, another street: points lie beside the scan plane; UTC is a likely cause, too"
    (sentence,) = said(survey, turned)
    assert "UTC is 18 s late" in sentence and "not in m and deg" in sentence
    assert "off the scan plane" in sentence and "another survey with the same times" in sentence


def test_a_tile_of_another_town_is_named_without_a_mounting(survey):
    "Points kilometres beside the trajectory were not measured from it"
    far = [3e3, 0.0, 0.0]  # m

    def moved(cloud):
        return PointCloud(cloud.xyz + far, cloud.gps_time, cloud.intensity)

    (sentence,) = said(replace(survey, mounting=None), moved)
    assert "pass-1.laz lie 3" in sentence and "m beside the trajectory" in sentence
