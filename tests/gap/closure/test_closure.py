"""Shrinking of a gap on rows that were not used to estimate the size of its cause."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from tests.gap.closures import Bed


def test_a_cause_closes_its_gap_where_its_size_was_not_looked_for(late):
    "Of the clock's shift 98 % go truly; so it is stated to 3 %, and the interval holds the truth"
    closure = late.close("time_offset")
    truth = late.simulated((late.effects[0],))
    size = late.whitened(truth)
    left = [
        late.whitened(truth - each.shift) / size
        for each in late.folds(late.cause("time_offset")).predicted
    ]
    gone = 1 - np.mean(left)
    assert gone > 0.98
    assert closure.shrink == pytest.approx(gone, abs=0.03)
    assert closure.interval[0] <= gone <= closure.interval[1] <= 1.0
    assert closure.before > closure.null_band[1] > closure.after >= 0
    assert 1 - (closure.after / closure.before) ** 2 == pytest.approx(closure.shrink)
    assert closure.gap.after < closure.gap.before
    assert closure.probability == 1.0
    assert "observations of check points were never used" in closure.held_out


def test_nothing_added_closes_nothing(late):
    "Without a cause the gap is the same before and after"
    closure = late.close("none")
    assert closure.shrink == 0.0
    assert closure.before == closure.after
    assert closure.held_out == "Nothing was added to the simulator."


def test_a_simulator_with_half_of_the_effect_closes_three_quarters(late):
    "Of a shift that it makes half as large a quarter of the square stays"

    def half(effects):
        return 0.5 * late.simulated(effects)

    assert late.close("time_offset", half).shrink == pytest.approx(0.75, abs=0.05)


def test_a_simulator_that_adds_the_opposite_makes_the_gap_grow(late):
    "Twice the shift stays: four times the square, stated as below zero and within [-1, 1]"
    closure = late.close("time_offset", lambda effects: -late.simulated(effects))
    assert closure.after == pytest.approx(2 * closure.before, rel=0.1)
    assert closure.shrink == pytest.approx(-0.75, abs=0.05)
    assert -1 <= closure.interval[0] <= closure.interval[1] <= 1


@pytest.mark.long
def test_noise_closes_within_its_bounds(shaky):
    "A POS noisier than stated: the size found in the other blocks closes 80 to 100 % of its gap"
    closure = shaky.close("position_noise")
    assert closure.kind == "position"
    assert 0.8 < closure.shrink <= 1.0
    assert -1 <= closure.interval[0] <= closure.shrink <= closure.interval[1] <= 1
    assert len(closure.folds) == 5


@pytest.mark.long
def test_lost_returns_close_like_any_other_cause():
    "A tenth of the pulses is lost: put in at the size that is found, most of the square is gone"
    closure = Bed(make_effect("dropout", magnitude=0.1)).close("dropout")
    assert closure.kind == "returns"
    assert closure.before == pytest.approx(-10.0, abs=0.5)  # %
    assert closure.before < closure.after < 0
    gone = 1 - (closure.after / closure.before) ** 2
    assert closure.shrink == pytest.approx(gone, abs=0.01)
    assert closure.interval[0] < closure.shrink < closure.interval[1]
    assert closure.before < closure.null_band[0]
