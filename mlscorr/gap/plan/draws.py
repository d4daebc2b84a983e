"""What acts in a made-up survey: effects that are unlike each other, or a mechanism unlike all."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from mlscorr.effects import effect_class
from mlscorr.gap.evidence import SETTINGS
from mlscorr.gap.plan.sizing import Ruler, SizedEffect, draw_effect, likeness, shift_by
from mlscorr.gap.signatures import Signature
from mlscorr.simulate import Described, RecordedPoints

ATTEMPTS = 12  # names or surveys, estimated: where half show nothing, one case in 4000 fails
LIKENESS = 0.8  # squared correlation with an effect, estimated: more is that effect by another name


def names_to_try(
    pool: Sequence[str], rng: np.random.Generator, first: Iterable[str] = ()
) -> Iterator[str]:
    """ATTEMPTS names and those that come first, drawn when they are asked for.

    Parameters
    ----------
    pool : sequence of str
        From which the others are drawn.
    rng : numpy.random.Generator
    first : iterable of str
    """
    return chain(first, (str(rng.choice(pool)) for _ in range(ATTEMPTS)))


def draw_effects(
    ruler: Ruler,
    known: Sequence[Signature],
    names: Iterable[str],
    number: int,
    mdb: float,
    rng: np.random.Generator,
) -> list[tuple[SizedEffect, dict[str, float]]] | None:
    """Effects that are unlike each other, each with its likeness to all that is known; None where
    the geometry shows too few.

    Parameters
    ----------
    ruler : Ruler
    known : sequence of Signature
        All that the library has in this survey.
    names : iterable of str
        That are tried.
    number : int
        Of effects.
    mdb : float
        Size in minimal detectable biases.
    rng : numpy.random.Generator
    """
    drawn: list = []
    for name in names:
        if name in (sized.effect.name for sized, _ in drawn):
            continue
        sized = draw_effect(ruler, effect_class(name), mdb, rng)
        if sized is None:
            continue
        like = likeness(ruler, sized.shift, known)
        if all(like.get(other.effect.name, 0.0) < SETTINGS.same for other, _ in drawn):
            drawn.append((sized, like))
        if len(drawn) == number:
            return drawn
    return None


@dataclass(frozen=True)
class SizedMechanism:
    """A mechanism that no library knows, of a known size: moves points when it is called.

    Parameters
    ----------
    name : str
    function : function
        From points, a size and a generator to displacements (k, 3). Units: m.
    chance : int
        Seed of what it draws.
    size : float
        In its unit.
    """

    name: str
    function: Callable
    chance: int
    size: float = 1.0

    def __call__(self, points: RecordedPoints) -> np.ndarray:
        """Displacements (k, 3) of points on the map. Units: m."""
        return self.function(points, self.size, np.random.default_rng(self.chance))


def draw_mechanism(
    ruler: Ruler,
    known: Sequence[Signature],
    names: Iterable[str],
    mechanisms: Described,
    mdb: float,
    rng: np.random.Generator,
) -> tuple[SizedMechanism, np.ndarray, dict[str, float]] | None:
    """A mechanism that is unlike all effects, the shift (m,) of residuals that it makes, and its
    likeness; None where the geometry shows none.

    Parameters
    ----------
    ruler, known, names, mdb, rng
        As of draw_effects.
    mechanisms : dict
        Function, unit with largest size, and lead, by name.
    """
    for name in names:
        function, (_, largest), _ = mechanisms[name]
        moved = SizedMechanism(name, function, int(rng.integers(2**32)), float(rng.choice([-1, 1])))
        shift = shift_by(ruler, moved)
        unit = ruler.size(shift)
        if unit == 0.0 or mdb / unit > largest:
            continue
        like = likeness(ruler, shift, known)
        if max(like.values(), default=0.0) < LIKENESS:
            return replace(moved, size=mdb / unit * moved.size), mdb / unit * shift, like
    return None
