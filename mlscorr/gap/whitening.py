"""Whitening by V: residuals and signatures against what the simulator expects of each other.

The collocation's Markov recursion for scalar observations, without keeping its states, so that
thousands of columns pass in a second.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from scipy.linalg import solve_triangular

from mlscorr.collocation import Signal
from mlscorr.collocation.markov import MarkovSolver
from mlscorr.collocation.recursion import filter_covariance
from mlscorr.collocation.states import Layout, carry
from mlscorr.covariance import Covariance
from mlscorr.gap.background import BURST_TIME, Epochs

FIX_TIME = 0.9  # s: noise of GNSS fixes, one a second, has lost 1 / e of its correlation then
CHUNK = 64  # columns filtered at once: their states stay in the first cache


@dataclass(frozen=True)
class Whitener:
    """V of Epochs under one Setting, factored: V = V0 + U U^T as in the collocation."""

    epochs: Epochs
    solver: MarkovSolver

    def whiten(self, columns):
        """Columns (n, k) as White: their products are c^T V^-1 c."""
        filtered = self._filter(columns)
        if not self.epochs.shared.shape[1]:
            return White(filtered, np.zeros((0, columns.shape[1])))
        shared, root = self._shared
        return White(filtered, solve_triangular(root, shared.T @ filtered, lower=True))

    @cached_property
    def log_determinant(self):
        """Of V."""
        total = -2 * np.log(self.solver.whiteners[:, 0, 0]).sum()
        if self.epochs.shared.shape[1]:
            total += 2 * np.log(np.diag(self._shared[1])).sum()
        return float(total)

    def innovations(self, columns):
        """u (n, k), each observation less its prediction by all earlier ones over sigma (n,)."""
        filtered = self._filter(columns)
        sigma = 1.0 / self.solver.whiteners[:, 0, 0]
        if not self.epochs.shared.shape[1]:
            return filtered, sigma
        u, growth = _recursive_squares(self._filter(self.epochs.shared), filtered)
        return u, sigma * growth

    def draw(self, rng, number, like=None):
        """Replicas (n, k) of the residuals under this V.

        like (q,) are innovations whose distribution theirs should have, scaled to unit variance;
        normal by default.
        """
        noise = rng.standard_normal((len(self.epochs), number))
        if like is not None:
            noise = rng.choice(like / np.sqrt(np.mean(like**2)), noise.shape)
        values = np.empty_like(noise)
        _colour(*self._recursion, noise, values)
        shared = self.epochs.shared
        return values + shared @ rng.standard_normal((shared.shape[1], number))

    def single(self, columns):
        """V^-1 c (n, k), and the diagonal (n,) of V^-1."""
        rows = np.arange(len(self.epochs))[:, None]
        return self.solver.solve(columns), np.array([self.solver.precision(i)[0, 0] for i in rows])

    @property
    def _recursion(self):
        solver = self.solver
        gains, white = solver.gains[:, 0], solver.whiteners[:, 0, 0]
        return solver.layout, solver.transitions, solver.mixing[:, 0], gains, white

    def _filter(self, columns):
        out = np.empty(columns.shape)
        for start in range(0, columns.shape[1], CHUNK):
            part = slice(start, start + CHUNK)
            chunk = np.ascontiguousarray(columns[:, part])
            white = np.empty_like(chunk)
            _whiten(*self._recursion, chunk, white)
            out[:, part] = white
        return out

    @cached_property
    def _shared(self):
        """W U, and the root of I + (W U)^T W U, with W the whitener of V0."""
        filtered = self._filter(self.epochs.shared)
        return filtered, np.linalg.cholesky(filtered.T @ filtered + np.eye(filtered.shape[1]))


@dataclass(frozen=True)
class White:
    """Whitened columns: of V0 (n, k), less what the shared errors explain of them (c, k)."""

    own: np.ndarray
    explained: np.ndarray

    def __getitem__(self, columns):
        return White(self.own[:, columns], self.explained[:, columns])

    def product(self, other):
        """a^T V^-1 b of two sets of columns (k, l)."""
        return self.own.T @ other.own - self.explained.T @ other.explained

    @property
    def squares(self):
        """c^T V^-1 c of each column (k,)."""
        return (self.own**2).sum(axis=0) - (self.explained**2).sum(axis=0)

    def blocks(self, index):
        """Products (h, p, p) within blocks of columns, whose numbers are (h, p)."""
        own, explained = (v[:, index].transpose(1, 2, 0) for v in (self.own, self.explained))
        return own @ own.swapaxes(1, 2) - explained @ explained.swapaxes(1, 2)


def whitener(epochs, setting, extra=0.0):
    """Factor V of Epochs under a Setting; extra (n,) is added to the noise's variance (m^2).

    Raises ValueError when V is not positive definite.
    """
    time = setting.time * epochs.correlation_time
    growth = np.hypot(setting.growth(epochs.gps_time), epochs.growth)
    burst = growth * (epochs.drift + epochs.jitter)
    signals = [
        Signal(factor * mixing[:, None], covariance)
        for factor, mixing, covariance in (
            (setting.scale, epochs.drift, Covariance(setting.family, time)),
            (setting.scale, epochs.attitude, Covariance(setting.family, time)),
            (setting.scale, epochs.jitter, Covariance("exponential", setting.jitter_time)),
            (setting.fixes, epochs.place, Covariance("exponential", FIX_TIME)),
            (1.0, burst, Covariance("matern32", BURST_TIME)),
        )
        if factor > 0 and mixing.any()
    ]
    n = len(epochs)
    own = (setting.noise**2 * epochs.own + extra)[:, None, None]
    mixing = np.concatenate([np.zeros((n, 1, 0)), *(s.mixing for s in signals)], axis=2)
    layout, step = Layout.of(signals), np.diff(epochs.gps_time, prepend=epochs.gps_time[:1])
    filtered = filter_covariance(layout, layout.size, step, mixing, own)
    if np.isnan(filtered[2]).any():
        raise ValueError(
            f"The covariance of the {n} residuals is not positive definite: a sigma of zero. Give "
            "each target the sigma that it has."
        )
    order = np.arange(n)
    solver = MarkovSolver(order, epochs.gps_time, layout, mixing, *filtered, epochs.shared)
    return Whitener(epochs, solver)


@njit(cache=True, nogil=True)
def _whiten(layout, transitions, mixing, gains, white, columns, out):
    """The collocation's filter for scalar observations, without keeping its states."""
    n, c = columns.shape
    x = np.zeros((gains.shape[1], c))
    for i in range(n):
        if i > 0:
            carry(layout, transitions[i], x, False)
        for b in range(c):
            out[i, b] = columns[i, b]
        for j in range(layout.first.size):
            for b in range(c):
                out[i, b] -= mixing[i, j] * x[layout.first[j], b]
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += gains[i, a] * out[i, b]
        for b in range(c):
            out[i, b] *= white[i]


@njit(cache=True, nogil=True)
def _colour(layout, transitions, mixing, gains, white, columns, out):
    """The inverse of _whiten."""
    n, c = columns.shape
    x = np.zeros((gains.shape[1], c))
    for i in range(n):
        if i > 0:
            carry(layout, transitions[i], x, False)
        for b in range(c):
            out[i, b] = columns[i, b] / white[i]
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += gains[i, a] * columns[i, b] / white[i]
        for j in range(layout.first.size):
            for b in range(c):  # x is the updated state: what the gain added is not predicted
                gain = gains[i, layout.first[j]] * columns[i, b] / white[i]
                out[i, b] += mixing[i, j] * (x[layout.first[j], b] - gain)


@njit(cache=True, nogil=True)
def _recursive_squares(shared, columns):
    """Innovations u and growth of sigma when unit errors in common enter by `shared` (n, c).

    Recursive least squares: the errors are estimated from all earlier observations.
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
