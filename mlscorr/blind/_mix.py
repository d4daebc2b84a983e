"""Causes in the surveys of a blind check: kinds, effects, and sizes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.blind._settings import SETTINGS
from mlscorr.effects import known_effects


@dataclass(frozen=True)
class Case:
    """Specification of one survey: kind, names of effects or of a mechanism, size, and
    alternative names if the geometry does not show one. The library is without ``without``.
    """

    kind: str
    names: tuple[str, ...]
    mdb: float
    without: str


def mix(cases: int, rng: np.random.Generator, mechanisms: Sequence[str] = ()) -> list[Case]:
    """Draw cases in random order; names of one kind alternate, so that all are equally frequent.

    Parameters
    ----------
    cases : int
    rng : numpy.random.Generator
    mechanisms : sequence of str
        Names of mechanisms outside the library; without them there are no such cases.
    """
    shares = {k: v for k, v in SETTINGS.shares if mechanisms or k != "outside"}
    kinds = np.repeat(list(shares), _whole(cases, shares))
    turns = {
        "noise": _turns(causes(is_random=True), rng),
        "single": _turns(causes(), rng),
        "withheld": _turns(causes(), rng),
        "outside": _turns(tuple(mechanisms), rng),
    }
    return [_case(str(kind), turns, rng) for kind in rng.permutation(kinds)]


def causes(is_random: bool = False) -> tuple[str, ...]:
    """Names of the effects for cases: those of the library, and registered ones.

    Parameters
    ----------
    is_random : bool
        True for noise effects.
    """
    kinds = known_effects()
    if is_random:
        return tuple(kind.name for kind in kinds if kind.random)
    return tuple(kind.name for kind in kinds if not kind.is_scatter())


def _case(kind, turns, rng):
    names = ()
    mdb = 0.0
    if kind == "pair":
        names = tuple(map(str, rng.choice(causes(), 2, replace=False)))
    elif kind in turns:
        names = (next(turns[kind]),)
    if kind == "single":
        sizes, shares = zip(*SETTINGS.single_sizes, strict=True)
        mdb = float(rng.choice(sizes, p=shares))
    elif kind != "clean":
        sizes = SETTINGS.clear_sizes
        if kind == "noise":
            sizes = SETTINGS.noise_mdb
        mdb = float(rng.uniform(*sizes))
    without = str(rng.choice([name for name in causes() if name not in names]))
    if kind == "withheld":  # drawn in any case, so that later cases do not change
        without = names[0]
    return Case(kind, names, mdb, without)


def _turns(names, rng):
    """Endless names, each once before any repetition."""
    while names:
        yield from map(str, rng.permutation(names))


def _whole(total, shares):
    """Integers of a given total in proportion to shares, by the largest remainders."""
    exact = total * np.array(list(shares.values())) / sum(shares.values())
    whole = exact.astype(int)
    whole[np.argsort(whole - exact, kind="stable")[: total - whole.sum()]] += 1
    return whole
