"""Heavy tails: single outliers are allowed, so that no effect is found to explain them."""

from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.gap.evidence.observations import ErrorModel, Observations
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows
from mlscorr.pos import SETTINGS as POS


def without_tails(
    observations: Observations, rows: Rows, nuisance: np.ndarray
) -> tuple[Observations, np.ndarray]:
    """Give odd observations the variance that they show.

    A surveyed target that is odd as a whole is left to target_outlier.

    Parameters
    ----------
    observations : Observations
    rows : Rows
    nuisance : (n, q) array
        Possible effects, whose changes of a row are not odd.

    Returns
    -------
    observations : Observations
    tail : (o,) int array
        Odd rows.
    """
    residual = observations.columns(rows.residual[:, None])
    process = (SETTINGS.scale_limit, *POS.process_shapes[1][:2])
    flexible = ErrorModel(*process, process)
    whitener = observations.with_shared(nuisance).whitener(flexible)
    weights, precision = whitener.solve(residual)
    score = weights[:, 0] / np.sqrt(precision)
    score /= max(1.0, 1.4826 * np.median(np.abs(score)))  # all of them are wrong, not single ones
    is_odd = (np.abs(score) > SETTINGS.tail) & ~_odd_target(observations, rows, score)
    limit = SETTINGS.tail_rows * len(is_odd)
    if is_odd.sum() > limit:
        is_odd &= np.abs(score) >= np.sort(np.abs(score[is_odd]))[-max(1, int(limit))]
    excess = np.where(is_odd, ((score / SETTINGS.tail_left) ** 2 - 1) / precision, 0.0)
    odd_rows = np.unique(observations.row[is_odd])
    return observations.with_own(observations.errors.own + excess), odd_rows


def _odd_target(observations, rows, score):
    """Flag (n,) of observations of the oddest target, if all passes agree that it is odd."""
    target = rows.survey_item[observations.row]
    is_odd = (target >= 0) & (np.abs(score) > SETTINGS.tail)
    if not is_odd.any():
        return is_odd
    of_target = target == target[is_odd][np.argmax(np.abs(score[is_odd]))]
    axis = np.argmax(np.abs(rows.direction[observations.row]), axis=1)
    items = np.unique(rows.item[observations.row[of_target]])
    for number in np.unique(axis[of_target & is_odd]):
        along = of_target & (axis == number)
        agree = np.abs(score[along]) > SETTINGS.tail
        if agree.sum() == len(items) and len(np.unique(np.sign(score[along]))) == 1:
            return of_target
    return np.zeros_like(of_target)


@dataclass(frozen=True)
class MixtureFit:
    """Best fit to columns of values, some of which are odd; (k,) each.

    Parameters
    ----------
    best : (k,) array
        Log likelihood.
    offset : (k,) array
    weight : (k,) array
        1 / variance of the offset.
    share : (k,) array
        Odd share.
    """

    best: np.ndarray
    offset: np.ndarray
    weight: np.ndarray
    share: np.ndarray

    def log_likelihood(self, sigma: float) -> np.ndarray:
        """Log likelihood with the offset integrated over N(0, sigma^2), by Laplace's
        approximation: (k,).
        """
        spread = sigma**2 + 1 / self.weight
        return self.best - 0.5 * (self.offset**2 / spread + np.log(spread * self.weight))


def fit_mixture(
    values: np.ndarray, mean: np.ndarray, variance: np.ndarray, density: float
) -> MixtureFit:
    """Fit columns of values with a share of odd ones and a common offset.

    Each value is normal or, with an unknown probability, arbitrary, such as a crown of leaves or a
    curb among patches of road and wall (Box and Tiao 1968, A Bayesian approach to some outlier
    problems).

    Parameters
    ----------
    values : (q, k) array
    mean, variance : (q,) array
        Of what is not odd.
    density : float
        Density of odd values, which are anywhere in an interval of 1 / density.
    """
    columns = np.ascontiguousarray(values.T - mean)
    return MixtureFit(*_fit(columns, variance, density, *SETTINGS.odd_shares).T)


@loop
def _fit(columns, variance, density, smallest, first, largest):
    """Rows of log likelihood, offset, weight, share, by expectation maximization."""
    k, q = columns.shape
    fitted = np.empty((k, 4))
    scale = 1 / np.sqrt(2 * np.pi * variance)
    weight = 1 / variance
    for j in range(k):
        offset = 0.0
        share = first
        total_weight = 0.0
        for _ in range(3):  # the shares of so few odd values hardly change
            total_weight = 0.0
            pulled = 0.0
            total_odd = 0.0
            for i in range(q):
                away = columns[j, i] - offset
                regular = (1 - share) * scale[i] * np.exp(-0.5 * away * away * weight[i])
                part = regular / (regular + share * density)
                total_odd += 1 - part
                total_weight += part * weight[i]
                pulled += part * weight[i] * columns[j, i]
            total_weight = max(total_weight, weight[0] * smallest)  # not all can be odd
            offset = pulled / total_weight
            share = min(max(total_odd / q, smallest), largest)
        total = 0.0
        for i in range(q):
            away = columns[j, i] - offset
            regular = (1 - share) * scale[i] * np.exp(-0.5 * away * away * weight[i])
            total += np.log(regular + share * density)
        fitted[j] = total, offset, total_weight, share
    return fitted
