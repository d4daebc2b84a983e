"""Two scanners of a vehicle that see the same things, one a little after the other."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import (
    corrected_mounting,
    estimate_correction,
    place_control,
    scanner_warnings,
    with_ties,
)
from mlscorr.frames import georeferenced_anew
from mlscorr.survey import Mounting
from tests.beds.tied_passes import LENGTH, NOISE, ORIGIN, SPEED, START, drift, tied_passes

pytestmark = pytest.mark.long

SEED = 3
NUMBER = 600
ARM = np.array([0.1, -0.6, 0.4])  # m
LEFT, RIGHT = (Mounting(ARM, Rotation.from_euler("Z", a, degrees=True)) for a in (35, -35))
LACKS = np.append([0.01, -0.02, 0.015], np.radians([0.1, -0.05, 0.15]))  # m, rad


def seen_twice(survey, lacks, scanners=(0, 1)):
    "Ties of the first pass by two scanners or one, 0.5 to 2 s apart; the last lacks something"
    rng = np.random.default_rng(SEED)
    first = rng.uniform(2.0, LENGTH - 4.0, NUMBER)
    times = START + np.column_stack([first, first + rng.uniform(0.5, 2.0, NUMBER)])
    across = rng.choice([-1, 1], NUMBER) * rng.uniform(4, 15, NUMBER)
    place = np.column_stack([SPEED * first, across, 5 * rng.random(NUMBER)])
    normal = np.eye(3)[rng.integers(3, size=NUMBER)]
    views = np.stack([ORIGIN + place - drift(t - START, SEED) for t in times.T], axis=1)
    recorded = (LEFT, RIGHT)[scanners[1]]
    pair = [corrected_mounting(recorded, lacks)], [recorded]
    for view in np.flatnonzero(np.equal(scanners, scanners[1])):
        seen = views[:, view], times[:, view], np.zeros(NUMBER)
        views[:, view] = georeferenced_anew(survey.trajectory, *pair, *seen)
    views[:, 1] += NOISE * rng.standard_normal((NUMBER, 1)) * normal
    return replace(
        survey.ties[np.arange(NUMBER) % len(survey.ties)],
        gps_time=times,
        place=views,
        direction=normal,
        misclosure=np.einsum("ni,ni->n", normal, views[:, 1] - views[:, 0]),
        scanner=np.tile(scanners, (NUMBER, 1)),
        feature=np.arange(2 * NUMBER).reshape(-1, 2),
    )


@pytest.fixture(scope="module")
def survey():
    return tied_passes(SEED, control=(5.0, 30.0, 55.0))


@pytest.fixture(scope="module")
def alone(survey):
    return estimate_correction(survey.trajectory, survey.matched)


@pytest.fixture(scope="module", params=[0.0, 1.0])
def tied(request, survey, alone):
    "The estimate with ties, and what the second scanner lacks"
    lacks = request.param * LACKS
    return with_ties(alone, seen_twice(survey, lacks), (LEFT, RIGHT)), lacks


def between_control(survey, estimate):
    "RMS (m) of what is left of the first pass"
    left = survey.left(estimate.correction)
    return np.sqrt(np.mean(left[survey.trajectory.gps_time < START + LENGTH] ** 2))


def test_two_scanners_carry_control_along_one_pass(survey, alone, tied):
    "With ties 3 points leave not a third of what they leave alone, whatever a scanner lacks"
    assert between_control(survey, tied[0]) < between_control(survey, alone) / 3


def test_what_the_second_scanner_lacks_beside_the_first_is_estimated(tied):
    "Lever arm and boresight to 4 of their sigmas, which are below 20 mm and 0.1 deg but for up"
    estimate, lacks = tied
    solved = estimate.adjustment.solve(estimate.parameters)
    sigma = np.sqrt(np.diag(solved.trend_covariance)[:6])
    assert (np.abs(solved.trend[:6] - lacks) < 4 * sigma).all()
    assert (sigma < np.repeat([0.02, np.radians(0.1)], 3)).all()


def test_what_follows_an_estimate_knows_its_mountings(survey, tied):
    "The next target, the support of the drive and other orders are still found"
    estimate = tied[0]
    places = place_control(estimate)
    assert places and all(place.drive_after < place.drive_before for place in places)
    assert not estimate.support.contains(survey.matched.gps_time).any()
    assert estimate.alternatives


def test_a_second_scanner_that_lacks_something_is_named(tied):
    "And not a word where both agree"
    estimate, lacks = tied
    names = [w.values["name"] for w in scanner_warnings(estimate, ["left", "right"])]
    assert names == ["right"] * bool(lacks.any())


@pytest.fixture(scope="module", params=[0.0, 1.0])
def again(request, survey, alone):
    "The estimate with ties of one scanner to itself, and what it lacks"
    lacks = request.param * LACKS
    return with_ties(alone, seen_twice(survey, lacks, (0, 0)), (LEFT,)), lacks


def test_a_scanner_that_sees_things_again_carries_control_along_one_pass(survey, alone, again):
    "With ties to itself 3 points leave not half of what they leave alone, whatever it lacks"
    assert between_control(survey, again[0]) < between_control(survey, alone) / 2


def test_what_such_a_scanner_lacks_is_estimated_and_named(again):
    "Turns about right and up, which look like drift across the way, to 4 sigmas below 0.1 deg"
    estimate, lacks = again
    solved = estimate.adjustment.solve(estimate.parameters)
    sigma = np.sqrt(np.diag(solved.trend_covariance)[:6])
    assert (np.abs(solved.trend[:6] - lacks) < 4 * sigma).all()
    assert (sigma[[3, 5]] < np.radians(0.1)).all()
    assert len(list(scanner_warnings(estimate, [""]))) == bool(lacks.any())
