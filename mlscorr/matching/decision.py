"""Which pairs are used."""

from dataclasses import dataclass

import numpy as np

from mlscorr.matching.hypotheses import MOVED
from mlscorr.matching.marginals import Marginals

SURE = 0.99  # probability of a match, given all others, from which it is used
SOUND = 0.9  # probability that its surveyed point isn't elsewhere; the outlier test follows
LEAST_SOUND = 0.01  # the same by one pass alone, whatever the others say
CLAIMED = 0.5  # probability of a pair from which it tells of its surveyed point
TINY = 1e-12  # of probability, against division by zero


@dataclass(frozen=True)
class Decision:
    """The matches, and what they rest on; n observations in order of time, k control points.

    Parameters
    ----------
    column : (n,) int array
        Control point of each observation, -1 for none.
    probability : (n,) array
        Of that match.
    wrong : (k,) array
        Probability that a surveyed point lies elsewhere than its target, by all passes.
    passes : (k,) int array
        Number of observations that tell it.
    marginals : Marginals
    """

    column: np.ndarray
    probability: np.ndarray
    wrong: np.ndarray
    passes: np.ndarray
    marginals: Marginals


def decide(pairs, found, k):
    """Decision on all pairs by their Marginals.

    Whether a surveyed point lies where its target is, all observations of it decide together.
    """
    rest = np.clip(1.0 - found.sound - found.moved, TINY, None)
    seen = pairs.alike & (found.sound + found.moved >= CLAIMED)
    odds = np.log(found.moved / MOVED + rest) - np.log(found.sound / (1.0 - MOVED) + rest)
    odds = np.log(MOVED / (1.0 - MOVED)) + np.bincount(pairs.control[seen], odds[seen], k)
    wrong = 1.0 / (1.0 + np.exp(-np.clip(odds, -100.0, 100.0)))
    certainty = found.sound / (found.sound + rest)
    used = pairs.alike & (certainty >= SURE) & (found.sound >= LEAST_SOUND)
    used = np.flatnonzero(used & (wrong[pairs.control] <= 1.0 - SOUND))
    n = len(pairs.first) - 1
    row = np.repeat(np.arange(n), np.diff(pairs.first))[used]
    column, probability = np.full(n, -1), np.zeros(n)
    column[row], probability[row] = pairs.control[used], certainty[used]
    passes = np.bincount(pairs.control[seen], minlength=k)
    return Decision(column, probability, wrong, passes, found)
