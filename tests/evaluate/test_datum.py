"""What all control points have in common is said where the POS leaves no room for it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate.datum import datum_warnings
from mlscorr.survey import Pos
from tests.beds.streets import observed, targets, trajectory

SIGMA = 0.02  # m, of the POS
DRIVE = trajectory(SIGMA)


def control(rng, change=lambda place: place, drift=0.0):
    "12 control points under a POS error within its sigma, or drifting, surveyed with a change"
    place, time = targets(rng, 12)
    error = SIGMA * rng.normal(size=3) + drift * np.linspace(-1.0, 1.0, 12)[:, None] ** 3
    noise = 0.004 * rng.normal(size=(12, 3))
    return observed(place + error + noise, time, change(place))


def about(place, matrix):
    middle = place.mean(axis=0)
    return middle + (place - middle) @ np.asarray(matrix).T


def said(change, **drift):
    return datum_warnings(control(np.random.default_rng(3), change, **drift), DRIVE, Pos())


@pytest.mark.parametrize("seed", range(40))
def test_a_good_survey_hears_nothing(seed):
    "Errors within the POS's sigma are no datum"
    assert datum_warnings(control(np.random.default_rng(seed)), DRIVE, Pos()) == ()


def test_a_default_sigma_is_called_assumed():
    "Where nobody stated the sigma of the POS, the sentence says so, and the way out"

    def lower(place):
        return place - [0.0, 0.0, 0.5]

    bare = replace(DRIVE, position_sigma=None, attitude_sigma=None)
    points = control(np.random.default_rng(3), lower)
    (stated,) = datum_warnings(points, bare, Pos())
    (assumed,) = datum_warnings(points, bare, Pos(assumed=("position_sigma",)))
    assert "assumed" not in stated
    assert assumed.startswith(stated) and "0.02 m is assumed" in assumed and "[pos]" in assumed


def test_heights_of_another_datum_are_named():
    "Control 0.3 m lower: how much, how well all agree, and what it looks like"
    (sentence,) = said(lambda place: place - [0.0, 0.0, 0.3])
    assert re.search(r" 0\.(2[5-9]|3[0-5]) m below the cloud", sentence)
    assert "12 observations" in sentence and "vertical datum" in sentence


@pytest.mark.parametrize("rows", [slice(0, 40), slice(None)])
def test_sigmas_of_zero_are_no_statement_of_a_datum_either(rows):
    "Control 0.3 m lower is named where epochs state a sigma of zero, which others fill in"
    sigma = DRIVE.position_sigma.copy()
    sigma[rows] = 0.0
    lower = control(np.random.default_rng(3), lambda place: place - [0.0, 0.0, 0.3])
    (sentence,) = datum_warnings(lower, replace(DRIVE, position_sigma=sigma), Pos())
    assert re.search(r" 0\.(2[5-9]|3[0-5]) m below the cloud", sentence)


def test_another_horizontal_datum_is_named():
    "Control 0.8 m east and 0.4 m north: the vector and the likely cause"
    (sentence,) = said(lambda place: place + np.array([0.8, 0.4, 0.0]))
    assert "horizontal datum" in sentence and re.search(r"E \+0\.[78]\d, N \+0\.[34]", sentence)


def test_ground_distances_are_named():
    "Distances longer by 2000 ppm along 400 m are no POS error"
    (sentence,) = said(lambda place: about(place, np.diag([1.002, 1.002, 1.0])))
    assert re.search(r"larger by \+(19|20)\d\d ppm", sentence) and "ground distances" in sentence


def test_a_turned_map_is_named():
    "A turn by 0.1 deg is told from a scale"
    a = np.radians(0.1)
    turn = [[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]]
    (sentence,) = said(lambda place: about(place, turn))
    assert re.search(r"turned by \+0\.(09|10)", sentence) and "zone" in sentence


def test_a_pos_that_drifts_by_more_than_it_states_is_no_datum():
    "Misclosures that wander by half a metre share nothing that a datum could be"
    assert said(lambda place: place, drift=0.5) == ()


def test_two_points_say_nothing():
    "Of fewer than three points nobody knows what they have in common"
    matched = control(np.random.default_rng(0), lambda place: place + 1.0)
    assert datum_warnings(matched[[0, 1]], DRIVE, Pos()) == ()
