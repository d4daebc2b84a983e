"""V of Markov signals by the recursion: linear in observations and epochs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from mlscorr.collocation._recursion import (
    Recursion,
    filter_columns,
    filter_covariance,
    smooth_columns,
    smooth_covariance,
)
from mlscorr.collocation._states import Layout
from mlscorr.collocation.interpolation import interpolate, predictor_by
from mlscorr.collocation.model import (
    NOT_POSITIVE,
    Collocation,
    Noise,
    Signal,
    signal_clocks,
    solve_trend,
)


def collocate(
    gps_time: np.ndarray,
    misclosure: np.ndarray,
    noise: Noise,
    design: np.ndarray,
    signals: Sequence[Signal],
    prior_rows: np.ndarray | None = None,
    second_views: np.ndarray | None = None,
) -> Collocation:
    r"""Separate misclosures into trend, signal and noise.

    Solves l = A x + B s + n with one covariance function throughout (Mao et al. 2015,
    Eq. 13-15; the paper's diagonal D_Lambda is no valid joint covariance with Eq. 20).

    Work and memory grow with epochs times the square of the states (the processes' 1, 2 or 3 each).
    Errors shared by the passes of a target cost r columns for each target with several passes,
    filtered with the misclosures, and a dense factor of all these columns. This suits dozens of
    such targets: 8 n c (r + 3 d) bytes with c columns and d states. For rows of two epochs use
    ``collocate_rows``.

    Parameters
    ----------
    gps_time : (n,) array
        Time of each epoch, in any order, with repetitions. Units: s.
    misclosure : (n, r) array
        Surveyed - observed. Units: m.
    noise : Noise
        Noise of survey and extraction (Eq. 19).
    design : (n, r, p) array
        A. May have zero columns.
    signals : sequence of Signal
    prior_rows : (k, p + 1) array, optional
        Prior of the trend; see Collocation.
    second_views : (h, r) array, optional
        Sigmas of the places that the last h epochs share with others; see ``collocate_rows``.

    Raises
    ------
    ValueError
        If a number is not finite, the trend is not determined (rank of A) or the covariance of the
        observations is not positive definite.

    Examples
    --------
    >>> from mlscorr.collocation import Noise, Signal, collocate
    >>> from mlscorr.collocation.covariance import Covariance
    >>> time, unit = np.array([0.0, 10.0, 20.0]) + 413200.0, np.ones((3, 1, 1))
    >>> signal = Signal(0.1 * unit, Covariance("matern32", 30.0))
    >>> noise = Noise(1e-6 * unit)
    >>> solved = collocate(time, np.full((3, 1), 0.5), noise, unit, [signal])
    >>> solved.trend.round(6)
    array([0.5])
    >>> mean, covariance = solved.predict(time[:1] + 5.0, unit[:1], [0.1 * unit[:1]])
    >>> mean.round(6)
    array([[0.5]])
    """
    n, r = np.shape(misclosure)
    gps_time = np.asarray(gps_time, dtype=float)
    mixing = np.concatenate([np.zeros((n, r, 0)), *(s.mixing for s in signals)], axis=2)
    shared = noise.common.reshape(n, r, noise.common.shape[1])
    check_finite(gps_time, misclosure, noise.separate, shared, design, mixing)
    order = np.argsort(gps_time, kind="stable")
    layout = Layout.of(signals)
    clocks = signal_clocks(signals, gps_time)[order]
    gps_time = gps_time[order]
    mixing = mixing[order]
    own = np.ascontiguousarray(noise.separate[order], dtype=float)
    filtered = filter_covariance(layout, layout.size, _steps(clocks), mixing, own)
    if np.isnan(filtered[2]).any():
        raise np.linalg.LinAlgError(NOT_POSITIVE.format(n * r))
    if second_views is None:
        second_views = np.zeros((0, r))
    solver = MarkovSolver(
        order, gps_time, clocks, layout, mixing, *filtered, noise.common, second_views
    )
    observed = n * r - second_views.size
    design = design.reshape(n * r, design.shape[2])[:observed]
    return solve_trend(solver, np.reshape(misclosure, -1)[:observed], design, prior_rows)


def check_finite(gps_time: np.ndarray, *arrays: np.ndarray) -> None:
    """Refuse epochs with non-finite numbers, which a solver would spread to all others.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    arrays : (n, ...) arrays

    Raises
    ------
    ValueError
        If a number is not finite.
    """
    wrong = np.zeros(len(gps_time), dtype=bool)
    for values in (gps_time, *arrays):
        wrong |= ~np.isfinite(values).all(axis=tuple(range(1, np.ndim(values))))
    if wrong.any():
        raise ValueError(
            f"{wrong.sum()} of {len(gps_time)} observation epochs have a time, misclosure, "
            "noise, design or sigma that is not a finite number (first: "
            f"{gps_time[wrong][0]:.3f} s). Remove them."
        )


def _steps(clocks):
    """Times (n, s) since the previous epoch, zero for the first."""
    return np.diff(clocks, prepend=clocks[:1], axis=0)


@dataclass(frozen=True)
class MarkovSolver:
    """Solver of V = V0 + U U^T: V0 of signals and separate noise by recursion, U shared errors.

    With C = [W U; I] = Q T, W the whitener of V0, the whitener of V is [W; 0] minus its part in the
    columns of Q, and V^-1 = V0^-1 - Y Y^T with Y = V0^-1 U T^-1 (Woodbury).

    Parameters
    ----------
    order : (n,) int array
        Order of time; all arrays below except shared use it.
    gps_time, clocks : (n,), (n, s) array
    layout : Layout
    mixing : (n, r, k) array
    transitions, gains, whiteners, covariances
        See filter_covariance.
    shared : (n r, c) array
        U, in the caller's order.
    second_views : (h, r) array
        Of the last h epochs in the caller's order; see ``collocate_rows``. Their rows are not
        observations, and are hidden from callers.
    """

    order: np.ndarray
    gps_time: np.ndarray
    clocks: np.ndarray
    layout: Layout
    mixing: np.ndarray
    transitions: np.ndarray
    gains: np.ndarray
    whiteners: np.ndarray
    covariances: np.ndarray
    shared: np.ndarray
    second_views: np.ndarray

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Whiten columns so that W^T W = c^T V^-1 c, in the order of time."""
        columns = self._padded(columns)
        whitened = self._filter(columns)[0].reshape(columns.shape)
        if not self.shared.size:
            return whitened
        padded = np.vstack([whitened, np.zeros((self.shared.shape[1], columns.shape[1]))])
        basis = self._woodbury[0]
        return padded - basis @ (basis.T @ padded)

    @property
    def log_determinant(self) -> float:
        """Log determinant of V."""
        total = -2 * np.log(np.einsum("nii->ni", self.whiteners)).sum()
        if self.shared.size:
            total += 2 * np.log(np.abs(np.diag(self._woodbury[1]))).sum()
        return total - 2 * np.log(self.second_views).sum()  # remove the places

    def solve(self, columns: np.ndarray) -> np.ndarray:
        """V^-1 c."""
        solved = self._smooth(self._without_shared(self._padded(columns)))[0]
        return solved[: len(columns)]

    def precision(self, rows: np.ndarray) -> np.ndarray:
        """Return a block of V^-1."""
        r = self.mixing.shape[1]
        rows = np.asarray(rows)
        position = self._position[rows // r]
        if (position == position[0]).all():
            within = rows % r
            block = self._smoothed[0][position[0]][within[:, None], within]
            if not self.shared.size:
                return block
            shared = self._shared_weights[rows]
            return block - shared @ shared.T
        unit = np.zeros((self.order.size * r - self.second_views.size, rows.size))
        unit[rows, np.arange(rows.size)] = 1.0
        block = self.solve(unit)[rows]
        return 0.5 * (block + block.T)

    def predictor(self, columns: np.ndarray, trend: np.ndarray, trend_root: np.ndarray) -> Callable:
        """Make the predictor of these columns; see Collocation.predict.

        Parameters
        ----------
        columns : (m, p + 1) array
            [A, l - A x].
        trend, trend_root : (p,), (p, p) array
            The root is None if only means are needed.
        """
        nodes = self._smooth(self._without_shared(self._padded(columns)))[1]
        table = (self.gps_time, self.clocks, self.layout, nodes, *self._node_covariances)
        return predictor_by(partial(interpolate, *table), self.layout, trend, trend_root)

    def _padded(self, columns):
        """Columns with zeros in the rows of second views."""
        return np.vstack([columns, np.zeros((self.second_views.size, columns.shape[1]))])

    @cached_property
    def _position(self):
        """Position of each epoch in the order of time."""
        return np.argsort(self.order)

    @property
    def _recursion(self):
        return Recursion(self.layout, self.transitions, self.mixing, self.gains, self.whiteners)

    def _filter(self, columns):
        """Whitened columns and states of V0."""
        n, r, _ = self.mixing.shape
        ordered = columns.reshape(n, r, columns.shape[1])[self.order]
        return filter_columns(self._recursion, np.ascontiguousarray(ordered, dtype=float))

    def _smooth(self, columns):
        """V0^-1 c (m, c), and the smoothed states (n, d, c) of the columns."""
        whitened, states = self._filter(columns)
        weights, adjoints = smooth_columns(self._recursion, whitened)
        unsorted = np.empty_like(weights)
        unsorted[self.order] = weights
        return unsorted.reshape(columns.shape), states + self.covariances @ adjoints

    @cached_property
    def _smoothed(self):
        return smooth_covariance(self._recursion, _steps(self.clocks), self.covariances)

    @cached_property
    def _woodbury(self):
        """Q and T."""
        whitened = self._filter(self.shared)[0].reshape(self.shared.shape)
        return np.linalg.qr(np.vstack([whitened, np.eye(self.shared.shape[1])]))

    def _without_shared(self, columns):
        """Columns minus the shared errors estimated from them; V0^-1 of the result is V^-1 of the
        columns.
        """
        if not self.shared.size:
            return columns
        basis, triangle = self._woodbury
        whitened = self._filter(columns)[0].reshape(columns.shape)
        return columns - self.shared @ np.linalg.solve(
            triangle, basis[: len(whitened)].T @ whitened
        )

    @cached_property
    def _shared_weights(self):
        """Y."""
        return np.linalg.solve(self._woodbury[1].T, self._smooth(self.shared)[0].T).T

    @cached_property
    def _node_covariances(self):
        """Covariances of the smoothed states, and with those of the next epoch."""
        same, following = self._smoothed[1:]
        if not self.shared.size:
            return same, following
        states = self._smooth(self.shared)[1] @ np.linalg.inv(self._woodbury[1])
        across = states.swapaxes(1, 2)
        return same + states @ across, following + states[:-1] @ across[1:]
