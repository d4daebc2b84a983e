"""Each effect alone in the simulator."""

import numpy as np
import pytest

from mlscorr.gap.closure import lone_effects
from mlscorr.gap.evidence import infer_causes
from mlscorr.gap.residuals import background


@pytest.mark.long
def test_the_effect_that_acts_leaves_least(late):
    "Of five effects the clock, which acts, takes the systematic gap away; others leave a third"
    rows = late.rows
    rng = np.random.default_rng(1)
    inference = infer_causes(rows, background(rows, late.survey), late.survey, late.signs, rng, 20)
    alone = lone_effects(rows, late.signs, inference, rng)
    assert alone[0].effect == "time_offset"
    assert alone[0].after < 0.25 * alone[0].before
    assert min(each.after for each in alone[1:]) > 0.3 * alone[0].before
    assert len({each.before for each in alone}) == 1
    assert [each.effect for each in alone].count("position_noise") == 0
