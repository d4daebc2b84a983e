"""A POS that is worse than it says for a while: found as noise in windows of time."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mlscorr.covariance import Covariance
from mlscorr.gap.background import BELIEVED, BURST_TIME, Setting, epochs, settings
from mlscorr.gap.bursts import burst_evidence, with_bursts
from mlscorr.gap.causes import infer
from mlscorr.gap.evidence import evidence, table
from mlscorr.gap.rows import background
from mlscorr.gap.signatures import signatures
from mlscorr.gap.whitening import whitener

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
BURSTS = ((413215.0, 25.0), (413360.0, 30.0))  # s: one in each pass


@pytest.fixture(scope="module")
def survey():
    "Two passes with 40 targets, and errors that no covariance of the estimator describes"
    sys.path.insert(0, str(BENCHMARKS))
    features = importlib.import_module("gap_features")
    sys.path.remove(str(BENCHMARKS))
    g = features.geometry(5, targets=40, patches=0, rough=False)
    return g, features.errors(g, np.random.default_rng(6), "walk")


def drifting(g, residual, bursts, rate=0.02):
    "Residuals with an error of the position that grows by so many m/s until each window's end"
    rows, rng = g.rows, np.random.default_rng(7)
    for start, length in bursts:
        way = rng.standard_normal(3)
        since = rows.gps_time - start
        size = np.where((since >= 0) & (since < length), rate * since, 0.0)
        residual = residual + size * (rows.partials[:, :3] @ (way / np.linalg.norm(way)))
    return residual


def found(g, residual):
    "BurstEvidence of residuals"
    observed = epochs(g.rows, g.background)
    column = observed.columns(residual[:, None])
    nothing = table(replace(g.rows, residual=residual), (), (), observed.sigma)
    return burst_evidence(observed, evidence(observed, settings(), column, nothing), column)[0]


def test_windows_of_drift_are_found_in_time_and_number(survey):
    "Each window is found to within a few targets, is likelier than none, and no other one is"
    g, clean = survey
    one = found(g, drifting(g, clean, BURSTS))
    assert one.gain[0] > 20
    assert len(one.bursts) == len(BURSTS)
    for (start, length, factor, _), (true, duration) in zip(one.bursts, BURSTS, strict=True):
        assert abs(start - true) < 4.0
        assert abs(start + length - true - duration) < 4.0
        assert 5 < factor < 40  # 0.5 and 0.6 m at their ends, over 0.02 m
    assert len(with_bursts((one,))) == len(settings())


def test_a_clean_survey_has_no_windows(survey):
    "Drift of another kind than assumed, but of the stated size, is no reason for windows"
    g, clean = survey
    assert found(g, clean).gain[0] < 0


def test_windows_hang_on_times_not_on_their_zero(survey):
    "Another zero of time moves the windows with it"
    g, clean = survey
    residual = drifting(g, clean, BURSTS[:1])
    rows, back, shift = g.rows, g.background, 86_400.0
    moved = replace(
        g, rows=replace(rows, gps_time=rows.gps_time + shift),
        background=replace(back, gps_time=back.gps_time + shift),
    )  # fmt: skip
    before, after = found(g, residual), found(moved, residual)
    assert after.bursts[0][0] - before.bursts[0][0] == pytest.approx(shift, abs=1e-3)
    assert after.gain[0] == pytest.approx(before.gain[0], abs=1e-6)


def test_a_burst_adds_its_covariance(survey):
    "The recursion whitens by the dense covariance with growth(t1) k(t1 - t2) growth(t2) added"
    g, _ = survey
    observed = epochs(g.rows, g.background)
    some = replace(BELIEVED, bursts=((*BURSTS[0], 12.0, "rise"),))
    n, place = len(observed), observed.drift + observed.jitter
    apart = observed.gps_time[:, None] - observed.gps_time
    grown = some.growth(observed.gps_time) * place
    kernel = Covariance("matern32", BURST_TIME)(apart)
    added = (grown @ grown.T) * kernel
    plain, with_burst = (
        np.linalg.inv(_precision(whitener(observed, one), n)) for one in (BELIEVED, some)
    )
    assert np.abs(with_burst - plain - added).max() < 1e-6 * np.abs(added).max()


def _precision(factor, n):
    white = factor.whiten(np.eye(n))
    return white.product(white)


@pytest.mark.parametrize("shape", ["rise", "hump"])
def test_growth_has_its_largest_value_where_the_shape_says(shape):
    "A rise is largest at the end of its window, a hump in the middle; outside both are zero"
    time = 413200.0 + np.linspace(0.0, 40.0, 401)
    growth = Setting(bursts=((413210.0, 20.0, 8.0, shape),)).growth(time)[:, 0]
    peak = 30.0 if shape == "rise" else 20.0
    assert time[np.argmax(growth)] - 413200.0 == pytest.approx(peak, abs=0.2)
    assert growth.max() == pytest.approx(8.0, rel=0.01)
    assert not growth[(time < 413210.0) | (time >= 413230.0)].any()


def test_a_pos_that_is_worse_in_windows_is_noise_of_the_pos(survey):
    "The verdict is position_noise, its parameters tell the windows, and what is left is as chance"
    g, clean = survey
    rows = replace(g.rows, residual=drifting(g, clean, BURSTS))
    signs, _ = signatures(rows, g.survey)
    told = infer(rows, background(rows, g.survey), g.survey, signs, np.random.default_rng(8), 20)
    assert told.verdict.label == "position_noise"
    best = told.causes[0]
    assert [p.unit for p in best.parameters] == ["s", "s", "ratio"] * len(BURSTS)
    assert abs(told.where.after) < 0.5 * told.where.before
