"""A wrong boresight beside drift: told from what opposite passes disagree by."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import (
    estimate_correction,
    find_mounting_error,
    mounting_warnings,
    with_ties,
)
from mlscorr.estimate.added_unknowns import AddedUnknowns
from mlscorr.survey import Mounting
from tests.beds.tied_passes import tied_passes

RECORDED = Mounting(np.zeros(3), Rotation.identity())


def checked(seed, degrees, number=120, scanners=1):
    "The test of two opposite passes that drift, georeferenced without so much boresight"
    street = tied_passes(seed, number=number)
    lacking = Rotation.from_rotvec(np.radians(degrees)).inv()

    def turned(place, gps_time):
        pose = street.trajectory.at(gps_time)
        body = pose.attitude.inv().apply(place - pose.position)
        return pose.position + pose.attitude.apply(lacking.apply(body))

    ties = street.ties
    matched = street.matched
    place = turned(ties.place.reshape(-1, 3), ties.gps_time.ravel()).reshape(-1, 2, 3)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    ties = replace(ties, place=place, misclosure=misclosure)
    position = turned(matched.observations.position, matched.gps_time)
    matched = replace(matched, observations=replace(matched.observations, position=position))
    mountings = [RECORDED] * scanners
    views = np.random.default_rng(seed).integers(scanners, size=(len(ties), 2))
    ties = replace(ties, scanner=views)
    of_other = mountings if scanners > 1 else ()
    estimate = with_ties(estimate_correction(street.trajectory, matched), ties, of_other)
    return find_mounting_error(estimate, matched, mountings)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_drift_alone_is_no_boresight(seed):
    "Half a metre of drift and a right mounting: no sentence"
    assert mounting_warnings(checked(seed, [0.0, 0.0, 0.0])) == ()


@pytest.mark.long
def test_a_boresight_of_a_degree_is_named():
    "The warning says by how much"
    check = checked(1, [0.0, 1.0, 0.0])
    (warning,) = mounting_warnings(check)
    assert "boresight about forward" in warning.values["components"]
    error = np.degrees(check.correction[3:]) - [0.0, 1.0, 0.0]
    assert (np.abs(error) < 3 * np.degrees(check.sigma[3:])).all()
    assert abs(error[1]) < 0.2  # deg


@pytest.mark.long
@pytest.mark.parametrize("degrees", [0.0, 0.5])
def test_scanners_that_are_wrong_alike_are_named(degrees):
    "Both are off by as much, and agree with each other: only opposite passes tell, and do"
    check = checked(1, [0.0, degrees, 0.0], 300, 2)
    warnings = mounting_warnings(check, 2)
    assert len(warnings) == bool(degrees)
    assert all(warning.values["components"][0].startswith("boresight") for warning in warnings)
    assert abs(np.degrees(check.correction[4]) - degrees) < 3 * np.degrees(check.sigma[4])
    assert np.degrees(check.sigma[4]) < 0.05


def test_a_lever_arm_is_named_where_it_exceeds_its_sigma_and_alone():
    "As two passes of a good POS tell of 9 cm; up, which they don't tell, is not named"
    lacks = [-0.087, 0.004, 0.094, 0.0, 0.0, 0.0]
    sigma = [0.011, 0.011, 0.129, 4e-4, 3e-4, 2e-4]
    covariance = np.diag(np.square(sigma))
    check = AddedUnknowns(np.array(lacks), covariance, np.zeros((0, 6)), np.zeros(0), 68.6, 22.5)
    (warning,) = mounting_warnings(check)
    assert warning.values["components"] == ("lever arm right",)
    assert warning.values["corrections"] == pytest.approx([-0.087])
    assert warning.values["sigmas"] == pytest.approx([0.011])
    assert mounting_warnings(replace(check, statistic=20.0)) == ()


@pytest.mark.long
def test_without_ties_nothing_is_tested():
    "Control points alone: None"
    street = tied_passes(1)
    estimate = estimate_correction(street.trajectory, street.matched)
    assert find_mounting_error(estimate, street.matched, [RECORDED]) is None
