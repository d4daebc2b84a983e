"""Ties as observations of two poses."""

import numpy as np
import pytest

from mlscorr.correction import Correction
from mlscorr.estimate import tie_factor
from mlscorr.pos import PosErrors
from tests.beds.tied_passes import tied_passes


@pytest.fixture(scope="module")
def survey():
    return tied_passes(1, number=40)


@pytest.fixture(scope="module")
def factor(survey):
    return tie_factor(PosErrors.stated(survey.trajectory), survey.ties)


def test_partials_are_what_a_changed_pose_does_to_the_misclosure(survey, factor):
    "A correction of metres and milliradians at each view changes n . (c1 - c2) as B says: 0.1 mm"
    rng = np.random.default_rng(3)
    trajectory = survey.trajectory
    ties = survey.ties
    pose = np.hstack([rng.normal(size=(1, 3)), 1e-4 * rng.normal(size=(1, 3))])
    there = trajectory.gps_time <= trajectory.passes[0, 1]
    correction = Correction.by_pose_error(trajectory, np.where(there[:, None], pose, 0.0))
    moved = correction.increments(ties.place[:, 0], ties.gps_time[:, 0])[0]
    expected = np.einsum("ni,ni->n", ties.direction, moved)
    assert np.abs(factor.partials[:, 0, 0] @ pose[0] - expected).max() < 1e-4  # m


def test_a_pose_error_that_both_views_share_is_not_seen(factor):
    "The same shift at both views cancels: its two partials add up to zero"
    assert np.abs(factor.partials[:, :, 0].sum(axis=1)[:, :3]).max() < 1e-12


def test_some_ties_are_rows_of_all(factor):
    "A selection holds the same numbers, and the sigmas of its own views"
    rows = np.array([7, 2, 31])
    some = factor.select(rows)
    assert len(some) == 3
    assert np.array_equal(some.stated.gps_time, factor.gps_time[rows].ravel())
    assert np.array_equal(some.partials, factor.partials[rows])
