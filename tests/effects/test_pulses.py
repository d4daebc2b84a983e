"""Returns of a pulse share what is random in its time and angle."""

from dataclasses import fields

import numpy as np

from mlscorr.effects import (
    Returns,
    make_effect,
)
from mlscorr.effects.stages import pulse_number
from tests.effects.bed import (
    REFERENCE,
    RETURNS,
    SMALL,
)


def test_returns_of_one_pulse_share_its_time_and_angle():
    "First and last return of a pulse get the same jitter and angle noise, each its own range noise"
    twice = Returns(*(np.repeat(getattr(RETURNS, f.name), 2) for f in fields(Returns)))
    np.testing.assert_array_equal(pulse_number(twice), np.repeat(np.arange(len(RETURNS)), 2))
    apart = Returns(*(np.tile(getattr(RETURNS, f.name), 2) for f in fields(Returns)))
    np.testing.assert_array_equal(pulse_number(apart), np.tile(np.arange(len(RETURNS)), 2))
    for name, field in (("time_jitter", "gps_time"), ("angle_noise", "angle")):
        effect = make_effect(name, **SMALL[name])
        noisy = getattr(effect.apply(twice, REFERENCE, np.random.default_rng(1)), field)
        np.testing.assert_array_equal(noisy[::2], noisy[1::2])
    effect = make_effect("range_noise", magnitude=0.005)
    noisy = effect.apply(twice, REFERENCE, np.random.default_rng(1)).range
    assert (noisy[::2] != noisy[1::2]).all()
