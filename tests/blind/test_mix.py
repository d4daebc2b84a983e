"""The cases of a blind check."""

import numpy as np
import pytest

from mlscorr.blind import mix
from mlscorr.blind._mix import causes
from mlscorr.blind._settings import SETTINGS
from mlscorr.effects import catalogue, register
from mlscorr.effects.catalogue import RANDOM, SYSTEMATIC
from tests.beds.own_effects import Squat


@pytest.mark.parametrize("seed", [1, 2])
def test_the_mix_holds_each_kind_and_each_effect_in_turn(seed):
    "Of 300 cases 20 % are clean, each effect is withheld twice or more, none lacks a name"
    cases = mix(300, np.random.default_rng(seed), ("a", "b"))
    kinds = [case.kind for case in cases]
    assert {kind: kinds.count(kind) for kind, _ in SETTINGS.shares} == {
        kind: round(300 * share) for kind, share in SETTINGS.shares
    }
    withheld = [case.names[0] for case in cases if case.kind == "withheld"]
    assert min(withheld.count(name) for name in SYSTEMATIC) >= 2
    for case in cases:
        assert case.without in SYSTEMATIC
        assert (case.without in case.names) == (case.kind == "withheld")
        assert case.kind != "noise" or case.names[0] in RANDOM
    assert "outside" not in {case.kind for case in mix(50, np.random.default_rng(seed))}


def test_an_effect_of_ones_own_is_drawn_like_the_others(monkeypatch):
    "A registered effect is single, withheld and in a pair; without it each case is as before"
    monkeypatch.setattr(catalogue, "_registered", {})
    assert causes() == SYSTEMATIC
    assert causes(is_random=True) == RANDOM
    register(Squat)
    assert causes() == (*SYSTEMATIC, "squat")
    assert causes(is_random=True) == RANDOM
    cases = mix(300, np.random.default_rng(1))
    for kind in ("single", "withheld", "pair"):
        assert any("squat" in case.names for case in cases if case.kind == kind), kind
