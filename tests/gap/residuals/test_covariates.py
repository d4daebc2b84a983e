"""Covariates say when, where and how a thing was seen."""

import numpy as np

from mlscorr.gap.residuals import scanner_origin
from mlscorr.gap.residuals.rows import to_scanner_or_nan


def test_covariates_are_those_of_the_drive(survey, pairing):
    "Speeds to 0.3 m/s, the two headings 180 deg apart, ranges of a street, passes one and two"
    covariates = pairing.rows.covariates
    trajectory = survey.trajectory
    speed = np.gradient(trajectory.position, trajectory.gps_time, axis=0)
    speed = np.interp(pairing.rows.gps_time, trajectory.gps_time, np.linalg.norm(speed, axis=1))
    assert np.median(np.abs(covariates["speed"] - speed)) < 0.3
    heading = [np.median(covariates["heading"][covariates["pass"] == n]) for n in (1, 2)]
    assert np.cos(heading[0] - heading[1]) < -0.99
    assert 1.0 < np.median(covariates["range"]) < 40.0
    assert set(covariates["pass"]) == {1.0, 2.0}


def test_points_lie_where_the_scanner_saw_them(survey, pairing):
    "Distance from the origin is the length of scanner coordinates, to a micrometre"
    pulses = pairing.rows.pulses
    away = np.linalg.norm(pulses.xyz - scanner_origin(survey, pulses.gps_time), axis=1)
    length = np.linalg.norm(to_scanner_or_nan(survey, pulses.xyz, pulses.gps_time), axis=1)
    np.testing.assert_allclose(length, away, atol=1e-6)
