"""Estimated scale of a POS without stated sigmas."""

from dataclasses import replace

import gap_study
import numpy as np
import pytest
from gap_training import features

from mlscorr.effects import make_effect
from mlscorr.gap import likely_scale, open_sigmas, with_scale
from mlscorr.gap.evidence import weigh_labels
from mlscorr.gap.open_scale import SIGMAS, STEP
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures
from mlscorr.survey import Pos
from tests.gap.inference import surveyed

ASSUMED = ("position_sigma", "attitude_sigma", "correlation_time")


@pytest.fixture(scope="module")
def bed():
    "One pass with 14 targets, of whose POS nobody stated anything; signatures of three effects"
    g = features.geometry(5, targets=14, patches=0, passes=1, rough=False)
    names = ("time_offset", "lever_arm", "position_bump", "position_noise")
    signs, _ = signatures(g.rows, g.survey, [type(make_effect(n, **SIZES[n])) for n in names])
    return g, replace(g.survey, pos=replace(g.survey.pos, assumed=ASSUMED)), signs


SIZES = {
    "time_offset": {"magnitude": 0.02},
    "lever_arm": {"magnitude": [0.1, 0.0, 0.0]},
    "position_bump": {"magnitude": [0.0, 0.0, 0.1], "time": 5.0, "width": 3.0},
    "position_noise": {"magnitude": 0.02},
}


def drift(g, factor):
    "Rows whose POS errs by so many times the default"
    residual = factor * gap_study.errors(g, np.random.default_rng(8), "sines")
    return replace(g.rows, residual=residual)


def scale_of(bed, rows):
    _, survey, signs = bed
    return likely_scale(rows, survey, signs, np.random.default_rng(0))


def test_a_pos_of_another_grade_is_recognised(bed):
    "Drift 10 times as large as a default POS's: within a step and a half of its scale"
    g, survey, signs = bed
    rows = drift(g, 10.0)
    scale = scale_of(bed, rows)
    assert abs(np.log(scale / 10.0)) < 1.5 * np.log(STEP)
    assumed = replace(survey, pos=with_scale(survey.pos, scale, SIGMAS))
    given = background(rows, assumed), assumed, signs, np.random.default_rng(0)
    score = weigh_labels(rows, *given, 0).score
    assert max(score, key=lambda name: score[name][0]) == "none"


def test_an_effect_is_not_taken_for_drift(bed):
    "A clock 20 ms off moves targets by a decimeter, and the scale stays within a step of one"
    g = bed[0]
    rows = surveyed(g, 8, make_effect("time_offset", magnitude=0.02))
    assert np.sqrt(np.mean(rows.residual**2)) > 3 * g.survey.pos.position_sigma
    assert 1.0 <= scale_of(bed, rows) <= STEP


def test_what_is_stated_stays_as_it_is(bed):
    "With a sigma in [pos], or with sigma columns in the trajectory, there is nothing to find"
    g, survey, signs = bed
    rows = drift(g, 10.0)
    rng = np.random.default_rng(0)
    assert likely_scale(rows, g.survey, signs, rng) == 1.0
    epochs = np.ones((len(survey.trajectory), 3))
    stated = replace(survey.trajectory, position_sigma=0.02 * epochs, attitude_sigma=1e-4 * epochs)
    assert open_sigmas(replace(survey, trajectory=stated)) == ()
    angles = replace(survey.trajectory, attitude_sigma=1e-4 * epochs)
    assert open_sigmas(replace(survey, trajectory=angles)) == ("position_sigma",)


def test_windows_err_as_much_under_another_scale():
    "12 sigmas of 2 cm are 4 of 6 cm; there and back is the same"
    pos = Pos(0.02, np.array([1e-4, 1e-4, 2e-4]), windows=((413205.0, 20.0, 12.0, "rise"),))
    wider = with_scale(pos, 3.0, SIGMAS)
    assert wider.position_sigma == pytest.approx(0.06)
    assert wider.attitude_sigma == pytest.approx([3e-4, 3e-4, 6e-4])
    assert wider.windows[0][2] == pytest.approx(4.0)
    again = with_scale(wider, 1 / 3.0, SIGMAS)
    assert again.windows[0][2] == pytest.approx(12.0)
    assert with_scale(pos, 3.0, ("attitude_sigma",)).windows == pos.windows
