"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15).

- model: signals, noise, the least squares of the trend, and the result
- markov: linear in observations and epochs, by recursion and interpolation between them
- dense: the same by the formula written out, with work that grows as the observations cubed
- literal: the paper's own predictor, whose covariances don't fit each other
"""

from mlscorr.collocation.dense import collocate_dense
from mlscorr.collocation.literal import LiteralCollocation, LiteralSignal, collocate_literal
from mlscorr.collocation.markov import collocate
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
