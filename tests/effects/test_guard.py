"""Errors in the code of a user's own effect are reported with its file and line."""

import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from mlscorr.effects import Effect, Reference, Returns, quantity

START = 413_000.0  # s


def returns():
    n = 5
    kept = np.ones(n, bool)
    return Returns(START + np.arange(n), np.zeros(n), np.full(n, np.nan), *np.ones((2, n)), kept)


def effect_of(change, at="clock"):
    "An effect whose change of a value is a function"

    @dataclass(frozen=True)
    class Own(Effect):
        stage: ClassVar = at
        magnitude: float = quantity("s", 1.0, "no more", typical=0.1, source="a test")

        def _change(self, value, reference, rng):
            return change(value)

    return Own(0.1)


def applied(change, value, at="clock"):
    return effect_of(change, at).apply(value, Reference(START, START + 5.0, np.zeros(3)))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda value: value.speed, "line \\d+, .*test_guard.py.*AttributeError.*speed"),
        (lambda value: sys.exit(0), "SystemExit: 0"),
        (lambda value: None, "it returns a NoneType"),
        (lambda value: replace(value, kept=0.5 * value.kept), "kept is float64 .5,., not bool"),
        (lambda value: replace(value, gps_time=1j * value.gps_time), "gps_time is complex128"),
        (
            lambda value: replace(value, gps_time=value.gps_time[:, None]),
            "gps_time is float64 .5, 1.",
        ),
        (lambda value: replace(value, gps_time=value.gps_time / 0.0), "5 of 5 values of gps_time"),
    ],
)
def test_what_cannot_take_the_place_of_the_value_is_refused(change, said):
    "Another type, shape or kind of numbers, no numbers, and whatever else it raises"
    with np.errstate(divide="ignore"), pytest.raises(ValueError, match=said):
        applied(change, returns())


def test_a_sum_of_other_shape_is_refused_before_it_fills_the_memory():
    "A column beside a row would be a table of all pairs"
    own = effect_of(None)
    object.__setattr__(own, "_change", lambda *given: Effect._change(own, *given))
    object.__setattr__(own, "_error", lambda value, *_: np.ones((len(value), 1)))
    with pytest.raises(ValueError, match="can't be applied"):
        own.apply(returns(), Reference(START, START + 5.0, np.zeros(3)))


def test_nothing_is_written_into_what_was_recorded():
    "A change in place is refused, and what it would have changed stays"
    value = returns()

    def in_place(given):
        given.gps_time[:] = 0.0
        return given

    with pytest.raises(ValueError, match="read-only"):
        applied(in_place, value)
    np.testing.assert_array_equal(value.gps_time, returns().gps_time)


def test_columns_that_stay_are_the_same_ones():
    "A comparison by identity shows the changed columns; a column without any change may stay"
    value = returns()
    changed = applied(lambda given: replace(given, gps_time=given.gps_time + 1.0), value)
    np.testing.assert_array_equal(changed.gps_time, value.gps_time + 1.0)
    assert all(getattr(changed, n) is getattr(value, n) for n in ("range", "angle", "kept"))
    assert changed.range.flags.writeable


def test_a_divergence_is_a_number():
    "A word in its place is refused"
    assert applied(lambda value: 2 * value, 1e-3, "beam") == 2e-3
    with pytest.raises(ValueError, match="divergence is <U4"):
        applied(lambda value: "wide", 1e-3, "beam")
