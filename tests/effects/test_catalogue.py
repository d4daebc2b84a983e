"""All effects together: their order, their streams, and what is refused."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.effects import (
    STAGES,
    Returns,
    apply_effects,
    effect_streams,
    in_order,
    make_effect,
)
from tests.effects.bed import (
    NAMES,
    REFERENCE,
    RETURNS,
    SMALL,
    VALUES,
    zero,
)


@pytest.mark.parametrize("name", NAMES)
def test_switching_an_effect_off_leaves_all_others_bit_for_bit(name):
    "Every effect has a stream of its own, spawned whether it is used or not"
    every = [make_effect(other, **SMALL[other]) for other in NAMES]
    off = [zero(e.name) if e.name == name else e for e in every]
    without = [e for e in every if e.name != name]
    stage = next(e.stage for e in every if e.name == name)
    for other in STAGES:
        results = []
        for effects in (every, off, without):
            streams = effect_streams(np.random.default_rng(5))
            results.append(apply_effects(effects, other, VALUES[other], REFERENCE, streams))
        for result in results[1:] if other != stage else results[2:]:
            same_as = results[0] if other != stage else results[1]
            assert_same(result, same_as)


def test_the_list_order_does_not_matter():
    "The order is fixed by stage and name, not by who listed what first"
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    every.append(make_effect("position_bump", magnitude=[0, 0, 0.1], time=20.0, width=5.0))
    assert in_order(every) == in_order(every[::-1])
    assert [list(STAGES).index(e.stage) for e in in_order(every)] == sorted(
        list(STAGES).index(e.stage) for e in every
    )


def test_blocks_of_any_size_give_the_same():
    "Streams go on from block to block, so memory's size leaves no trace"
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    for stage in ("clock", "range", "angle", "return"):
        streams = effect_streams(np.random.default_rng(6))
        whole = apply_effects(every, stage, RETURNS, REFERENCE, streams)
        streams = effect_streams(np.random.default_rng(6))
        pieces = []
        for start in range(0, len(RETURNS), 777):
            columns = (getattr(RETURNS, f.name)[start : start + 777] for f in fields(Returns))
            pieces.append(apply_effects(every, stage, Returns(*columns), REFERENCE, streams))
        for field in fields(Returns):
            joined = np.concatenate([getattr(piece, field.name) for piece in pieces])
            np.testing.assert_array_equal(joined, getattr(whole, field.name))


def assert_same(one, other):
    if isinstance(one, float):
        assert one == other
        return
    for field in fields(one):
        a = getattr(one, field.name)
        b = getattr(other, field.name)
        if isinstance(a, Rotation):
            a = a.as_quat()
            b = b.as_quat()
        np.testing.assert_array_equal(a, b)


def test_no_returns_are_no_trouble():
    "A block that hit nothing passes every stage"
    none = Returns(*(np.zeros(0, getattr(RETURNS, f.name).dtype) for f in fields(Returns)))
    streams = effect_streams(np.random.default_rng(1))
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    for stage in ("clock", "range", "angle", "return"):
        assert len(apply_effects(every, stage, none, REFERENCE, streams)) == 0


def test_a_random_effect_twice_is_refused():
    "Two would draw from one stream in turn, and blocks of other sizes would give something else"
    twice = [make_effect("range_noise", magnitude=m) for m in (0.003, 0.004)]
    with pytest.raises(ValueError, match="range_noise is listed 2 times"):
        in_order(twice)


def test_an_unknown_stage_is_refused():
    "A stage that no effect acts on is a mistyped one"
    with pytest.raises(ValueError, match="'clocks' is an unknown stage; known are beam, clock"):
        apply_effects([], "clocks", RETURNS, REFERENCE, {})
