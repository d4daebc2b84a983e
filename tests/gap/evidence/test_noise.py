"""Noise classes in rows whose noise is known."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from tests.gap.inference import named, surveyed


@pytest.mark.long
def test_noise_is_named_alone_and_found_again_beside_a_cause(with_surface):
    "range_noise shows in the roughness, with and without a range bias"
    g, signs = with_surface
    noise = make_effect("range_noise", magnitude=0.006)
    bias = make_effect("range_bias", magnitude=0.02)
    assert named(surveyed(g, 35, noise), g, signs).label == "range_noise"
    both = named(surveyed(g, 35, noise, bias), g, signs).label
    assert set(both.split("+")) == {"range_noise", "range_bias"}


@pytest.mark.long
def test_patches_that_are_no_planes_are_no_noise(with_surface):
    "One patch in twelve fifteen times as rough as the scanner: leaves and kerbs; and noise beside"
    g, signs = with_surface
    for effects, label in (
        ((), "none"),
        ((make_effect("range_noise", magnitude=0.006),), "range_noise"),
    ):
        rows = surveyed(g, 40, *effects)
        rough = np.flatnonzero(rows.channel == "roughness")[::12]
        residual = rows.residual.copy()
        residual[rough] += np.random.default_rng(0).uniform(3.0, 6.0, len(rough))
        assert named(replace(rows, residual=residual), g, signs).label == label
