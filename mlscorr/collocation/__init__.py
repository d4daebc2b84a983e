"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15).

- model: signals, noise, the least squares of the trend, and the result
- markov: linear in observations and epochs, by recursion and interpolation between them
- dense: the same by the formula written out, with work that grows as the observations cubed
- literal: the paper's own predictor, whose covariances don't fit each other
"""

import numpy as np

from mlscorr.collocation.dense import collocate_dense
from mlscorr.collocation.literal import LiteralCollocation, LiteralSignal, collocate_literal
from mlscorr.collocation.markov import collocate_markov
from mlscorr.collocation.model import Collocation, Noise, Signal

__all__ = [
    "Collocation",
    "LiteralCollocation",
    "LiteralSignal",
    "Noise",
    "Signal",
    "collocate",
    "collocate_dense",
    "collocate_literal",
]


def collocate(gps_time, misclosure, noise, design, signals):
    """Separate misclosures into trend, signal and noise.

    collocate_markov for misclosures (n, r) with a Noise; collocate_dense for single rows (m,)
    with a noise matrix (m, m), design (m, p) and mixings (m, k).
    """
    if np.ndim(misclosure) == 2:
        return collocate_markov(gps_time, misclosure, noise, design, signals)
    rows = [Signal(signal.mixing[:, None], signal.covariance) for signal in signals]
    return collocate_dense(gps_time, misclosure[:, None], noise, design[:, None], rows)
