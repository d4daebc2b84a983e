"""Sizes and sentences of effects in plain words."""

import pytest

from mlscorr.effects import EFFECTS, SizeEstimate, effect_class
from mlscorr.wording import size


@pytest.mark.parametrize("kind", EFFECTS, ids=lambda kind: kind.name)
def test_every_effect_has_a_sentence_for_each_direction(kind):
    "Size and sign of each of the effects reach the reader in plain words"
    both = []
    for sign in (1, -1):
        numbers = {name: SizeEstimate(sign * 0.031, 0.0042, "m") for name in kind.parts}
        both.append(kind.describe(numbers, " at noon"))
        assert "31 mm ± 4 mm" in both[-1] or kind.is_wave()
        assert both[-1].endswith(".") and "{" not in both[-1] and "_" not in both[-1]
    assert (both[0] != both[1]) == (not kind.is_scatter() and not kind.is_wave())
    assert kind.describe({}) == kind.meaning


def test_a_vector_is_said_by_the_parts_that_differ_from_zero():
    "Parts beyond two sigmas alone; all when there is none, and a dash when none is known"
    kind = effect_class("lever_arm")
    right = SizeEstimate(-0.093, 0.004, "m")
    up = SizeEstimate(0.019, 0.017, "m")
    text = kind.describe({"right": right, "up": up})
    assert text.endswith("the scanner is actually 93 mm ± 4 mm farther left.")
    text = kind.describe({"forward": SizeEstimate(-0.01, 0.02, "m"), "up": up})
    assert text.endswith(
        "the scanner is actually 10 mm ± 20 mm farther back and 19 mm ± 17 mm higher."
    )
    assert kind.describe({"up": SizeEstimate(None, None, "m")}).endswith("is actually –.")


def test_a_wave_is_said_by_its_amplitude():
    "3 and 4 quadratures make 5, and sigma follows; a dash where one of them is not known"
    kind = effect_class("angle_eccentricity")
    values = [SizeEstimate(3e-4, 1e-5, "rad"), SizeEstimate(-4e-4, 1e-5, "rad")]
    text = kind.describe(dict(zip(kind.parts, values, strict=True)))
    assert "wrong by up to 0.500 mrad ± 0.010 mrad, once per turn" in text
    values[1] = SizeEstimate(float("nan"), None, "rad")
    assert "up to –, once" in kind.describe(dict(zip(kind.parts, values, strict=True)))


def test_a_unit_that_no_scale_knows_stays_as_it_is():
    "A user's own unit is written as it stands in the effect"
    assert size(0.0021, 0.0004, "m per (m/s)^2") == "0.0021 m per (m/s)^2 ± 0.0004 m per (m/s)^2"
