"""Collocation by the explicit formula, with the covariance matrix of all observations (Eq. 13-15).

Its work grows with the cube of the observations. It is the reference for the other solvers, handles
noise with any correlation, and is the fastest for a few hundred rows of two epochs each. It also
gives the derivatives of its likelihood with respect to signals and trend.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, block_diag, cholesky, solve_triangular

from mlscorr.collocation._states import Layout
from mlscorr.collocation.covariance import correlation
from mlscorr.collocation.model import LARGEST_ERROR, NOT_POSITIVE, Collocation, solve_trend
from mlscorr.collocation.sparse_rows import SparseRows
from mlscorr.compiled_loops import loop

CHUNK = 10_000_000  # covariances computed at once in a prediction, which limits the memory
# Time lag in units of 1 / rate beyond which correlation vanishes by rounding, also exp(-x / 2)
UNCORRELATED_LAG = float(-np.log(np.square(np.finfo(float).eps)))


def collocate_rows_dense(
    rows: Sequence[SparseRows], prior_rows: np.ndarray | None = None
) -> Collocation:
    """Solve rows of any number of epochs by the dense formula; see collocate_rows.

    Parameters
    ----------
    rows : sequence of SparseRows
    prior_rows : (k, p + 1) array, optional
        Prior of the trend; see Collocation.

    Raises
    ------
    ValueError
        If the covariance is not positive definite or the trend is not determined.

    Examples
    --------
    >>> from mlscorr.collocation import Noise, Signal, SparseRows, collocate_rows_dense
    >>> from mlscorr.collocation.covariance import Covariance
    >>> seen = Signal(np.array([-1.0, 1.0])[:, None, None], Covariance("matern32", 30.0))
    >>> noise, none = Noise(np.full((1, 1, 1), 1e-6)), np.zeros((1, 1, 0))
    >>> tie = SparseRows(np.array([[0.0, 900.0]]), np.full((1, 1), 0.3), noise, none, [seen])
    >>> collocate_rows_dense([tie]).predict(np.array([900.0]), none, [np.ones((1, 1, 1))])[0]
    array([[0.14999993]])
    """
    sides = _all_sides(rows)
    total = _covariance(sides, block_diag(*(part.noise.matrix for part in rows)))
    try:
        factor = cholesky(total, lower=True)
    except LinAlgError as problem:
        raise LinAlgError(NOT_POSITIVE.format(len(total))) from problem
    error = np.finfo(float).eps * (np.diag(total) / np.diag(factor) ** 2).sum()
    if error > LARGEST_ERROR:
        raise LinAlgError(
            f"Rounding makes the log-likelihood of {len(total)} misclosures wrong by {error:.1g} "
            f"(limit {LARGEST_ERROR:g}): their noise is negligible next to the signals. Give "
            "each observation its actual sigma."
        )
    covariances = tuple(signal.covariance for signal in rows[0].signals)
    solver = DenseSolver(sides.clocks, sides.mixings, covariances, sides.first, factor)
    misclosure = np.concatenate([np.ravel(part.misclosure) for part in rows])
    return solve_trend(solver, misclosure, _design(rows), prior_rows)


def covariance_given(
    observations: Sequence[SparseRows],
    sought: Sequence[SparseRows],
    prior_rows: np.ndarray | None = None,
) -> np.ndarray:
    r"""Error covariance (q, q) of noise-free rows predicted from other observations (Eq. 15).

    It includes trend and signals, between all pairs of rows, and does not depend on misclosures.
    The effect of a further observation is thus known before it is made.

    Parameters
    ----------
    observations, sought : sequences of SparseRows
        With the same signals and trend.
    prior_rows : (k, p + 1) array, optional
        Prior of the trend; see Collocation.

    Raises
    ------
    ValueError
        See collocate_rows_dense.

    Examples
    --------
    Half a correlation time from a point that is constrained to one millimeter:

    >>> from mlscorr.collocation import Noise, Signal, SparseRows, covariance_given
    >>> from mlscorr.collocation.covariance import Covariance
    >>> signal = Signal(np.ones((1, 1, 1)), Covariance("exponential", 30.0))
    >>> noise, none = Noise(np.full((1, 1, 1), 1e-6)), np.zeros((1, 1, 0))
    >>> at_0 = SparseRows(np.array([[0.0]]), np.zeros((1, 1)), noise, none, [signal])
    >>> at_15 = SparseRows(np.array([[15.0]]), np.zeros((1, 1)), noise, none, [signal])
    >>> np.sqrt(covariance_given([at_0], [at_15])).round(3)
    array([[0.795]])
    """
    solved = collocate_rows_dense(observations, prior_rows)
    m = len(solved.misclosure)
    total = signal_covariance([*observations, *sought])
    half = solved.solver.whiten(total[m:, :m].T)
    trend = solved.solver.whiten(solved.design)
    left = (_design(sought) - half.T @ trend) @ solved.trend_root
    prior = np.tril(total[m:, m:]) + np.tril(total[m:, m:], -1).T
    return np.asarray(prior - half.T @ half + left @ left.T)


def likelihood_changes(
    solved: Collocation,
    rows: Sequence[SparseRows],
    changed: Sequence[Sequence[SparseRows]],
    prior_rows: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    r"""First-order changes (k,) of the restricted log-likelihood with changed signals.

    d log L = (w^T dV w - tr(P dV)) / 2 with w = V^-1 (l - A x) and P = V^-1 less the trend's part
    (Rasmussen and Williams 2006, Eq. 5.9): one factorization of V serves any number of parameters.

    Parameters
    ----------
    solved : Collocation
        Solved by ``collocate_rows_dense``.
    rows : sequence of SparseRows
        Rows that were solved.
    changed : sequence of k sequences of SparseRows
        The same rows with slightly different signals.
    prior_rows : sequence of k arrays, optional
        Prior of the trend for each of these; by default that of the solution.

    Examples
    --------
    A misclosure of 2 m with a prior sigma of 1 m: if sigma grows by 0.1 %, the log-likelihood
    increases by (4 - 1) / 2 of dV, 0.002 m^2.

    >>> from mlscorr.collocation import Noise, Signal, SparseRows
    >>> from mlscorr.collocation import collocate_rows_dense, likelihood_changes
    >>> from mlscorr.collocation.covariance import Covariance
    >>> noise, none = Noise(np.full((1, 1, 1), 1e-6)), np.zeros((1, 1, 0))
    >>> drift = Covariance("exponential", 30.0)
    >>> scales = [Signal(np.full((1, 1, 1), scale), drift) for scale in (1.0, 1.001)]
    >>> rows, more = ([SparseRows(np.zeros((1, 1)), np.full((1, 1), 2.0), noise, none, [signal])]
    ...               for signal in scales)
    >>> likelihood_changes(collocate_rows_dense(rows), rows, [more]).round(4)
    array([0.003])
    """
    slope = np.outer(solved.weights, solved.weights)
    slope -= solved.precision_of(np.arange(len(slope)))
    slope = np.tril(slope) - np.diag(np.diag(slope) / 2)  # each off-diagonal pair counts twice
    by_variance = np.einsum("mi,mi->i", solved.design, slope @ solved.design)  # dV = A dS A^T
    before: dict[tuple, np.ndarray] = {}
    changes = []
    for other, trend in zip(changed, prior_rows or [solved.prior_rows] * len(changed), strict=True):
        numbers = _differing(rows, other)
        if numbers not in before:
            before[numbers] = signal_covariance(_with_signals(rows, numbers))
        after = signal_covariance(_with_signals(other, numbers))
        change = np.vdot(slope, after - before[numbers])
        changes.append(change + by_variance @ (_variance(trend) - _variance(solved.prior_rows)))
    return np.array(changes)


def _variance(prior_rows):
    """Prior variance of each coefficient (p,); zero without a prior, so that it never changes."""
    precision = np.sum(prior_rows[:, :-1] ** 2, axis=0)
    return np.divide(1.0, precision, out=np.zeros_like(precision), where=precision > 0)


def _differing(rows, others):
    """Indices of the signals that differ between rows."""
    same = [
        [
            here.covariance == there.covariance
            and np.array_equal(here.mixing, there.mixing)
            and np.array_equal(here.clock, there.clock)
            for here, there in zip(part.signals, other.signals, strict=True)
        ]
        for part, other in zip(rows, others, strict=True)
    ]
    return tuple(np.flatnonzero(~np.all(same, axis=0)).tolist())


def _with_signals(rows, numbers):
    """Return the rows with some of their signals only."""
    return [replace(part, signals=[part.signals[k] for k in numbers]) for part in rows]


def signal_covariance(rows: Sequence[SparseRows]) -> np.ndarray:
    """Part (m, m) of the signals in V of SparseRows, as a lower triangle."""
    size = sum(part.misclosure.size for part in rows)
    return _covariance(_all_sides(rows), np.zeros((size, size)))


class _Sides(NamedTuple):
    """Sides of all rows: first (m,) of each row, clocks (q, s), mixings (q, k) of signals."""

    layout: Layout
    first: np.ndarray
    clocks: np.ndarray
    mixings: tuple[np.ndarray, ...]


def _all_sides(rows):
    count, clocks, *mixings = (
        np.concatenate(parts) for parts in zip(*(_sides(part) for part in rows), strict=True)
    )
    return _Sides(Layout.of(rows[0].signals), np.cumsum(count) - count, clocks, tuple(mixings))


def _covariance(sides, noise):
    """V as a lower triangle, given the noise covariance (m, m)."""
    total = np.array(noise, dtype=float)
    row = np.repeat(np.arange(len(total)), np.diff(sides.first, append=len(sides.clocks)))
    mixing = np.column_stack([np.zeros((len(row), 0)), *sides.mixings])
    _add_signals(sides.layout, sides.clocks, mixing, row, total)
    return total


def _design(rows):
    """A (m, p)."""
    width = rows[0].design.shape[2]
    return np.concatenate([part.design.reshape(part.misclosure.size, width) for part in rows])


@loop
def _add_signals(layout, clocks, mixing, row, total):
    """Add B D_Lambda B^T of sides, each of which belongs to a row, to the lower triangle of V."""
    processes = np.searchsorted(layout.signal, np.arange(layout.states.size + 1))
    for i in range(row.size):
        for j in range(row.size):
            if row[j] > row[i]:
                break
            for s in range(layout.states.size):
                lag = layout.rates[s] * (clocks[i, s] - clocks[j, s])
                if abs(lag) > UNCORRELATED_LAG:
                    continue
                weight = 0.0
                for k in range(processes[s], processes[s + 1]):
                    weight += mixing[i, k] * mixing[j, k]
                if weight != 0.0:
                    total[row[i], row[j]] += weight * correlation(layout.kinds[s], lag)


def _sides(part):
    """Index (n r) of each row's sides, their clocks (n r e, s), and mixings of each signal."""
    n, r = np.shape(part.misclosure)
    e = np.shape(part.gps_time)[1]
    s = len(part.signals)
    clocks = np.repeat(part.epochs[1].reshape(n, e, s), r, axis=0).reshape(n * r * e, s)
    widths = [signal.mixing.shape[-1] for signal in part.signals]
    mixings = [
        signal.mixing.reshape(n, e, r, k).swapaxes(1, 2).reshape(n * r * e, k)
        for signal, k in zip(part.signals, widths, strict=True)
    ]
    return np.full(n * r, e), clocks, *mixings


@dataclass(frozen=True)
class DenseSolver:
    """V = D_omega + B D_Lambda B^T of m rows by its lower triangular factor F, V = F F^T.

    Parameters
    ----------
    clocks : (q, s) array
        Clocks of the rows' sides.
    mixings : tuple of (q, k) arrays
    covariances : tuple of Covariance
    first : (m,) int array
        Index of the first side of each row.
    factor : (m, m) array
    """

    clocks: np.ndarray
    mixings: tuple
    covariances: tuple
    first: np.ndarray
    factor: np.ndarray

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """F^-1 c."""
        return solve_triangular(self.factor, columns, lower=True)

    @property
    def log_determinant(self) -> float:
        """Log determinant of V."""
        return 2 * np.log(np.diag(self.factor)).sum()

    def solve(self, columns: np.ndarray) -> np.ndarray:
        """V^-1 c."""
        return solve_triangular(self.factor, self.whiten(columns), lower=True, trans="T")

    def precision(self, rows: np.ndarray) -> np.ndarray:
        """Return a block of V^-1."""
        return self._inverse[np.ix_(rows, rows)]

    @cached_property
    def _inverse(self):
        root = self.whiten(np.eye(len(self.factor)))
        return root.T @ root

    def predictor(self, columns: np.ndarray, trend: np.ndarray, trend_root: np.ndarray) -> Callable:
        """Make the predictor of these columns; see Collocation.predict.

        Parameters
        ----------
        columns : (m, p + 1) array
            [A, l - A x].
        trend, trend_root : (p,), (p, p) array
            The root is None if only means are needed.
        """
        whitened = self.whiten(columns)

        def predict(clocks, design, mixings):
            lags = clocks.T[:, :, None] - self.clocks.T[:, None]
            terms = zip(lags, mixings, self.mixings, self.covariances, strict=True)
            cross = np.zeros((*design.shape[:2], len(self.clocks)))
            prior = np.zeros((*design.shape[:2], design.shape[1]))
            for lag, mixing, observed, covariance in terms:
                cross += (mixing @ observed.T) * covariance(lag)[:, None, :]
                prior += mixing @ mixing.swapaxes(1, 2)
            cross = np.add.reduceat(cross, self.first, axis=2)  # D_Lambda'Lambda B^T
            half = self.whiten(cross.reshape(-1, cross.shape[2]).T).T.reshape(cross.shape)
            mean = design @ trend + half @ whitened[:, -1]  # Eq. 15
            if trend_root is None:
                return (mean,)
            # Covariance of the error: prior signal minus the observed part, plus trend
            left = (design - half @ whitened[:, :-1]) @ trend_root
            return mean, prior - half @ half.swapaxes(1, 2) + left @ left.swapaxes(1, 2)

        def in_chunks(gps_time, clocks, design, mixings):
            step = max(CHUNK // (design.shape[1] * len(self.clocks)), 1)
            chunks = [slice(i, i + step) for i in range(0, max(len(gps_time), 1), step)]
            parts = [predict(clocks[c], design[c], [m[c] for m in mixings]) for c in chunks]
            return tuple(np.concatenate(part) for part in zip(*parts, strict=True))

        return in_chunks
