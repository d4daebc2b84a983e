"""Best position of the next control point, and the sigma it is promised to give."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from mlscorr.estimate import estimate_correction, place_control, predict_accuracy
from mlscorr.estimate.placement import _reason
from tests.estimate.test_outages import BELIEVED, START, TIME, survey

GAPPED = np.concatenate([np.linspace(4.0, 76.0, 10), np.linspace(164.0, 236.0, 10)])  # s


def slow_error(seed):
    "An error of decimetres that changes over half a minute"
    wave = np.random.default_rng(seed).uniform(0, 6, 3)
    return 0.3 * np.sin(TIME[:, None] / [23.0, 29.0, 31.0] + wave)


@pytest.mark.parametrize(
    ("share", "words"),
    [((0.035, 0.04), "4.0 % of the drive, up from 3.5 %"), ((0.01, 0.01), "as bef")],
)
def test_a_gain_of_half_a_percent_is_told(share, words):
    "From 3.5 to 4.0 % is no 4 % instead of 4 %, and what stays is said to"
    why = _reason(np.array([10.0]), np.array(["T07"]), 35.0, (0.05, 0.04), share, 0.013, 1)
    assert words in why and why.startswith("After the last control point, T07, by 25 s")


@pytest.fixture(scope="module")
def gapped():
    "An estimate of a drive that has no control from 76 to 164 s"
    rng = np.random.default_rng(5)
    trajectory, matched = survey(rng, slow_error(5), GAPPED)
    return estimate_correction(trajectory, matched, BELIEVED)


def test_the_first_place_lies_in_the_gap_of_control(gapped):
    "It lies in the middle half of the gap, where the sigma falls at least to a half"
    first, *others = place_control(gapped)
    assert 98.0 < first.gps_time - START < 142.0
    assert first.sigma_after < 0.5 * first.sigma_before
    assert first.drive_after < first.drive_before
    assert first.share_after >= first.share_before
    assert len(others) == 2
    assert others[0].drive_before == first.drive_after
    assert "Between T09" in first.why and "and T10" in first.why


def test_places_are_the_same_with_any_number_of_threads(gapped):
    "Every digit of them by one thread of BLAS and by four"
    places = []
    for number in (1, 4):
        with threadpool_limits(number, user_api="blas"):
            places.append(place_control(gapped))
    assert places[0] == places[1]


@pytest.mark.long
def test_a_target_there_gives_the_sigma_that_was_promised(gapped):
    "A new estimate with a target at the first place has its sigmas, there and all along, to 10 %"
    first = place_control(gapped)[0]
    error = slow_error(5)
    times = np.sort(np.append(GAPPED, first.gps_time - START))
    trajectory, matched = survey(np.random.default_rng(5), error, times)
    sigma = estimate_correction(trajectory, matched, BELIEVED).correction.corrected.position_sigma
    total = np.linalg.norm(sigma, axis=1)
    there = np.interp(first.gps_time, trajectory.gps_time, total)
    assert abs(there / first.sigma_after - 1) < 0.1
    assert abs(np.sqrt(np.mean(total**2)) / first.drive_after - 1) < 0.1


def test_plates_that_face_three_ways_give_a_usual_target_too(gapped):
    "Medians of their covariances, element by element, are none: a place is found all the same"
    correlations = np.array([[0.9, 0.9, 0.7], [0.9, -0.7, -0.9], [-0.7, 0.9, -0.9]])
    n = len(gapped.adjustment.names)
    targets = gapped.adjustment.targets
    own = targets.noise.own.copy()
    for row, (en, eh, nh) in enumerate(correlations[np.arange(n) % 3]):
        own[row] = 0.004**2 * np.array([[1.0, en, eh], [en, 1.0, nh], [eh, nh, 1.0]])
    assert np.linalg.eigvalsh(np.median(own, axis=0))[0] < 0.0
    plates = replace(targets, noise=replace(targets.noise, own=own))
    first = place_control(replace(gapped, adjustment=gapped.adjustment.with_factor(plates)))[0]
    assert 98.0 < first.gps_time - START < 142.0


def test_a_plan_sees_the_gap_before_anyone_drives():
    "By the believed POS and the planned control alone the sigma is largest in the gap"
    trajectory, matched = survey(np.random.default_rng(1), 0.0 * slow_error(0), GAPPED)
    planned = predict_accuracy(trajectory, matched, BELIEVED)
    worst = planned.gps_time[np.argmax(planned.sigma)] - START
    assert 98.0 < worst < 142.0
    assert 98.0 < planned.next_control[0].gps_time - START < 142.0
