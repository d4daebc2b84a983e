"""A linear term that all control has in common is found where the POS explains it worse."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate import DatumDifference, datum_differences
from mlscorr.evaluate.datum import TERMS, UNITS
from mlscorr.io.trajectories import map_factors
from mlscorr.survey import Pos
from tests.beds.streets import observed, targets, trajectory

SIGMA = 0.02  # m, of the POS
DRIVE = trajectory(SIGMA)
TURN = np.radians(0.03)
CENTRAL = "EPSG:32650"  # the drive lies 23 km beside its central meridian


def control(rng, change=lambda place: place, drift=0.0):
    "12 control points under a POS error within its sigma, or drifting, surveyed with a change"
    place, time = targets(rng, 12)
    error = SIGMA * rng.normal(size=3) + drift * np.linspace(-1.0, 1.0, 12)[:, None] ** 3
    noise = 0.004 * rng.normal(size=(12, 3))
    return observed(place + error + noise, time, change(place))


def about(place, matrix):
    middle = place.mean(axis=0)
    return middle + (place - middle) @ np.asarray(matrix).T


def turned(place, angle):
    c = np.cos(angle)
    s = np.sin(angle)
    return about(place, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def differences(change, seed=3, **drift):
    return datum_differences(control(np.random.default_rng(seed), change, **drift), DRIVE, Pos())


@pytest.mark.parametrize("seed", range(5))
def test_a_good_survey_hears_nothing(seed):
    "Errors within the POS's sigma are no datum"
    assert datum_differences(control(np.random.default_rng(seed)), DRIVE, Pos()) == ()


@pytest.mark.long
@pytest.mark.parametrize("seed", range(5, 40))
def test_many_good_surveys_hear_nothing(seed):
    "Errors within the POS's sigma are no datum"
    assert datum_differences(control(np.random.default_rng(seed)), DRIVE, Pos()) == ()


@pytest.mark.parametrize("seed", [3, 4])
def test_ground_distances_are_found(seed):
    "Distances longer by UTM's 400 ppm along 400 m, 5 cm at its ends: within 4 sigma, below 60 ppm"
    (found,) = differences(lambda place: about(place, np.diag([1.0004, 1.0004, 1.0])), seed)
    assert found.term == "scale"
    assert found.sigma[0] < 60e-6
    assert found.size[0] == pytest.approx(4e-4, abs=4 * found.sigma[0])
    assert found.length == pytest.approx(found.extent * 4e-4, rel=0.5)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_turned_net_is_found(seed):
    "Turned by 0.03 deg to the left: to 0.01 deg"
    (found,) = differences(lambda place: turned(place, TURN), seed)
    assert found.term == "turn"
    assert found.size[0] == pytest.approx(TURN, abs=np.radians(0.01))


@pytest.mark.parametrize("seed", [3, 4])
def test_a_tilted_net_is_found(seed):
    "Rising by 0.4 mm/m towards N 60 E, the way of the drive, along which it is known to 0.1 mm/m"
    ahead = np.array([np.sin(np.radians(60.0)), np.cos(np.radians(60.0))])

    def tilted(place):
        rise = (place - place.mean(axis=0))[:, :2] @ ahead * 4e-4
        return place + rise[:, None] * [0.0, 0.0, 1.0]

    (found,) = differences(tilted, seed)
    assert found.term == "tilt"
    assert found.size @ ahead == pytest.approx(4e-4, abs=1e-4)


def test_a_large_scale_and_a_large_turn_are_found_together():
    "A net of another projection, by 2000 ppm and 0.3 deg: each to a tenth"
    change = np.diag([1.002, 1.002, 1.0])
    found = differences(lambda place: about(turned(place, 10 * TURN), change))
    assert [each.term for each in found] == ["scale", "turn"]
    assert found[0].size[0] == pytest.approx(0.002, rel=0.1)
    assert found[1].size[0] == pytest.approx(10 * TURN, rel=0.1)


def test_heights_of_another_datum_are_found():
    "Control 0.3 m lower: by how much, to 2.5 sigma of the POS, and nothing else"
    (found,) = differences(lambda place: place - [0.0, 0.0, 0.3])
    assert found.term == "height"
    assert found.size == pytest.approx([-0.3], abs=0.05)


def test_a_default_sigma_is_called_assumed():
    "A default sigma of the POS is among the values of the statement"

    def lower(place):
        return place - [0.0, 0.0, 0.5]

    bare = replace(DRIVE, position_sigma=None, attitude_sigma=None)
    points = control(np.random.default_rng(3), lower)
    (stated,) = datum_differences(points, bare, Pos())
    (assumed,) = datum_differences(points, bare, Pos(assumed=("position_sigma",)))
    assert stated.assumed_sigma is None
    assert assumed.assumed_sigma == pytest.approx(0.02)  # m
    assert assumed.statement.values["assumed_sigma"] == assumed.assumed_sigma


@pytest.mark.parametrize("rows", [slice(0, 40), slice(None)])
def test_sigmas_of_zero_are_no_statement_of_a_datum_either(rows):
    "Control 0.3 m lower is found where epochs state a sigma of zero, which others fill in"
    sigma = DRIVE.position_sigma.copy()
    sigma[rows] = 0.0
    lower = control(np.random.default_rng(3), lambda place: place - [0.0, 0.0, 0.3])
    (found,) = datum_differences(lower, replace(DRIVE, position_sigma=sigma), Pos())
    assert found.size == pytest.approx([-0.3], abs=0.05)


def test_another_horizontal_datum_is_found():
    "Control 0.8 m east and 0.4 m north: to 2.5 sigma of the POS"
    (found,) = differences(lambda place: place + np.array([0.8, 0.4, 0.0]))
    assert found.term == "shift"
    assert found.size == pytest.approx([0.8, 0.4], abs=0.05)


def test_a_pos_that_drifts_by_more_than_it_states_is_no_datum():
    "Misclosures that wander by half a metre share nothing that a datum could be"
    assert differences(lambda place: place, drift=0.5) == ()


def test_two_points_say_nothing():
    "Of fewer than three points nobody knows what they have in common"
    matched = control(np.random.default_rng(0), lambda place: place + 1.0)
    assert datum_differences(matched[[0, 1]], DRIVE, Pos()) == ()


def test_the_origin_of_coordinates_changes_nothing():
    "The same net a million metres farther: the same scale and evidence"
    matched = control(np.random.default_rng(3), lambda place: about(place, np.diag([1.001] * 3)))
    away = np.array([1e6, -1e6, 0.0])
    observations = replace(matched.observations, position=matched.observations.position + away)
    surveyed = replace(matched.surveyed, position=matched.surveyed.position + away)
    moved = replace(matched, observations=observations, surveyed=surveyed)
    here = datum_differences(matched, DRIVE, Pos())[0]
    there = datum_differences(moved, replace(DRIVE, position=DRIVE.position + away), Pos())[0]
    assert there.size == pytest.approx(here.size, abs=1e-7)
    assert there.log_evidence == pytest.approx(here.log_evidence, abs=0.01)


ALONE = {  # values that no other term has
    "shift": {"length", "assumed_sigma"},
    "height": {"assumed_sigma"},
    "scale": {"sigma", "extent", "length", "ground", "is_ground"},
    "turn": {"sigma", "extent", "length", "ground"},
    "tilt": {"sigma", "extent", "length"},
}


@pytest.mark.parametrize("term", TERMS)
def test_each_term_is_a_statement_and_a_row(term):
    "Name, size, sigma and the map's term, as a statement and as numbers"
    count = {"shift": 2, "tilt": 2}.get(term, 1)
    ground = map_factors(CENTRAL, DRIVE.position[0])
    size = np.full(count, 4e-4)
    found = DatumDifference(term, size, np.full(count, 1e-5), 17.7, 12, 100.0, ground)
    assert found.statement.key == term
    assert found.statement.values.keys() == {"size", "log_evidence", "observations"} | ALONE[term]
    row = found.document()
    assert (row["term"], row["unit"], row["size"]) == (term, UNITS[term], size.tolist())
    assert row["sentence"] == found.sentence
    assert row["map_factor"]["projection"] == pytest.approx(0.9996065, abs=1e-6)


@pytest.mark.parametrize(("size", "is_ground"), [(4e-4, True), (5e-3, False)])
def test_a_scale_stands_beside_that_of_the_map(size, is_ground):
    "400 ppm are ground distances where the map shortens by 394 ppm, 5000 ppm are not"
    ground = map_factors(CENTRAL, DRIVE.position[0])
    found = DatumDifference("scale", np.array([size]), np.array([1e-5]), 20.0, 12, 100.0, ground)
    assert found.statement.values["is_ground"] == is_ground
    assert not replace(found, ground=None).statement.values["is_ground"]
