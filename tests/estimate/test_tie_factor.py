"""Ties as rows of two sides."""

import numpy as np
import pytest
from mlscorr.estimate._tied_adjustment import TieEquations

from mlscorr.correction import Correction
from mlscorr.pos import stated_sigma
from mlscorr.survey import Pos
from tests.beds.tied_passes import tied_passes


@pytest.fixture(scope="module")
def survey():
    return tied_passes(1, number=40)


@pytest.fixture(scope="module")
def adjustment(survey):
    stated = stated_sigma(survey.trajectory, Pos())
    return TieEquations.of(survey.trajectory, Pos(), survey.ties, stated)


def test_partials_are_what_a_changed_pose_does_to_the_misclosure(survey, adjustment):
    "A correction of metres and milliradians at each view changes n . (c1 - c2) as B says: 0.1 mm"
    rng = np.random.default_rng(3)
    trajectory = survey.trajectory
    ties = survey.ties
    pose = np.hstack([rng.normal(size=(1, 3)), 1e-4 * rng.normal(size=(1, 3))])
    there = trajectory.gps_time <= trajectory.passes[0, 1]
    correction = Correction.by_pose_error(trajectory, np.where(there[:, None], pose, 0.0))
    moved = correction.increments(ties.place[:, 0], ties.gps_time[:, 0])[0]
    expected = np.einsum("ni,ni->n", ties.direction, moved)
    assert np.abs(adjustment.partials[:, 0] @ pose[0] - expected).max() < 1e-4  # m


def test_a_pose_error_that_both_views_share_is_not_seen(adjustment):
    "The same shift at both views cancels: its two partials add up to zero"
    assert np.abs(adjustment.partials.sum(axis=1)[:, :3]).max() < 1e-12


def test_some_ties_are_rows_of_all(adjustment):
    "A selection holds the same numbers, and the sigmas of its own views"
    rows = np.array([7, 2, 31])
    some = adjustment.select(rows)
    assert len(some) == 3
    assert np.array_equal(some.stated.gps_time, adjustment.gps_time[rows].ravel())
    assert np.array_equal(some.partials, adjustment.partials[rows])
