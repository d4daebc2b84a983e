"""Cases on which a decision is learned."""

import numpy as np
import pytest
from gap_training.cases import SHARES, draw_case, known_mechanisms
from gap_training.worlds import World

from tests.beds.places import ROOT

WITHHELD = ROOT / "tests" / "withheld" / "mechanisms.py"


@pytest.fixture(scope="module")
def world():
    "A world with patches and their roughness"
    return World.random(5)


@pytest.mark.parametrize("kind", SHARES)
def test_what_acts_is_in_the_truth(world, kind):
    "Names are as many as the kind has; without the withheld effect; unlike all effects outside"
    case = draw_case(world, np.random.default_rng(3), known_mechanisms(), kind, 4.0)
    assert case.kind == kind
    assert len(case.names) == {"clean": 0, "pair": 2}.get(kind, 1)
    known = {sign.name for sign in case.signatures}
    if kind == "withheld":
        assert case.truth == "unknown"
        assert case.names[0] not in known
    if kind == "outside":
        assert case.truth == "unknown"
        assert max(case.likeness.values()) < 0.8
    if kind in ("single", "pair"):
        assert set(case.truth.split("+")) == set(case.names) <= known


def test_the_ten_withheld_mechanisms_train():
    "They stood in the study on which constants were set, so they grade nothing"
    assert "brake dive" in known_mechanisms(WITHHELD)
    assert len(known_mechanisms(WITHHELD)) == len(known_mechanisms()) + 10
