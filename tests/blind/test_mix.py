"""The cases of a blind check."""

import numpy as np
import pytest

from mlscorr.blind.mix import mix
from mlscorr.blind.settings import SETTINGS
from mlscorr.effects.catalogue import RANDOM, SYSTEMATIC


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
