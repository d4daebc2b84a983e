"""Effects of a synthetic survey that differ from each other, and mechanisms unlike all."""

import numpy as np
import pytest
from gap_training.cases import known_mechanisms
from gap_training.worlds import World

from mlscorr.effects.catalogue import SYSTEMATIC
from mlscorr.gap.evidence import SETTINGS
from mlscorr.gap.plan import ATTEMPTS, Ruler, draw_effects, draw_mechanism, names_to_try
from mlscorr.gap.plan.draws import likeness, shift_by


@pytest.fixture(scope="module")
def world():
    "A world with its ruler, and all that the library has in it"
    made = World.random(5)
    rows, _, survey = made.errors(np.random.default_rng(1))
    return Ruler.of(rows, survey), made.signatures


def test_names_are_drawn_when_they_are_asked_for():
    "The given ones first, then ATTEMPTS of the pool; what nobody asks for uses up no chance"
    rng = np.random.default_rng(1)
    same = np.random.default_rng(1)
    names = names_to_try(("a", "b"), rng, ["first"])
    assert [next(names), next(names)] == ["first", str(same.choice(("a", "b")))]
    assert rng.random() == same.random()
    assert len(list(names)) == ATTEMPTS - 1


def test_two_effects_are_of_their_size_and_unlike_each_other(world):
    "Each is 4 MDB or as much as is credible; neither is the other to nine tenths"
    ruler, known = world
    rng = np.random.default_rng(2)
    drawn = draw_effects(ruler, known, names_to_try(SYSTEMATIC, rng), 2, 4.0, rng)
    (first, _), (second, like) = drawn
    assert first.effect.name != second.effect.name
    assert like[first.effect.name] < SETTINGS.same
    for sized in (first, second):
        assert 0.5 <= sized.mdb <= 4.0 + 1e-9
        assert ruler.size(sized.shift) == pytest.approx(sized.mdb, rel=1e-6)


def test_what_can_never_be_two_effects_is_none(world):
    "The same name over and over is one effect"
    ruler, known = world
    rng = np.random.default_rng(2)
    assert draw_effects(ruler, known, ["range_bias"] * 5, 2, 4.0, rng) is None


def test_a_mechanism_moves_points_by_its_size(world):
    "Called, it makes the shift that it was sized by; no effect explains nine tenths of that"
    ruler, known = world
    rng = np.random.default_rng(3)
    mechanisms = known_mechanisms()
    names = names_to_try(list(mechanisms), rng)
    moved, shift, like = draw_mechanism(ruler, known, names, mechanisms, 5.0, rng)
    assert shift_by(ruler, moved) == pytest.approx(shift, rel=1e-9, abs=1e-12)
    assert ruler.size(shift) == pytest.approx(5.0, rel=1e-6)
    assert abs(moved.size) <= mechanisms[moved.name][1][1]
    assert like == pytest.approx(likeness(ruler, shift, known))
    assert max(like.values()) < 0.9
