"""The formula written out, with the covariance matrix of all observations (Eq. 13-15).

Its work grows with the cube of the observations: the oracle of the recursion, and the way for
noise that is correlated in any manner.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from mlscorr.collocation.model import NOT_POSITIVE, Noise, solve_trend

CHUNK = 10_000_000  # covariances computed at once in a prediction, which bounds the memory


def collocate_dense(gps_time, misclosure, noise, design, signals):
    """Collocation by the dense formula: arguments and result as in collocate.

    Parameters
    ----------
    noise : Noise, or (n r, n r) array
        The covariance matrix may be a full one. Units: m^2.
    """
    n, r = np.shape(misclosure)
    rows = np.repeat(np.asarray(gps_time, dtype=float), r)
    total = noise.matrix if isinstance(noise, Noise) else noise
    mixings = tuple(signal.mixing.reshape(n * r, -1) for signal in signals)
    covariances = tuple(signal.covariance for signal in signals)
    epochs, of = np.unique(rows, return_inverse=True)
    lag = epochs[:, None] - epochs
    for mixing, covariance in zip(mixings, covariances, strict=True):
        total = total + (mixing @ mixing.T) * covariance(lag)[np.ix_(of, of)]
    try:
        factor = cholesky(total, lower=True)
    except LinAlgError as problem:
        raise ValueError(NOT_POSITIVE.format(n * r)) from problem
    solver = DenseSolver(rows, mixings, covariances, factor)
    return solve_trend(solver, np.reshape(misclosure, -1), design.reshape(n * r, -1))


@dataclass(frozen=True)
class DenseSolver:
    """V = D_omega + B D_Lambda B^T of m rows by its lower triangular factor F, V = F F^T."""

    gps_time: np.ndarray  # (m,)
    mixings: tuple  # of (m, k)
    covariances: tuple
    factor: np.ndarray  # (m, m)

    def whiten(self, columns):
        """F^-1 c."""
        return solve_triangular(self.factor, columns, lower=True)

    @property
    def log_determinant(self):
        return 2 * np.log(np.diag(self.factor)).sum()

    def solve(self, columns):
        """V^-1 c."""
        return solve_triangular(self.factor, self.whiten(columns), lower=True, trans="T")

    def precision(self, rows):
        """A block of V^-1."""
        return self._inverse[np.ix_(rows, rows)]

    @cached_property
    def _inverse(self):
        root = self.whiten(np.eye(len(self.gps_time)))
        return root.T @ root

    def predictor(self, columns, trend, trend_root):
        """Prediction from the columns [A, l - A x]; see Collocation.predict."""
        whitened = self.whiten(columns)

        def predict(gps_time, design, mixings):
            lag = gps_time[:, None] - self.gps_time
            terms = zip(mixings, self.mixings, self.covariances, strict=True)
            cross = np.zeros((*design.shape[:2], len(self.gps_time)))  # D_Lambda'Lambda B^T
            prior = np.zeros((*design.shape[:2], design.shape[1]))
            for mixing, observed, covariance in terms:
                cross += (mixing @ observed.T) * covariance(lag)[:, None, :]
                prior += mixing @ mixing.swapaxes(1, 2)
            rows = cross.reshape(-1, len(self.gps_time))
            half = self.whiten(rows.T).T.reshape(cross.shape)
            mean = design @ trend + half @ whitened[:, -1]  # Eq. 15
            # Covariance of the error: signal, less what was observed of it, plus trend
            left = (design - half @ whitened[:, :-1]) @ trend_root
            return mean, prior - half @ half.swapaxes(1, 2) + left @ left.swapaxes(1, 2)

        def in_chunks(gps_time, design, mixings):
            step = max(CHUNK // (design.shape[1] * len(self.gps_time)), 1)
            starts = range(0, max(len(gps_time), 1), step)
            parts = [
                predict(
                    gps_time[i : i + step], design[i : i + step], [m[i : i + step] for m in mixings]
                )
                for i in starts
            ]
            mean, covariance = zip(*parts, strict=True)
            return np.concatenate(mean), np.concatenate(covariance)

        return in_chunks
