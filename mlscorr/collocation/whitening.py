"""Whitening: V of scalar observations factored once, for thousands of columns per second.

V = V0 + U U^T with V0 of Markov signals and separate noise and U the shared errors. The recursion
is that of ``collocate``, but states and their covariances are not kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from mlscorr.collocation._recursion import Recursion, filter_covariance
from mlscorr.collocation._states import Layout, carry
from mlscorr.collocation.model import NOT_POSITIVE, Signal, signal_clocks
from mlscorr.compiled_loops import loop

CHUNK = 64  # columns filtered at once: their states stay in the first-level cache


@dataclass(frozen=True)
class Whitener:
    """Factor of V of n scalar observations in order of time, made by ``factor``.

    Parameters
    ----------
    recursion : Recursion
        Recursion of V0, without the axis of observations: gains (n, d), whiteners (n,).
    common : (n, c) array
        U: shared errors of unit variance.
    """

    recursion: Recursion
    common: np.ndarray

    def with_common(self, common: np.ndarray) -> Whitener:
        """Return the same V0 with other shared errors; only these are factored again.

        Parameters
        ----------
        common : (n, c) array
        """
        return replace(self, common=common)

    def whiten(self, columns: np.ndarray) -> Whitened:
        """Whiten columns c; products of the result are c^T V^-1 c.

        Parameters
        ----------
        columns : (n, k) array
        """
        separate = self._filter(columns)
        if not self.common.shape[1]:
            return Whitened(separate, np.zeros((0, columns.shape[1])))
        common, root = self._common
        return Whitened(separate, solve_triangular(root, common.T @ separate, lower=True))

    @cached_property
    def log_determinant(self) -> float:
        """Log determinant of V."""
        total = -2 * np.log(self.recursion.whiteners).sum()
        if self.common.shape[1]:
            total += 2 * np.log(np.diag(self._common[1])).sum()
        return float(total)

    def log_likelihood(self, columns: np.ndarray | Whitened) -> np.ndarray:
        """Log-likelihood (k,) of columns with covariance V, without the constant of 2 pi.

        Parameters
        ----------
        columns : (n, k) array or Whitened
        """
        if isinstance(columns, Whitened):
            white = columns
        else:
            white = self.whiten(columns)
        return -0.5 * (white.squares + self.log_determinant)

    def innovations(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Prediction error of each observation from all earlier ones, over its sigma.

        Parameters
        ----------
        columns : (n, k) array

        Returns
        -------
        innovations : (n, k) array
            Of unit variance.
        sigma : (n,) array
        """
        filtered = self._filter(columns)
        sigma = 1.0 / self.recursion.whiteners
        if not self.common.shape[1]:
            return filtered, sigma
        innovations, growth = common_innovations(self._filter(self.common), filtered)
        return innovations, sigma * growth

    def solve(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute V^-1 c, and the diagonal of V^-1.

        Parameters
        ----------
        columns : (n, k) array

        Returns
        -------
        weights : (n, k) array
        precision : (n,) array
        """
        n = len(self.common)
        white = self.whiten(columns)
        weights = np.empty(columns.shape)
        precision = np.empty(n)
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            unit = self.whiten(np.eye(n, len(range(n)[part]), -start))
            weights[part] = unit.product(white)
            precision[part] = unit.squares
        return weights, precision

    def draw(
        self, rng: np.random.Generator, number: int, tails: np.ndarray | None = None
    ) -> np.ndarray:
        """Draw random columns of covariance V.

        Parameters
        ----------
        rng : numpy.random.Generator
        number : int
        tails : (q,) array, optional
            Innovations whose distribution is used, scaled to unit variance; normal by default.

        Returns
        -------
        columns : (n, number) array
        """
        noise = rng.standard_normal((len(self.common), number))
        if tails is not None:
            noise = rng.choice(tails / np.sqrt(np.mean(tails**2)), noise.shape)
        values = np.empty_like(noise)
        whiten_columns(self.recursion, noise, values, True)
        return values + self.common @ rng.standard_normal((self.common.shape[1], number))

    def _filter(self, columns):
        out = np.empty(columns.shape)
        for start in range(0, columns.shape[1], CHUNK):
            part = slice(start, start + CHUNK)
            chunk = np.ascontiguousarray(columns[:, part], dtype=float)
            white = np.empty_like(chunk)
            whiten_columns(self.recursion, chunk, white)
            out[:, part] = white
        return out

    @cached_property
    def _common(self):
        """W U, and the root of I + (W U)^T W U, with W the whitener of V0."""
        filtered = self._filter(self.common)
        return filtered, np.linalg.cholesky(filtered.T @ filtered + np.eye(filtered.shape[1]))


@dataclass(frozen=True)
class Whitened:
    """Whitened columns c: whitened by V0, minus the part explained by shared errors.

    Parameters
    ----------
    separate : (n, k) array
    shared : (c, k) array
    """

    separate: np.ndarray
    shared: np.ndarray

    def __getitem__(self, columns: slice | np.ndarray) -> Whitened:
        return Whitened(self.separate[:, columns], self.shared[:, columns])

    def product(self, other: Whitened) -> np.ndarray:
        """Product a^T V^-1 b of two sets of columns: (k, l)."""
        return self.separate.T @ other.separate - self.shared.T @ other.shared

    @property
    def squares(self) -> np.ndarray:
        """c^T V^-1 c of each column: (k,)."""
        return (self.separate**2).sum(axis=0) - (self.shared**2).sum(axis=0)

    def blocks(self, index: np.ndarray) -> np.ndarray:
        """Products within blocks of columns: (h, p, p).

        Parameters
        ----------
        index : (h, p) int array
            Indices of the columns of each block.
        """
        separate, shared = (v[:, index].transpose(1, 2, 0) for v in (self.separate, self.shared))
        return separate @ separate.swapaxes(1, 2) - shared @ shared.swapaxes(1, 2)


def factor(
    gps_time: np.ndarray,
    signals: Sequence[Signal],
    variance: np.ndarray,
    common: np.ndarray | None = None,
) -> Whitener:
    """Factor V of scalar observations (Mao et al. 2015, Eq. 14: B D B^T + N).

    Parameters
    ----------
    gps_time : (n,) array
        Sorted. Units: s.
    signals : sequence of Signal
        With mixings (n, 1, k).
    variance : (n,) array
        Variance of each observation's independent noise.
    common : (n, c) array, optional
        Shared errors of unit variance.

    Returns
    -------
    whitener : Whitener

    Raises
    ------
    ValueError
        If times are not sorted, or V is not positive definite.

    >>> from mlscorr.collocation.covariance import Covariance
    >>> time = np.array([0.0, 1.0, 2.0])
    >>> drift = Signal(np.ones((3, 1, 1)), Covariance("exponential", 10.0))
    >>> factor(time, [drift], np.full(3, 0.01)).whiten(np.ones((3, 1))).squares.round(3)
    array([1.095])
    """
    n = len(gps_time)
    step = np.diff(gps_time, prepend=gps_time[:1])
    if (step < 0).any():
        raise ValueError(
            f"{(step < 0).sum()} of {n} observations are earlier than the one before. Sort them "
            "by time."
        )
    layout = Layout.of(signals)
    mixing = np.concatenate([np.zeros((n, 1, 0)), *(s.mixing for s in signals)], axis=2)
    clocks = signal_clocks(signals, np.asarray(gps_time, dtype=float))
    steps = np.diff(clocks, prepend=clocks[:1], axis=0)
    transitions, gains, whiteners, _ = filter_covariance(
        layout, layout.size, steps, mixing, np.asarray(variance, dtype=float)[:, None, None]
    )
    if np.isnan(whiteners).any():
        raise ValueError(NOT_POSITIVE.format(n))
    recursion = Recursion(layout, transitions, mixing[:, 0], gains[:, 0], whiteners[:, 0, 0])
    if common is None:
        common = np.zeros((n, 0))
    return Whitener(recursion, common)


@loop
def whiten_columns(
    recursion: Recursion, columns: np.ndarray, out: np.ndarray, inverse: bool = False
) -> None:
    """Whiten columns by the filter of scalar observations, without keeping its states.

    Parameters
    ----------
    recursion : Recursion
        Without the axis of observations: mixing (n, k), gains (n, d), whiteners (n,).
    columns, out : (n, c) array
    inverse : bool
        True to give white columns the covariance V0 instead.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, c = columns.shape
    x = np.zeros((gains.shape[1], c))
    innovation = np.empty(c)
    for i in range(n):
        if i > 0:
            carry(layout, transitions[i], x, False)
        out[i] = 0.0
        for j in range(layout.first.size):
            for b in range(c):
                out[i, b] += mixing[i, j] * x[layout.first[j], b]
        for b in range(c):
            innovation[b] = columns[i, b] / whiteners[i] if inverse else columns[i, b] - out[i, b]
            out[i, b] = out[i, b] + innovation[b] if inverse else innovation[b] * whiteners[i]
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += gains[i, a] * innovation[b]


@loop
def common_innovations(shared: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Innovations of observations with shared unit errors.

    The shared errors are estimated from all earlier observations by recursive least squares.

    Parameters
    ----------
    shared : (n, c) array
        Coefficients of the errors in white observations.
    columns : (n, k) array
        White except for these errors.

    Returns
    -------
    innovations : (n, k) array
    growth : (n,) array
        Growth of their sigma due to the uncertainty of the errors.
    """
    n, k = columns.shape
    c = shared.shape[1]
    p = np.eye(c)
    x = np.zeros((c, k))
    u = np.empty((n, k))
    growth = np.empty(n)
    for i in range(n):
        known = np.flatnonzero(shared[i])
        gain = np.zeros(c)
        for a in known:
            for b in range(c):
                gain[b] += shared[i, a] * p[a, b]
        s = 1.0
        for a in known:
            s += shared[i, a] * gain[a]
        growth[i] = np.sqrt(s)
        touched = np.flatnonzero(gain)
        for b in range(k):
            v = columns[i, b]
            for a in known:
                v -= shared[i, a] * x[a, b]
            u[i, b] = v / growth[i]
            for a in touched:
                x[a, b] += gain[a] * v / s
        for a in touched:
            for b in touched:
                p[a, b] -= gain[a] * gain[b] / s
    return u, growth
