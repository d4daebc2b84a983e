"""Values of which a share is odd: a crown of leaves or a kerb among patches of road and wall.

Each value is normal, or with an unknown chance it is anything at all (Box and Tiao 1968, A
Bayesian approach to some outlier problems). What holds for all, an offset, is integrated over.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

ROUNDS = 3  # of expectation and maximisation: the shares of so few odd ones hardly move
FIRST_SHARE, LEAST_SHARE, MOST_SHARE = 0.02, 0.002, 0.3  # that is odd; more is no exception


@dataclass(frozen=True)
class Fitted:
    """What fits columns of values best; (k,) each.

    Parameters
    ----------
    best : (k,) array
        Log likelihood.
    offset : (k,) array
    weight : (k,) array
        1 / variance of the offset.
    share : (k,) array
        That is odd.
    """

    best: np.ndarray
    offset: np.ndarray
    weight: np.ndarray
    share: np.ndarray

    def log_likelihood(self, common):
        """With the offset integrated over N(0, common^2), by Laplace's approximation: (k,)."""
        spread = common**2 + 1 / self.weight
        return self.best - 0.5 * (self.offset**2 / spread + np.log(spread * self.weight))


def contaminated(values, mean, variance, density):
    """Fit of columns of independent values that share an offset: Fitted.

    Parameters
    ----------
    values : (q, k) array
    mean, variance : (q,) array
        Of what is not odd.
    density : float
        Of odd values: they lie anywhere in an interval of 1 / density.
    """
    return Fitted(*_fit(np.ascontiguousarray(values.T - mean), variance, density).T)


@njit(cache=True, nogil=True)
def _fit(columns, variance, density):
    """Rows of log likelihood, offset, weight, share."""
    k, q = columns.shape
    told = np.empty((k, 4))
    scale, weight = 1 / np.sqrt(2 * np.pi * variance), 1 / variance
    for j in range(k):
        offset, share, held = 0.0, FIRST_SHARE, 0.0
        for _ in range(ROUNDS):
            held, pulled, odd = 0.0, 0.0, 0.0
            for i in range(q):
                away = columns[j, i] - offset
                regular = (1 - share) * scale[i] * np.exp(-0.5 * away * away * weight[i])
                part = regular / (regular + share * density)
                odd += 1 - part
                held += part * weight[i]
                pulled += part * weight[i] * columns[j, i]
            held = max(held, weight[0] * LEAST_SHARE)  # not all can be odd
            offset, share = pulled / held, min(max(odd / q, LEAST_SHARE), MOST_SHARE)
        total = 0.0
        for i in range(q):
            away = columns[j, i] - offset
            regular = (1 - share) * scale[i] * np.exp(-0.5 * away * away * weight[i])
            total += np.log(regular + share * density)
        told[j, 0], told[j, 1], told[j, 2], told[j, 3] = total, offset, held, share
    return told
