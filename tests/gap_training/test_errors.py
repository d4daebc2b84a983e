"""Errors of made-up surveys."""

from dataclasses import replace

import numpy as np
import pytest
from feature_errors import errors
from gap_training.errors import odd_patches, process, scatter
from gap_training.features import geometry

from mlscorr.gap.evidence import SETTINGS


@pytest.fixture(scope="module")
def small():
    "Two passes, 14 targets and 30 planes that both saw"
    return geometry(3, targets=14, patches=30, shared=True, duration=45.0)


@pytest.mark.parametrize("kind", ["sines", "walk"])
def test_drift_has_unit_size_and_is_no_white_noise(kind):
    "Its rms over many drives is one within a third, and neighbours agree"
    time = 413200.0 + np.arange(0.0, 150.0, 0.5)
    drifts = [process(np.random.default_rng(seed), time, kind) for seed in range(40)]
    assert np.sqrt(np.mean(np.square(drifts))) == pytest.approx(1.0, rel=0.35)
    steps = np.diff(drifts, axis=1)
    assert np.std(steps) < 0.5


def test_residuals_are_as_large_as_stated(small):
    "Centimetres on targets: drift of 2 cm, survey and extraction of millimetres"
    metric = small.rows.metric
    sizes = [np.std(errors(small, np.random.default_rng(seed))[metric]) for seed in range(8)]
    assert 0.008 < np.median(sizes) < 0.04


def test_scatter_has_its_stated_variance_with_light_and_heavy_tails(small):
    "Survey and extraction errors, over many draws, within a tenth"
    target = small.rows.channel == "target"
    stated = np.sqrt((small.rows.noise + small.rows.survey)[target].mean())
    for heavy in (False, True):
        rng = np.random.default_rng(1)
        drawn = [scatter(small.rows, rng, heavy)[target] for _ in range(200)]
        assert np.std(drawn) == pytest.approx(stated, rel=0.1)


def test_no_survey_error_is_as_large_as_that_of_an_outlier(small):
    "Of 8000 coordinates with heavy tails none is off by more than 4 sigma, and some come near"
    rows = replace(small.rows, noise=np.zeros(len(small.rows)))
    use = (rows.channel == "target") & (rows.survey > 0)
    rng = np.random.default_rng(1)
    drawn = [scatter(rows, rng)[use] / np.sqrt(rows.survey[use]) for _ in range(200)]
    assert 3.5 < np.max(np.abs(drawn)) < SETTINGS.outlier + 1e-9


def test_odd_patches_are_rougher_or_lose_more_and_no_length_changes(small):
    "Up to an eighth of the rows of both channels"
    rows = small.rows
    shares = []
    for seed in range(20):
        odd = odd_patches(rows, np.random.default_rng(seed))
        assert not odd[rows.metric].any()
        rough, rate = (rows.channel == name for name in ("roughness", "return_rate"))
        assert odd[rough].min() >= 0.0
        assert odd[rate].max() <= 0.0
        shares.append(np.mean(odd[rough | rate] != 0))
    assert 0.03 < np.mean(shares) < 0.09
    assert max(shares) < 0.2


def test_few_returns_are_lost_where_nothing_acts(small):
    "A share of 0.2 % at most, over many draws"
    rate = small.rows.channel == "return_rate"
    lost = [-scatter(small.rows, np.random.default_rng(seed))[rate].mean() for seed in range(50)]
    assert 0.0005 < np.mean(lost) < 0.0015
    assert max(lost) < 0.004
