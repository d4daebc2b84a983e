"""Numbers that follow from others."""

import pytest
from scipy.stats import norm

from mlscorr.gap.evidence import SETTINGS
from mlscorr.gap.evidence.settings import Settings
from mlscorr.pos import SETTINGS as POS


def test_quantile_and_band_are_those_of_the_confidence():
    "A half of a normal distribution lies within 0.6745 sigmas, between percentiles 25 and 75"
    half = Settings(confidence=0.5)
    assert half.quantile == pytest.approx(norm.ppf(0.75), abs=1e-9)
    assert half.band == pytest.approx((25.0, 75.0))


def test_priors_are_shares():
    "Of kinds of labels, of shapes, of noise and of roughness they sum to one each"
    shares = (
        dict(SETTINGS.prior).values(),
        dict(SETTINGS.noise_scales).values(),
        dict(SETTINGS.roughness).values(),
        dict(SETTINGS.roughness_common).values(),
        dict(POS.increased_scales).values(),
        [shape[2] for shape in POS.process_shapes],
    )
    assert [sum(share) for share in shares] == pytest.approx([1.0] * len(shares))
