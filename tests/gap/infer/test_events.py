"""Events between the times of the bank."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.infer.causes import infer_causes
from tests.beds.gap_inference import surveyed


def test_an_event_is_found_between_the_times_of_the_bank(with_surface):
    "Time within 1 s, width within 30 %, size within four sigmas"
    g, signs = with_surface
    effect = make_effect("position_bump", magnitude=[0.3, 0.2, -0.3], time=31.7, width=8.0)
    rows = surveyed(g, 32, effect)
    best = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).causes[0]
    assert best.effect == "position_bump"
    told = {parameter.name: parameter for parameter in best.parameters}
    assert told["time"].estimate == pytest.approx(31.7, abs=1.0)
    assert told["width"].estimate == pytest.approx(8.0, rel=0.3)
    for name, true in zip(("easting", "northing", "height"), effect.magnitude, strict=True):
        assert abs(told[name].estimate - true) < 4 * told[name].sigma
