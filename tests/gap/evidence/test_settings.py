"""Numbers that follow from others."""

import pytest

from mlscorr.gap.evidence import SETTINGS
from mlscorr.gap.evidence.settings import Settings


def test_quantile_and_band_are_those_of_the_confidence():
    "1.96 sigmas and percentiles 2.5 and 97.5 hold 95 % of a normal distribution"
    assert SETTINGS.quantile == pytest.approx(1.96, abs=1e-4)
    assert SETTINGS.band == pytest.approx((2.5, 97.5))
    assert Settings(confidence=0.5).band == pytest.approx((25.0, 75.0))


def test_priors_are_shares():
    "Of kinds of labels, of shapes, of noise and of roughness they sum to one each"
    shares = (
        dict(SETTINGS.prior).values(),
        dict(SETTINGS.noise_scales).values(),
        dict(SETTINGS.roughness).values(),
        dict(SETTINGS.roughness_common).values(),
        dict(SETTINGS.raised).values(),
        [shape[2] for shape in SETTINGS.shapes],
    )
    assert [sum(share) for share in shares] == pytest.approx([1.0] * len(shares))
