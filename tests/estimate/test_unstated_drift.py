"""Neighbours that deviate together tell of drift; a lone one of a blunder."""

import numpy as np
import pytest

from mlscorr.estimate import estimate_correction
from mlscorr.estimate.judgement import UnstatedDrift, with_drifts
from mlscorr.survey import Matched, Trajectory
from tests.beds.discs import observed_discs
from tests.beds.pos_errors import EPOCHS, NOISE, START, Case, even, outage, rms

DRIFT = UnstatedDrift(START + 50.0, START + 90.0, 0.4, False, ("T05", "T06"))


def smoothed_case(seed, stated=0.02):
    "A smoothed outage of decimetres that the POS does not state"
    rng = np.random.default_rng(seed)
    error, sigma = outage(rng)
    return Case(EPOCHS, error, even(20), rng, np.full_like(sigma, stated)), error


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 8])
def test_a_run_of_neighbours_is_drift(seed):
    "Five control points in an unstated outage are used, not rejected; 5 % of the error is left"
    case, error = smoothed_case(seed)
    estimate = case.estimate()
    assert not estimate.outliers
    assert rms(case.remaining(estimate)) < 0.05 * rms(error)
    assert "unstated drift" in [warning.key for warning in estimate.statements]


def seen_again(case, bump):
    """The drive of a case, driven again after 100 s with another error of centimetres, and all its
    targets seen again: Trajectory, Matched and true - recorded position (n, 3). The first time it
    lacks a bump (n, 3), too.
    """
    rng = np.random.default_rng(5)
    pause = EPOCHS[-1] + 100.0
    first = case.true.position - case.recorded.position
    error = np.concatenate([first + bump, 0.7 * first[:, [1, 2, 0]]])
    true = case.true.select(np.tile(np.arange(len(EPOCHS)), 2))
    time = np.concatenate([case.true.gps_time, case.true.gps_time + pause])
    drive = Trajectory(time, true.position - error, true.attitude, np.full((len(time), 3), 0.02))
    times = np.concatenate([case.observations.gps_time, case.observations.gps_time + pause])
    lacking = np.column_stack([np.interp(times, time, axis) for axis in error.T])
    place = case.true.at(case.observations.gps_time).position
    body = np.tile(
        case.observations.position - case.recorded.at(times[: len(place)]).position, (2, 1)
    )
    place = np.tile(place, (2, 1)) + body - lacking + NOISE * rng.normal(size=body.shape)
    number = np.repeat([1, 2], len(case.control))
    seen = observed_discs(2 * case.control.name, times, place, NOISE, pass_number=number)
    return drive, Matched.by_name(seen, case.control), error


def centimetres(seed):
    rng = np.random.default_rng(seed)
    error = 0.015 * np.sin(EPOCHS[:, None] / [40.0, 61.0, 77.0] + rng.uniform(0, 6, 3))
    return Case(EPOCHS, error, even(14), rng)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_what_two_passes_see_alike_is_no_drift(seed):
    """Three neighbours that one setup of the instrument put 0.18 m off take no part where a second
    pass sees them as far off the same way, and the drive is right to millimetres.
    """
    case = centimetres(seed)
    for number, vector in zip(
        (5, 6, 7), ([0.16, -0.1, 0.05], [0.15, -0.09, 0.06], [0.14, -0.1, 0.05]), strict=True
    ):
        case.spoil(number, np.array(vector))
    drive, matched, error = seen_again(case, 0.0)
    estimate = estimate_correction(drive, matched)
    assert {outlier.name for outlier in estimate.outliers} == {"T06", "T07", "T08"}
    left = error - (estimate.correction.corrected.position - drive.position)
    assert rms(left) < 0.008  # m


@pytest.mark.long
def test_what_one_of_two_passes_sees_is_drift():
    "A POS that swings out by 0.3 m on the first pass alone is followed there to a centimetre"
    bump = np.sin(np.pi * np.clip((EPOCHS - 70.0) / 60.0, 0, 1))[:, None] ** 2 * [0.3, -0.2, 0.15]
    drive, matched, error = seen_again(centimetres(1), bump)
    estimate = estimate_correction(drive, matched)
    assert not estimate.outliers
    left = error - (estimate.correction.corrected.position - drive.position)
    assert rms(left) < 0.01 and rms(error) > 0.05  # m


@pytest.mark.long
def test_a_lone_blunder_stays_an_outlier():
    "One control point wrong by 0.4 m beside the outage is still named, and nothing else"
    case, error = smoothed_case(1)
    case.spoil(16, [0.3, 0.2, -0.3])
    estimate = case.estimate()
    assert [outlier.name for outlier in estimate.outliers] == ["T17"]
    assert rms(case.remaining(estimate)) < 0.05 * rms(error)


def test_an_unstated_drift_is_constrained_at_its_ends():
    "Its whole size in the middle, nothing outside; open at the end it grows up to it"
    course = DRIFT.course(START + np.array([40.0, 50.0, 70.0, 90.0, 95.0]))
    assert course == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0])
    free = UnstatedDrift(START + 50.0, START + 90.0, 0.4, True, ("T05",))
    assert free.course(START + np.array([50.0, 90.0])) == pytest.approx([0.0, 1.0])


def test_unstated_drift_adds_to_what_is_stated():
    "Variances add, also where the trajectory states nothing at all"
    case, _ = smoothed_case(1, 0.03)
    raised = with_drifts(case.recorded, (DRIFT,)).position_sigma
    middle = np.searchsorted(EPOCHS, 70.0)
    assert raised[middle] == pytest.approx(np.hypot(0.03, 0.4))  # m
    assert raised[0] == pytest.approx(0.03)
