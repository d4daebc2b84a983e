"""A mounting by control points and by planes that opposite passes both saw."""

import numpy as np
import pytest

from mlscorr.estimate import calibration_with_ties, corrected_mounting, estimate_mounting
from mlscorr.estimate.mounting import georeferenced_ties, linearized, with_shift
from tests.beds.tied_site import RECORDED, tied_site


@pytest.fixture(scope="module")
def site():
    "Half a degree of boresight, 6 control points, 100 planes of which a fifth are wrong"
    return tied_site(1, wrong=0.2)


@pytest.fixture(scope="module")
def alone(site):
    return estimate_mounting(site.trajectory, [RECORDED], site.matched)


@pytest.fixture(scope="module")
def tied(site, alone):
    return calibration_with_ties(alone, site.matched, site.ties)


def test_planes_tell_the_boresight_better_than_targets(site, alone, tied):
    "6 control points leave 0.01 deg; with planes it is less than 0.005 deg, and 5 mm across"
    errors = [c.lsc.correction - site.lacks for c in (alone, tied)]
    turn = [np.degrees(np.abs(error[3:]).max()) for error in errors]
    assert turn[0] > 0.008 and turn[1] < 0.005  # deg
    assert np.abs(errors[1][:2]).max() < 0.005  # m
    assert (np.abs(errors[1]) < 3 * tied.lsc.sigma).all()


def test_wrong_planes_are_refused(site, tied):
    "A fifth that moved by decimetres take no part; the others agree to their noise of 2 mm"
    assert site.wrong.sum() > 10
    assert not tied.ties.used[site.wrong].any()
    assert tied.ties.used[~site.wrong].mean() > 0.95
    assert np.median(np.abs(tied.ties.ties.misclosure)) > 0.05  # m
    assert np.median(np.abs(tied.ties.after[tied.ties.used])) < 0.005  # m


def test_ties_tell_nothing_of_a_difference_between_coordinates(alone, tied):
    "Lever arm up stays undetermined: planes see it no more than a difference of heights"
    assert tied.determined.tolist() == [True, True, False, True, True, True]
    assert "does not determine lever arm up" in tied.warnings[0]
    assert tied.lsc.sigma[2] > 0.3 * alone.lsc.sigma[2]


def test_partials_are_what_a_changed_mounting_does_to_the_misclosure(site, alone):
    "Differences of georeferenced misclosures by each component agree with a tie's row of A"
    errors = alone.adjustment.errors
    step = 1e-4
    about = georeferenced_ties(errors, [RECORDED], [RECORDED], site.ties)
    for axis in range(6):
        ends = [
            georeferenced_ties(
                errors,
                [RECORDED],
                [corrected_mounting(RECORDED, sign * step * np.eye(6)[axis])],
                site.ties,
            ).misclosure[:, 0]
            for sign in (1, -1)
        ]
        slope = (ends[1] - ends[0]) / (2 * step)  # what is missing is the misclosure's opposite
        assert np.abs(slope - about.columns[:, 0, axis]).max() < 1e-3


def test_columns_beyond_the_mounting_are_zero_for_ties(site, alone):
    "Beside a difference between coordinates ties have rows of nine columns, three of zero"
    adjustment = linearized(alone.adjustment, site.matched, [RECORDED], np.zeros(6))[1]
    ties = georeferenced_ties(adjustment.errors, [RECORDED], [RECORDED], site.ties)
    wider = with_shift(adjustment.with_factor(ties))
    rows = wider.rows(alone.parameters[0][0])[-1]
    assert rows.design.shape == (100, 1, 9)
    assert np.array_equal(rows.design[:, :, :6], ties.columns)
    assert not rows.design[:, 0, 6:].any()
