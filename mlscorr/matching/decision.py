"""Which pairs are used."""

from dataclasses import dataclass

import numpy as np
from scipy.special import betaln, expit, logit

from mlscorr.matching._marginals import Marginals
from mlscorr.matching._pairs import CandidatePairs
from mlscorr.matching.settings import SETTINGS


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

    def moved(self, pairs: CandidatePairs) -> np.ndarray:
        """Surveyed point (n,) that each unnamed observation shows elsewhere, -1 for none.

        Where it is too probable that the point is wrong to use it, it counts: what is refused for
        that is told here.

        Parameters
        ----------
        pairs : CandidatePairs
            Those that were decided on.
        """
        column = np.full(len(self.column), -1)
        probable = pairs.same & (self.marginals.sound + self.marginals.moved >= 0.5)
        probable &= self.wrong[pairs.control] > 1.0 - SETTINGS.smallest_sound
        row = np.repeat(np.arange(len(column)), np.diff(pairs.first))
        column[row[probable]] = pairs.control[probable]
        return np.where(self.column < 0, column, -1)


def decide(pairs: CandidatePairs, marginals: Marginals, count: int, share: np.ndarray) -> Decision:
    """Decide on all pairs: of a surveyed point's place, all observations of it decide jointly.

    Parameters
    ----------
    pairs : CandidatePairs
    marginals : Marginals
    count : int
        Of control points.
    share : (p,) array
        Probabilities that the surveyed points lie elsewhere which the marginals hold already.
    """
    sound = marginals.sound
    moved = marginals.moved
    rest = np.clip(1.0 - sound - moved, np.finfo(float).eps, None)
    probable = pairs.same & (sound + moved >= 0.5)
    odds = _odds(marginals, share)
    total = np.bincount(pairs.control[probable], odds[probable], count)
    wrong = expit(logit(SETTINGS.moved_share) + total)
    passes = np.bincount(pairs.control[probable], minlength=count)
    is_wrong = wrong > 1.0 - SETTINGS.smallest_sound
    drifts = _in_drift(is_wrong, passes)[pairs.control]
    certainty = np.where(drifts, sound + moved, sound / (sound + rest))
    used = pairs.same & (certainty >= SETTINGS.smallest_probability)
    used = np.flatnonzero(used & (drifts | ~is_wrong[pairs.control]))
    n = len(pairs.first) - 1
    row = np.repeat(np.arange(n), np.diff(pairs.first))[used]
    column = np.full(n, -1)
    probability = np.zeros(n)
    column[row] = pairs.control[used]
    probability[row] = certainty[used]
    return Decision(column, probability, wrong, passes, marginals)


def _in_drift(is_wrong, passes):
    """Which control points (k,) seem wrong, but are too many for it: the estimate decides on them.

    Where one pass tells it, a short drift of the POS looks alike. A single point tells of no habit.
    """
    lone = is_wrong & (passes == 1)
    number = np.sum(lone)
    total = np.sum(passes > 0)
    wrong = log_share(number, total, SETTINGS.moved_share)
    return lone & (number > 1) & (log_share(number, total, 0.5) > wrong)


def log_share(number: int, total: int, share: float) -> float:
    """Log probability that just some of a number of things are wrong, where few or many may be.

    Parameters
    ----------
    number, total : int
        Of those, and of all things.
    share : float
        Of all things that are expected to be wrong; nothing else is known of it, Beta(1, b).
    """
    others = 1.0 / share - 1.0
    return float(betaln(1.0 + number, others + total - number) - betaln(1.0, others))


def moved_share_by_others(
    pairs: CandidatePairs, marginals: Marginals, count: int, share: np.ndarray
) -> np.ndarray:
    """Probability (p,) that each pair's surveyed point lies elsewhere, by its other observations.

    Parameters
    ----------
    pairs, marginals, count, share
        As of ``decide``.
    """
    probable = pairs.same & (marginals.sound + marginals.moved >= 0.5)
    odds = np.where(probable, _odds(marginals, share), 0.0)
    others = np.bincount(pairs.control, odds, count)[pairs.control] - odds
    certain = 1.0 - SETTINGS.smallest_probability
    by_others = expit(logit(SETTINGS.moved_share) + others)
    return np.clip(by_others, SETTINGS.moved_share * certain, 1.0 - certain)


def _odds(marginals, share):
    """Log likelihood ratios (p,) of a surveyed point's lying elsewhere."""
    sound = marginals.sound
    moved = marginals.moved
    rest = np.clip(1.0 - sound - moved, np.finfo(float).eps, None)
    return np.log(moved / share + rest) - np.log(sound / (1.0 - share) + rest)
