"""Causes with their parameters, on surveys with effects of known size."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.evidence import infer_causes
from tests.gap.inference import surveyed


@pytest.mark.parametrize(
    "effect",
    [
        make_effect("time_offset", magnitude=0.006),
        make_effect("range_bias", magnitude=-0.02),
        make_effect("lever_arm", magnitude=[0.06, -0.08, 0.15]),
        make_effect("boresight", magnitude=[0.06, -0.08, 0.10]),
    ],
    ids=lambda effect: effect.name,
)
def test_an_effect_is_named_and_measured(effect, with_surface):
    "The right label, and the truth within four sigmas of the estimate"
    g, signs = with_surface
    rows = surveyed(g, 31, effect)
    found = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), replicas=20)
    assert found.verdict.label == effect.name
    assert found.verdict.p_value < 0.01
    best = found.causes[0]
    truth = np.atleast_1d(effect.magnitude)
    for parameter, true in zip(best.parameters, truth, strict=True):
        assert abs(parameter.estimate - true) < 4 * parameter.sigma
        assert 0 < parameter.detectable < 10 * parameter.sigma
    assert best.effects[0].name == effect.name
    assert abs(found.where.after) < found.where.before
