"""The formula written out, with the covariance matrix of all observations (Eq. 13-15).

Its work grows with the cube of the observations: the oracle of the recursion, and the way for
noise that is correlated in any manner.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from mlscorr.collocation.model import (
    NOT_POSITIVE,
    Collocation,
    Noise,
    Signal,
    signal_clocks,
    solve_trend,
)

CHUNK = 10_000_000  # covariances computed at once in a prediction, which bounds the memory


def collocate_dense(
    gps_time: np.ndarray,
    misclosure: np.ndarray,
    noise: Noise | np.ndarray,
    design: np.ndarray,
    signals: Sequence[Signal],
) -> Collocation:
    """Collocation by the dense formula: result as of collocate.

    Parameters
    ----------
    gps_time, misclosure, design, signals
        As in collocate.
    noise : Noise, or (n r, n r) array
        The covariance matrix may be a full one. Units: m^2.

    Raises
    ------
    ValueError
        Where the covariance is not positive definite or the trend is not determined.
    """
    n, r = np.shape(misclosure)
    total = noise.matrix if isinstance(noise, Noise) else noise
    mixings = tuple(signal.mixing.reshape(n * r, -1) for signal in signals)
    covariances = tuple(signal.covariance for signal in signals)
    clocks = np.repeat(signal_clocks(signals, np.asarray(gps_time, dtype=float)), r, axis=0)
    for mixing, covariance, clock in zip(mixings, covariances, clocks.T, strict=True):
        epochs, of = np.unique(clock, return_inverse=True)
        lag = epochs[:, None] - epochs
        total = total + (mixing @ mixing.T) * covariance(lag)[np.ix_(of, of)]
    try:
        factor = cholesky(total, lower=True)
    except LinAlgError as problem:
        raise ValueError(NOT_POSITIVE.format(n * r)) from problem
    solver = DenseSolver(clocks, mixings, covariances, factor)
    return solve_trend(solver, np.reshape(misclosure, -1), design.reshape(n * r, -1))


@dataclass(frozen=True)
class DenseSolver:
    """V = D_omega + B D_Lambda B^T of m rows by its lower triangular factor F, V = F F^T.

    Parameters
    ----------
    clocks : (m, s) array
    mixings : tuple of (m, k) arrays
    covariances : tuple of Covariance
    factor : (m, m) array
    """

    clocks: np.ndarray
    mixings: tuple
    covariances: tuple
    factor: np.ndarray

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """F^-1 c."""
        return solve_triangular(self.factor, columns, lower=True)

    @property
    def log_determinant(self) -> float:
        """Of V."""
        return 2 * np.log(np.diag(self.factor)).sum()

    def solve(self, columns: np.ndarray) -> np.ndarray:
        """V^-1 c."""
        return solve_triangular(self.factor, self.whiten(columns), lower=True, trans="T")

    def precision(self, rows: np.ndarray) -> np.ndarray:
        """A block of V^-1."""
        return self._inverse[np.ix_(rows, rows)]

    @cached_property
    def _inverse(self):
        root = self.whiten(np.eye(len(self.clocks)))
        return root.T @ root

    def predictor(self, columns: np.ndarray, trend: np.ndarray, trend_root: np.ndarray) -> Callable:
        """The predictor of these columns; see Collocation.predict.

        Parameters
        ----------
        columns : (m, p + 1) array
            [A, l - A x].
        trend, trend_root : (p,), (p, p) array
        """
        whitened = self.whiten(columns)

        def predict(clocks, design, mixings):
            lags = clocks.T[:, :, None] - self.clocks.T[:, None]
            terms = zip(lags, mixings, self.mixings, self.covariances, strict=True)
            cross = np.zeros((*design.shape[:2], len(self.clocks)))  # D_Lambda'Lambda B^T
            prior = np.zeros((*design.shape[:2], design.shape[1]))
            for lag, mixing, observed, covariance in terms:
                cross += (mixing @ observed.T) * covariance(lag)[:, None, :]
                prior += mixing @ mixing.swapaxes(1, 2)
            rows = cross.reshape(-1, len(self.clocks))
            half = self.whiten(rows.T).T.reshape(cross.shape)
            mean = design @ trend + half @ whitened[:, -1]  # Eq. 15
            # Covariance of the error: signal, less what was observed of it, plus trend
            left = (design - half @ whitened[:, :-1]) @ trend_root
            return mean, prior - half @ half.swapaxes(1, 2) + left @ left.swapaxes(1, 2)

        def in_chunks(gps_time, clocks, design, mixings):
            step = max(CHUNK // (design.shape[1] * len(self.clocks)), 1)
            starts = range(0, max(len(gps_time), 1), step)
            parts = [
                predict(
                    clocks[i : i + step], design[i : i + step], [m[i : i + step] for m in mixings]
                )
                for i in starts
            ]
            mean, covariance = zip(*parts, strict=True)
            return np.concatenate(mean), np.concatenate(covariance)

        return in_chunks
