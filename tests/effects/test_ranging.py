"""Effects of beam and ranges, and lost returns."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import (
    make_effect,
)
from tests.effects.bed import (
    GRAZING,
    REFERENCE,
    RETURNS,
    WALK_INTENSITY,
    applied,
)


def test_dropout_loses_its_share():
    "5 % of 8000 returns, to 1 %; lost ones stay lost"
    kept = applied("dropout").kept
    assert 1.0 - kept.mean() == pytest.approx(0.05, abs=0.01)
    none = replace(RETURNS, kept=np.zeros(len(RETURNS), dtype=bool))
    effect = make_effect("dropout", magnitude=0.5)
    assert not effect.apply(none, REFERENCE, np.random.default_rng(1)).kept.any()


def test_the_beam_widens_by_milliradians():
    "0.35 mrad on top of 0.3 mrad"
    assert applied("beam_divergence") == pytest.approx(6.5e-4, abs=1e-12)


def test_grazing_returns_and_dark_ones_stay_finite():
    "An incidence of 90 deg and an intensity of zero have a bound"
    worst = replace(RETURNS, incidence=np.zeros(len(RETURNS)), intensity=np.zeros(len(RETURNS)))
    bias = make_effect("incidence_bias", magnitude=0.01).apply(worst, REFERENCE).range
    assert bias - RETURNS.range == pytest.approx(0.01 * (1 / GRAZING - 1))
    walk = make_effect("range_walk", magnitude=0.01).apply(worst, REFERENCE).range
    assert walk - RETURNS.range == pytest.approx(-0.01 * np.log10(WALK_INTENSITY))
