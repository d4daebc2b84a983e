"""Sizes from which on noise is detected: against Fisher information, and against evidence."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.evidence import (
    SETTINGS,
    Observations,
    detectable_size,
    error_models,
    model_likelihood,
)
from mlscorr.gap.evidence._noise import channel_evidence, draw_channels
from mlscorr.gap.residuals import background, with_loss_variance
from mlscorr.gap.signatures import Bench


def kind_of(signs, name):
    return next(s for s in signs if s.name == name)


def size_of(g, kind, mdb=1.0):
    return detectable_size(g.rows, Observations.of(g.rows, g.background), kind, mdb)


def test_lost_returns_are_found_beyond_what_all_patches_may_be_off_by(with_surface):
    "A common offset of sigma s: 4.13 s, beyond what chance loses in all patches, within a third"
    g, signs = with_surface
    size = size_of(g, kind_of(signs, "dropout"))
    assert size == pytest.approx(SETTINGS.detectable * SETTINGS.lost, rel=0.33)


def test_noise_that_makes_all_patches_alike_rough_hides_in_what_they_may_be_off_by(with_surface):
    "The same growth everywhere is found later than Fisher information without offset would say"
    g, signs = with_surface
    kind = kind_of(signs, "range_noise")
    rough = g.rows.channel == "roughness"
    alike = replace(kind, growth=np.where(rough, np.median(kind.growth[rough]), 0.0))
    sigma = 1 / np.sqrt((alike.growth[rough] ** 2 / g.rows.noise[rough]).sum())
    plain = np.sqrt(SETTINGS.detectable * sigma)
    assert size_of(g, alike) > 1.5 * plain
    assert plain < size_of(g, kind) < size_of(g, alike)


@pytest.mark.parametrize("name", ["range_noise", "angle_noise", "time_jitter", "dropout"])
def test_evidence_of_such_noise_is_that_of_a_bias_of_as_many_sigmas(with_surface, name):
    "Roughness and rates drawn with noise of 2 MDB: log evidence of 8.3 sigmas, half of it and up"
    g, signs = with_surface
    kind = kind_of(signs, name)
    size = size_of(g, kind, 2.0)
    gains = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        rows = replace(g.rows, residual=np.sqrt(g.rows.noise) * rng.standard_normal(len(g.rows)))
        change = Bench(rows, g.survey).change(kind.effect(np.array([size])), rng)
        residual = rows.residual + np.log1p(change.growth) + change.shift
        rows = with_loss_variance(replace(rows, residual=residual))
        gains.append(channel_evidence(rows, kind, np.array([size]), draw_channels(rows, None, 0)))
    expected = 0.5 * (2.0 * SETTINGS.detectable) ** 2
    assert 0.5 * expected < np.mean(gains) < 1.5 * expected


def test_a_noisy_pos_is_found_where_no_drift_explains_its_noise(with_surface):
    "Residuals drawn with 2 MDB of noise of fixes: log evidence of 8.3 sigmas within a half"
    g, signs = with_surface
    kind = kind_of(signs, "position_noise")
    observed = Observations.of(g.rows, g.background)
    size = size_of(g, kind, 2.0)
    models = error_models()
    stated = observed.columns(g.rows.residual[:, None])
    best = max(models, key=lambda model: model_likelihood(observed, model, stated)[0])
    noisy = replace(best, fixes=size)
    drawn = observed.whitener(noisy).draw(np.random.default_rng(5), 200)
    without = np.array([model_likelihood(observed, model, drawn) for model in models])
    gain = np.mean(model_likelihood(observed, noisy, drawn) - np.logaddexp.reduce(without, axis=0))
    assert gain == pytest.approx(0.5 * (2.0 * SETTINGS.detectable) ** 2, rel=0.5)


def test_what_does_not_show_has_no_size(with_surface):
    "No row depends on it: not a number"
    g, signs = with_surface
    nothing = np.zeros(len(g.rows))
    kind = replace(kind_of(signs, "range_noise"), growth=nothing, variance=nothing)
    assert np.isnan(size_of(g, kind))


def test_one_patch_can_not_say_that_all_returns_are_lost(with_surface):
    "A single return rate, which may be odd: no share of lost returns shows as 20 MDB"
    g, signs = with_surface
    lone = np.append(np.flatnonzero(g.rows.metric), np.argmax(g.rows.channel == "return_rate"))
    rows = g.rows.select(lone)
    whole = kind_of(signs, "dropout")
    columns = {name: getattr(whole, name)[lone] for name in ("jacobian", "variance", "growth")}
    observed = Observations.of(rows, background(rows, g.survey))
    assert np.isnan(detectable_size(rows, observed, replace(whole, **columns), 20.0))
