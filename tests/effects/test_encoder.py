"""Effects of the encoder."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import (
    make_effect,
)
from tests.effects.bed import (
    REFERENCE,
    RETURNS,
)


def test_angle_scale_does_not_mind_in_which_turn_an_angle_is_given():
    "190 deg and -170 deg are the same beam"
    effect = make_effect("angle_scale", magnitude=1e-3)
    one = replace(RETURNS, angle=np.radians(np.full(len(RETURNS), 190.0)))
    other = replace(RETURNS, angle=one.angle - 2 * np.pi)
    shift = effect.apply(one, REFERENCE).angle - one.angle
    assert shift == pytest.approx(effect.apply(other, REFERENCE).angle - other.angle, abs=1e-14)
    assert shift == pytest.approx(np.radians(-0.170), abs=1e-14)
