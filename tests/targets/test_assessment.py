from dataclasses import replace

import numpy as np
import pytest

from mlscorr.targets import ScannerPath
from mlscorr.targets._echoes import Echoes
from mlscorr.targets._outline import Outline
from mlscorr.targets._seeds import Seed
from mlscorr.targets._shape_fit import assess
from mlscorr.targets.shapes import BRIGHT, DARK
from tests.targets.planes import plane_through

SIZE = 0.6  # m
BLUR = 0.002  # m
PLANE = plane_through(np.zeros(3), np.array([0.0, 1.0, 0.0]))
DISC = Outline(np.zeros(2), 1e-6 * np.eye(2), 0.0, SIZE, 0.0, 0.001, 1.0)


def assessed(outline, visible=lambda points: np.ones(len(points), bool), dark=100.0):
    "Assessment of an outline of a disc on a dark board, of which a part is visible"
    axis = np.arange(-0.6, 0.6, 0.03)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    points = points[visible(points)]
    state = np.where(np.hypot(*points.T) < SIZE / 2, BRIGHT, DARK)
    xyz = points @ PLANE.axes[:2]
    time = np.arange(len(xyz)) * 1e-5
    path = ScannerPath(time[[0, -1]], np.tile([0.0, -5.0, 0.0], (2, 1)))
    intensity = np.where(state == BRIGHT, 1000.0, dark)
    echoes = Echoes(xyz, time, intensity, path, 0.03)
    seed = Seed(np.flatnonzero(state == BRIGHT), PLANE, 500.0, False, SIZE, np.zeros(2))
    beams = points, state, np.arange(len(points))
    return assess(beams, outline, "circle", seed, echoes, BLUR)


def test_a_disc_that_fits_is_accepted_with_a_full_score():
    "All round supported, with contrast and flat: score 1"
    assessment = assessed(DISC)
    assert assessment.plausible and assessment.accepted
    assert assessment.score == pytest.approx(1.0)


def test_half_a_disc_is_accepted_and_ranks_below_a_whole_one():
    "A target may be hidden by half; where more of it is visible, the fit is the better one"
    half = assessed(DISC, lambda points: points[:, 0] > 0)
    assert half.accepted
    assert half.rank < 0.8 * assessed(DISC).rank


def test_an_outline_that_does_not_hold_its_centre_is_refused():
    "A sigma of a tenth of the size along one axis is too much, however well all else fits"
    loose = replace(DISC, covariance=np.diag([(0.1 * SIZE) ** 2, 1e-6]))
    assert assessed(loose).plausible and not assessed(loose).accepted


def test_an_overlap_below_the_limit_is_refused():
    "Shares of 0.75 may pass as a rough fit, and not as an exact one; 0.6 not at all"
    assert assessed(replace(DISC, overlap=0.75)).plausible
    assert not assessed(replace(DISC, overlap=0.75)).accepted
    assert not assessed(replace(DISC, overlap=0.6)).plausible


def test_weak_contrast_costs_score():
    "A disc of 1000 on 900 scores a fifth of one on 100"
    assert assessed(DISC, dark=900.0).score < 0.3 * assessed(DISC).score
