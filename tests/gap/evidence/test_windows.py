"""A POS that is worse than it says for a while: found as noise in windows of time."""

from dataclasses import replace

import numpy as np
import pytest
from feature_errors import errors as clean_residuals
from gap_training import features

from mlscorr.collocation import Covariance
from mlscorr.gap.evidence import (
    SETTINGS,
    Observations,
    column_table,
    error_models,
    infer_causes,
    window_growth,
)
from mlscorr.gap.evidence._windows import models_with_windows, weigh_windows
from mlscorr.gap.evidence.evidence import weigh_blocks
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures

WINDOWS = ((413215.0, 25.0), (413360.0, 30.0))  # s: one in each pass


@pytest.fixture(scope="module")
def survey():
    "Two passes with 40 targets, and errors that no covariance of the estimator describes"
    g = features.geometry(5, targets=40, patches=0, rough=False)
    return g, clean_residuals(g, np.random.default_rng(6), "walk")


def drifting(g, residual, bursts, rate=0.02):
    "Residuals with an error of the position that grows by so many m/s until each window's end"
    rows = g.rows
    rng = np.random.default_rng(7)
    for start, length in bursts:
        way = rng.standard_normal(3)
        since = rows.gps_time - start
        size = np.where((since >= 0) & (since < length), rate * since, 0.0)
        residual = residual + size * (rows.partials[:, :3] @ (way / np.linalg.norm(way)))
    return residual


def weighed(g, residual):
    "WindowEvidence of residuals"
    observed = Observations.of(g.rows, g.background)
    column = observed.columns(residual[:, None])
    rows = replace(g.rows, residual=residual)
    nothing = column_table(rows, (), (), observed.sigma)
    blocks = weigh_blocks(observed, error_models(), column, nothing)
    signs, _ = signatures(rows, g.survey)
    return weigh_windows(observed, signs, blocks, column, column[:, :0])[0]


@pytest.mark.long
def test_windows_of_drift_are_found_in_time_and_number(survey):
    "Each window is found to within a few targets, is likelier than none, and no other one is"
    g, clean = survey
    evidence = weighed(g, drifting(g, clean, WINDOWS))
    assert evidence.gain[0] > 20
    assert len(evidence.windows) == len(WINDOWS)
    for window, (start, duration) in zip(evidence.windows, WINDOWS, strict=True):
        assert abs(window.start - start) < 4.0
        assert abs(window.end - start - duration) < 4.0
        assert 5 < window.factor < 40  # 0.5 and 0.6 m at their ends, over 0.02 m
    assert len(models_with_windows((evidence,))) == len(error_models())


def test_a_clean_survey_has_no_windows(survey):
    "Drift of another kind than assumed, but of the stated size, is no reason for windows"
    g, clean = survey
    assert weighed(g, clean).gain[0] < 0


@pytest.mark.long
def test_windows_hang_on_times_not_on_their_zero(survey):
    "Another zero of time moves the windows with it"
    g, clean = survey
    residual = drifting(g, clean, WINDOWS[:1])
    rows = g.rows
    back = g.background
    shift = 86_400.0
    moved = replace(
        g,
        rows=replace(rows, gps_time=rows.gps_time + shift),
        background=replace(back, gps_time=back.gps_time + shift),
    )
    before = weighed(g, residual)
    after = weighed(moved, residual)
    assert after.windows[0].start - before.windows[0].start == pytest.approx(shift, abs=1e-3)
    assert after.gain[0] == pytest.approx(before.gain[0], abs=1e-6)


def test_a_window_adds_its_covariance(survey):
    "The recursion whitens by the dense covariance with growth(t1) k(t1 - t2) growth(t2) added"
    g, _ = survey
    observed = Observations.of(g.rows, g.background)
    model = replace(STATED, windows=((*WINDOWS[0], 12.0, "rise"),))
    errors = observed.errors
    n = len(observed)
    apart = errors.gps_time[:, None] - errors.gps_time
    growth = window_growth(model.windows, errors.gps_time) * errors.position
    added = (growth @ growth.T) * Covariance("matern32", SETTINGS.window_time)(apart)
    plain, wider = (
        np.linalg.inv(observed.whitener(each).solve(np.eye(n))[0]) for each in (STATED, model)
    )
    assert np.abs(wider - plain - added).max() < 1e-6 * np.abs(added).max()


@pytest.mark.parametrize("shape", ["rise", "hump"])
def test_growth_has_its_largest_value_where_the_shape_says(shape):
    "A rise is largest at the end of its window, a hump in the middle; outside both are zero"
    time = 413200.0 + np.linspace(0.0, 40.0, 401)
    growth = window_growth(((413210.0, 20.0, 8.0, shape),), time)[:, 0]
    peak = 30.0 if shape == "rise" else 20.0
    assert time[np.argmax(growth)] - 413200.0 == pytest.approx(peak, abs=0.2)
    assert growth.max() == pytest.approx(8.0, rel=0.01)
    assert not growth[(time < 413210.0) | (time >= 413230.0)].any()


def diagnosed(g, residual):
    "Inference on a survey with such residuals"
    rows = replace(g.rows, residual=residual)
    signs, _ = signatures(rows, g.survey)
    rng = np.random.default_rng(8)
    return infer_causes(rows, background(rows, g.survey), g.survey, signs, rng, 20)


@pytest.mark.long
def test_a_pos_that_is_worse_in_windows_is_noise_of_the_pos(survey):
    "The verdict is position_noise, its parameters tell the windows, and what is left is as chance"
    g, clean = survey
    told = diagnosed(g, drifting(g, clean, WINDOWS))
    assert told.verdict.label == "position_noise"
    best = told.causes[0]
    assert [p.unit for p in best.parameters] == ["s", "s", "ratio"] * len(WINDOWS)
    assert abs(told.where.after) < 0.5 * told.where.before
