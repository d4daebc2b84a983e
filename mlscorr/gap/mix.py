"""What is wrong with each survey of a blind check: of which kind, which effects, of what size."""

from dataclasses import dataclass

import numpy as np

from mlscorr.effects import EFFECTS

# Shares of the cases. None without effects is rare in practice, so a wrong alarm there costs most.
SHARES = {
    "clean": 0.20,
    "noise": 0.08,
    "single": 0.37,
    "pair": 0.08,
    "withheld": 0.17,  # a single effect that the library lacks
    "outside": 0.10,  # a mechanism that no library knows
}
SINGLE = {0.75: 0.08, 1.5: 0.08, 2.0: 0.27, 3.0: 0.27, 4.0: 0.1, 5.0: 0.1, 8.0: 0.1}  # MDB: share
CLEAR = (3.0, 6.0)  # MDB, of pairs, withheld ones and mechanisms
NOISY = (2.0, 8.0)
SYSTEMATIC = tuple(kind.name for kind in EFFECTS if not kind.random and kind.stage != "beam")
RANDOM = tuple(kind.name for kind in EFFECTS if kind.random)


@dataclass(frozen=True)
class Case:
    """What one survey should have: kind, names of effects or of a mechanism, size, and names to
    take instead where the geometry doesn't show one. The library lacks ``without``."""

    kind: str
    names: tuple[str, ...]
    mdb: float
    without: str


def mix(cases, rng, mechanisms=()):
    """Cases in random order; names of one kind come in turn, so that all are there alike.

    Parameters
    ----------
    cases : int
    rng : numpy.random.Generator
    mechanisms : sequence of str
        Names of mechanisms outside the library; without them there are no such cases.
    """
    shares = {k: v for k, v in SHARES.items() if mechanisms or k != "outside"}
    kinds = np.repeat(list(shares), _whole(cases, shares))
    turns = {
        "noise": _turns(RANDOM, rng),
        "single": _turns(SYSTEMATIC, rng),
        "withheld": _turns(SYSTEMATIC, rng),
        "outside": _turns(tuple(mechanisms), rng),
    }
    return [_case(str(kind), turns, rng) for kind in rng.permutation(kinds)]


def _case(kind, turns, rng):
    names, mdb = (), 0.0
    if kind == "pair":
        names = tuple(map(str, rng.choice(SYSTEMATIC, 2, replace=False)))
    elif kind in turns:
        names = (next(turns[kind]),)
    if kind == "single":
        mdb = float(rng.choice(list(SINGLE), p=list(SINGLE.values())))
    elif kind != "clean":
        mdb = float(rng.uniform(*(NOISY if kind == "noise" else CLEAR)))
    other = [name for name in SYSTEMATIC if name not in names]
    without = str(rng.choice(other))
    return Case(kind, names, mdb, names[0] if kind == "withheld" else without)


def _turns(names, rng):
    """Names without end, each once before any comes again."""
    while names:
        yield from map(str, rng.permutation(names))


def _whole(total, shares):
    """Whole numbers of a total in proportion to shares, by the largest remainders."""
    exact = total * np.array(list(shares.values())) / sum(shares.values())
    whole = exact.astype(int)
    order = np.argsort(whole - exact, kind="stable")
    whole[order[: total - whole.sum()]] += 1
    return whole
