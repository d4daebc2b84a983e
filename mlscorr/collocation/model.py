"""Model l = A x + B s + n: trend, signals and noise, and least squares of the trend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mlscorr.collocation.covariance import Covariance
from mlscorr.survey import SAME_EPOCH

SMALLEST_INFORMATION = 1e-9  # smallest share of the trend's information without some rows
LARGEST_ERROR = 0.01  # of the log-likelihood by rounding; parameters differ by more than that
NOT_POSITIVE = (
    "The covariance of the {} misclosures is not positive definite: two observations at one "
    "time have no noise, or a sigma is zero. Give each observation and control point its actual "
    "sigma."
)


def polynomial_design(
    gps_time: np.ndarray, span: tuple[float, float], order: int, extrapolate: bool = False
) -> np.ndarray:
    """Partial derivatives of a polynomial per axis, in Legendre's well-conditioned basis.

    Parameters
    ----------
    gps_time : (q,) array
        Units: s.
    span : (float, float)
        First and last control epoch. Units: s.
    order : int
    extrapolate : bool
        True to extend the polynomial beyond the span, as in the paper. Otherwise it keeps its value
        at the end, because it would diverge there.

    Returns
    -------
    (q, 3, 3 (order + 1)) array
        Parameters are ordered by degree, then by axis.
    """
    first, last = span
    middle = (first + last) / 2
    half = max((last - first) / 2, SAME_EPOCH)
    argument = (gps_time - middle) / half
    if not extrapolate:
        argument = np.clip(argument, -1, 1)
    basis = np.polynomial.legendre.legvander(argument, order)
    return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, 3 * (order + 1))


@dataclass(frozen=True)
class Signal:
    """Random processes with one covariance function, and their effect on the observations.

    Parameters
    ----------
    mixing : (n, r, k) array
        B times the sigmas of k independent processes, each of unit variance, at n epochs with r
        observations each.
    covariance : Covariance
        Function of lags of ``clock``.
    clock : (n,) array, optional
        The processes' own time, non-decreasing with gps_time; a jump much longer than all
        correlation times restarts them. gps_time by default. Units: s.
    """

    mixing: np.ndarray
    covariance: Covariance
    clock: np.ndarray | None = None


def signal_clocks(signals: Sequence[Signal], gps_time: np.ndarray) -> np.ndarray:
    """Clocks (n, s) of signals at n epochs.

    Parameters
    ----------
    signals : sequence of Signal
    gps_time : (n,) array
        Units: s.
    """
    return _clock_columns(gps_time, [signal.clock for signal in signals])


def _clock_columns(gps_time, clocks):
    """Clocks (n, s), with gps_time in place of None."""
    columns = np.tile(gps_time[:, None], (1, len(clocks)))
    for number, clock in enumerate(clocks):
        if clock is not None:
            columns[:, number] = clock
    return columns


@dataclass(frozen=True)
class Noise:
    """Noise of n epochs with r observations each (Mao et al. 2015, Eq. 19).

    Parameters
    ----------
    own : (n, r, r) array
        Covariance of the independent noise of each epoch, from the extraction. Units: m^2.
    group : (n,) int array, optional
        Target of each epoch, as a row of ``shared``.
    shared : (g, r) array, optional
        Sigmas of the error common to all epochs of a target, from its survey. Units: m.
    """

    own: np.ndarray
    group: np.ndarray | None = None
    shared: np.ndarray | None = None

    @cached_property
    def separate(self) -> np.ndarray:
        """Covariance (n, r, r) of each epoch's noise, without the errors shared with others."""
        if self.group is None:
            return self.own
        is_single = ~np.isin(self.group, self.repeated)
        variance = np.where(is_single[:, None], self.shared[self.group] ** 2, 0.0)
        return self.own + variance[:, :, None] * np.eye(variance.shape[1])

    @cached_property
    def common(self) -> np.ndarray:
        """Columns (n r, c) of the errors shared by several epochs, each of unit variance."""
        n, r = self.own.shape[:2]
        if self.group is None:
            return np.zeros((n * r, 0))
        members = self.group[:, None] == self.repeated
        sigma = np.where(members[:, :, None], self.shared[self.repeated], 0.0)
        return np.einsum("ngk,jk->njgk", sigma, np.eye(r)).reshape(n * r, members.shape[1] * r)

    @cached_property
    def repeated(self) -> np.ndarray:
        """Groups with several epochs and a shared error."""
        if self.group is None:
            return np.zeros(0, dtype=np.int64)
        groups, count = np.unique(self.group, return_counts=True)
        return groups[(count > 1) & np.any(self.shared[groups] > 0, axis=1)]

    @property
    def matrix(self) -> np.ndarray:
        """Return the full noise covariance matrix (n r, n r)."""
        return self.block(np.arange(self.own.shape[0] * self.own.shape[1]))

    def block(self, rows: np.ndarray) -> np.ndarray:
        """Return the covariance of some rows, numbered as in a Collocation."""
        epoch, row = np.divmod(np.asarray(rows, dtype=int), self.own.shape[1])
        separate = self.separate[epoch[:, None], row[:, None], row]
        common = self.common[rows]
        return np.where(epoch[:, None] == epoch, separate, 0.0) + common @ common.T

    def select(self, epochs: np.ndarray) -> Noise:
        """Return the noise of some epochs, by their indices or an (n,) mask."""
        group = None if self.group is None else self.group[epochs]
        return Noise(self.own[epochs], group, self.shared)


@dataclass(frozen=True)
class Collocation:
    """Solved collocation: trend, and all that is needed to predict the signal at any epoch.

    Rows are numbered as in ``misclosure.ravel()``: observation j of epoch i is row i r + j.

    Parameters
    ----------
    solver : DenseSolver or MarkovSolver
        Solver of V = B D B^T + N.
    misclosure, design : (m,), (m, p) array
        l and A.
    trend, trend_root : (p,), (p, p) array
        x (Eq. 13), and the root whose square is its covariance.
    log_likelihood : float
        Restricted log-likelihood of the misclosures.
    sigma0 : float
        Square root of the weighted residual sum of squares over the redundancy, m - p plus the
        priors of the trend; one if the model is right.
    prior_rows : (k, p + 1) array
        Prior of the trend: further rows of A, one coefficient each, and their misclosures, all with
        a sigma of one.
    """

    solver: Any
    misclosure: np.ndarray
    design: np.ndarray
    trend: np.ndarray
    trend_root: np.ndarray
    log_likelihood: float
    sigma0: float
    prior_rows: np.ndarray

    @property
    def trend_covariance(self) -> np.ndarray:
        """Covariance (p, p) of the trend."""
        return self.trend_root @ self.trend_root.T

    @cached_property
    def weights(self) -> np.ndarray:
        """V^-1 (l - A x), (m,)."""
        return self._solved_columns @ np.append(-self.trend, 1.0)

    def predict(
        self,
        gps_time: np.ndarray,
        design: np.ndarray,
        mixings: Sequence[np.ndarray],
        clocks: Sequence[np.ndarray | None] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Predict trend plus signal at other epochs, with covariance  (Eq. 15).

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        design : (q, r, p) array
        mixings : list of (q, r, k) arrays, one for each signal
            Row q of the result is design @ x + sum of mixing @ s(gps_time).
        clocks : list of (q,) arrays or None, optional
            Clocks at these epochs, for the signals that have their own.

        Returns
        -------
        mean, covariance : (q, r), (q, r, r) array
            The covariance is that of the prediction error: it decreases near observations, and
            includes that of the trend.
        """
        gps_time = np.asarray(gps_time, dtype=float)
        if clocks is None:
            clocks = [None] * len(mixings)
        return self._predictor(gps_time, _clock_columns(gps_time, clocks), design, mixings)

    def predict_mean(
        self,
        gps_time: np.ndarray,
        design: np.ndarray,
        mixings: Sequence[np.ndarray],
        clocks: Sequence[np.ndarray | None] | None = None,
    ) -> np.ndarray:
        """Predict the mean (q, r) only, which sparse rows give without an inverse."""
        return replace(self, trend_root=None).predict(gps_time, design, mixings, clocks)[0]

    @cached_property
    def _predictor(self):
        columns = np.column_stack([self.design, self.misclosure - self.design @ self.trend])
        return self.solver.predictor(columns, self.trend, self.trend_root)

    @cached_property
    def _leverage(self):
        """Orthonormal basis (m + k, p) of the columns of A and of the prior of the trend."""
        return np.linalg.qr(np.vstack([self.design, self.prior_rows[:, :-1]]))[0]

    @cached_property
    def projected(self) -> np.ndarray:
        """V^-1 A times the root of the trend's covariance, (m, p)."""
        return self._solved_columns[:, :-1] @ self.trend_root

    @cached_property
    def _solved_columns(self):
        """V^-1 [A, l], (m, p + 1)."""
        return self.solver.solve(np.column_stack([self.design, self.misclosure]))

    def determined_without(self, rows: np.ndarray) -> bool:
        """Return True if the observations other than these determine the trend."""
        basis = self._leverage[rows]
        limit = 1.0 - SMALLEST_INFORMATION
        is_small = np.sum(basis**2) < limit  # sum over all singular values, which is fast
        return bool(is_small or np.linalg.svd(basis, compute_uv=False)[0] ** 2 < limit)

    def leave_out(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predict some observations from all others: residuals (l - prediction) and covariance.

        The covariance includes the noise of the omitted observations, as a test of them requires.
        Both come from the block of V^-1 minus the trend's part, without solving again (Dubrule
        1983, Math. Geology 15, 687-699).

        Parameters
        ----------
        rows : (k,) int array

        Raises
        ------
        ValueError
            If the others do not determine the trend.
        """
        if not self.determined_without(rows):
            raise ValueError(
                f"Without the {len(rows)} observations left out, the remaining "
                f"{len(self.misclosure) - len(rows)} do not determine the trend."
            )
        covariance = np.linalg.inv(self.precision_of(rows))
        return covariance @ self.weights[rows], covariance

    def precision_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the inverse covariance (k, k) of omitted rows, with the trend unknown."""
        projected = self.projected[rows]
        return self.solver.precision(rows) - projected @ projected.T


def solve_trend(
    solver: Any, misclosure: np.ndarray, design: np.ndarray, prior_rows: np.ndarray | None = None
) -> Collocation:
    """Solve generalized least squares, x = (A^T V^-1 A)^-1 A^T V^-1 l  (Eq. 13).

    The prior of the trend is appended below the whitened misclosures. The likelihood is the
    restricted one (Rasmussen and Williams 2006, Eq. 2.43; 2.45 with an infinitely wide prior for
    coefficients without one).

    Parameters
    ----------
    solver : DenseSolver or MarkovSolver
        Solver of V. It has ``whiten(columns)``, with W^T W = c^T V^-1 c; ``log_determinant``;
        ``solve(columns)``, V^-1 c; ``precision(rows)``, a block of V^-1; ``predictor(columns,
        trend, root)``, of means only if the root is None.
    misclosure, design : (m,), (m, p) array
    prior_rows : (k, p + 1) array, optional
        See Collocation.

    Raises
    ------
    ValueError
        If the rank of A is less than its number of columns.
    """
    p = design.shape[1]
    if prior_rows is None:
        prior_rows = np.zeros((0, p + 1))
    whitened = np.vstack([solver.whiten(np.column_stack([design, misclosure])), prior_rows])
    basis, triangle = np.linalg.qr(whitened[:, :p])
    values = np.linalg.svd(triangle, compute_uv=False)
    smallest = len(whitened) * np.finfo(float).eps  # for the rank, as in numpy's matrix_rank
    redundancy = len(misclosure) + len(prior_rows) - p
    if redundancy < 0 or (p and values[-1] <= smallest * values[0]):
        raise ValueError(
            f"{len(misclosure)} misclosures do not determine {p} trend parameters. Lower the "
            "order or survey more control points."
        )
    root = np.linalg.inv(triangle)
    trend = root @ (basis.T @ whitened[:, p])
    residual = whitened[:, p] - whitened[:, :p] @ trend
    squares = float(residual @ residual)
    determinants = solver.log_determinant + 2 * np.log(np.abs(np.diag(triangle))).sum()
    determinants -= 2 * np.log(prior_rows[:, :p].sum(axis=1)).sum()
    log_likelihood = -0.5 * (squares + determinants + redundancy * np.log(2 * np.pi))
    sigma0 = np.nan
    if redundancy:
        sigma0 = np.sqrt(squares / redundancy)
    return Collocation(
        solver=solver,
        misclosure=misclosure,
        design=design,
        trend=trend,
        trend_root=root,
        log_likelihood=float(log_likelihood),
        sigma0=float(sigma0),
        prior_rows=prior_rows,
    )
