"""Decision on the pairs to use."""

from dataclasses import dataclass

import numpy as np
from scipy.special import betaln, expit, logit

from mlscorr.matching._marginals import Marginals
from mlscorr.matching._pairs import CandidatePairs
from mlscorr.matching.settings import SETTINGS


@dataclass(frozen=True)
class Decision:
    """Matches and their basis, for n observations in order of time and k control points.

    Parameters
    ----------
    column : (n,) int array
        Control point of each observation, -1 for none.
    probability : (n,) array
        Probability of that match.
    wrong : (k,) array
        Probability, from all passes, that a surveyed point is not at its target.
    passes : (k,) int array
        Number of observations behind it.
    marginals : Marginals
    """

    column: np.ndarray
    probability: np.ndarray
    wrong: np.ndarray
    passes: np.ndarray
    marginals: Marginals

    def moved(self, pairs: CandidatePairs) -> np.ndarray:
        """Surveyed point (n,) that each unnamed observation shows to be displaced, -1 for none.

        A point counts if it is too probably wrong to be used: every refusal for this reason is
        listed.

        Parameters
        ----------
        pairs : CandidatePairs
            Pairs that were decided on.
        """
        column = np.full(len(self.column), -1)
        probable = pairs.same & (self.marginals.sound + self.marginals.moved >= 0.5)
        probable &= self.wrong[pairs.control] > 1.0 - SETTINGS.smallest_sound
        row = np.repeat(np.arange(len(column)), np.diff(pairs.first))
        column[row[probable]] = pairs.control[probable]
        return np.where(self.column < 0, column, -1)


def decide(pairs: CandidatePairs, marginals: Marginals, count: int, share: np.ndarray) -> Decision:
    """Decide on all pairs; all observations of a surveyed point decide jointly on its position.

    Parameters
    ----------
    pairs : CandidatePairs
    marginals : Marginals
    count : int
        Number of control points.
    share : (p,) array
        Probabilities of displaced surveyed points that the marginals already include.
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
    """Flag (k,) of control points that seem wrong but are too many; the estimate decides on them.

    With a single pass, a short drift of the POS is not separable from wrong points. One single
    point does not show a pattern.
    """
    lone = is_wrong & (passes == 1)
    number = np.sum(lone)
    total = np.sum(passes > 0)
    wrong = log_share(number, total, SETTINGS.moved_share)
    return lone & (number > 1) & (log_share(number, total, 0.5) > wrong)


def log_share(number: int, total: int, share: float) -> float:
    """Log probability that exactly some of a number of items are wrong, with an uncertain share.

    Parameters
    ----------
    number, total : int
        Numbers of wrong items, and of all items.
    share : float
        Expected share of wrong items, with a prior Beta(1, b).
    """
    others = 1.0 / share - 1.0
    return float(betaln(1.0 + number, others + total - number) - betaln(1.0, others))


def moved_share_by_others(
    pairs: CandidatePairs, marginals: Marginals, count: int, share: np.ndarray
) -> np.ndarray:
    """Probability (p,) that each pair's surveyed point is displaced, from its other observations.

    Parameters
    ----------
    pairs, marginals, count, share
        See ``decide``.
    """
    probable = pairs.same & (marginals.sound + marginals.moved >= 0.5)
    odds = np.where(probable, _odds(marginals, share), 0.0)
    others = np.bincount(pairs.control, odds, count)[pairs.control] - odds
    certain = 1.0 - SETTINGS.smallest_probability
    by_others = expit(logit(SETTINGS.moved_share) + others)
    return np.clip(by_others, SETTINGS.moved_share * certain, 1.0 - certain)


def _odds(marginals, share):
    """Log likelihood ratios (p,) of displaced surveyed points."""
    sound = marginals.sound
    moved = marginals.moved
    rest = np.clip(1.0 - sound - moved, np.finfo(float).eps, None)
    return np.log(moved / share + rest) - np.log(sound / (1.0 - share) + rest)
