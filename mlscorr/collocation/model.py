"""What a collocation is about: signals, and the generalised least squares of the trend."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mlscorr.collocation.covariance import Covariance

SMALLEST_INFORMATION = 1e-9  # least share of the trend's information left without some rows
LARGEST_ERROR = 0.01  # of the log-likelihood by rounding: parameters differ by more than that
NOT_POSITIVE = (
    "The covariance of the {} misclosures is not positive definite: two observations of one time "
    "without noise, or a sigma of zero. Give each observation and control point the sigma it has."
)


@dataclass(frozen=True)
class Signal:
    """Random processes of one covariance function, and how they enter the observations.

    Parameters
    ----------
    mixing : (n, r, k) array
        B times the sigmas of k independent processes, each of unit variance, at n epochs with r
        observations each.
    covariance : Covariance
        Of the lags of ``clock``.
    clock : (n,) array, optional
        The processes' own time, which never falls as gps_time rises; a leap of more than all
        correlation times lets them start anew. gps_time by default. Units: s.
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
    clocks = [gps_time if s.clock is None else s.clock for s in signals]
    return np.column_stack([np.zeros((len(gps_time), 0)), *clocks])


@dataclass(frozen=True)
class Collocation:
    """A solved collocation: trend, and what is needed to predict the signal at any epoch.

    Rows are numbered as in ``misclosure.ravel()``: observation j of epoch i is row i r + j.

    Parameters
    ----------
    solver : DenseSolver or MarkovSolver
        Of V = B D B^T + N.
    misclosure, design : (m,), (m, p) array
        l and A.
    trend, trend_root : (p,), (p, p) array
        x (Eq. 13), and the root whose square is its covariance.
    log_likelihood : float
        Restricted log-likelihood of the misclosures.
    sigma0 : float
        Square root of the weighted residual sum of squares over the redundancy, m - p and what is
        believed of the trend; one if the model is right.
    believed : (k, p) array
        What is believed of the trend, as further rows of A, a coefficient each: its misclosure is
        zero, with a sigma of one.
    """

    solver: Any
    misclosure: np.ndarray
    design: np.ndarray
    trend: np.ndarray
    trend_root: np.ndarray
    log_likelihood: float
    sigma0: float
    believed: np.ndarray

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
        """Trend plus signal at other epochs, with covariance  (Eq. 15).

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        design : (q, r, p) array
        mixings : list of (q, r, k) arrays, one for each signal
            Row q of the result is design @ x + sum of mixing @ s(gps_time).
        clocks : list of (q,) arrays or None, optional
            Of the signals that have a clock of their own, there.

        Returns
        -------
        mean, covariance : (q, r), (q, r, r) array
            The covariance is that of the error: it falls where there are observations, and it
            includes that of the trend.
        """
        gps_time = np.asarray(gps_time, dtype=float)
        clocks = [None] * len(mixings) if clocks is None else clocks
        clocks = np.column_stack(
            [np.zeros((len(gps_time), 0)), *(gps_time if c is None else c for c in clocks)]
        )
        return self._predictor(gps_time, clocks, design, mixings)

    def predict_mean(
        self,
        gps_time: np.ndarray,
        design: np.ndarray,
        mixings: Sequence[np.ndarray],
        clocks: Sequence[np.ndarray | None] | None = None,
    ) -> np.ndarray:
        """The mean (q, r) of ``predict`` by itself, which sparse rows know without an inverse."""
        return replace(self, trend_root=None).predict(gps_time, design, mixings, clocks)[0]

    @cached_property
    def _predictor(self):
        columns = np.column_stack([self.design, self.misclosure - self.design @ self.trend])
        return self.solver.predictor(columns, self.trend, self.trend_root)

    @cached_property
    def _leverage(self):
        """Orthonormal basis (m + k, p) of the columns of A and of what is believed of the trend."""
        return np.linalg.qr(np.vstack([self.design, self.believed]))[0]

    @cached_property
    def projected(self) -> np.ndarray:
        """V^-1 A times the root of the trend's covariance, (m, p)."""
        return self._solved_columns[:, :-1] @ self.trend_root

    @cached_property
    def _solved_columns(self):
        """V^-1 [A, l], (m, p + 1)."""
        return self.solver.solve(np.column_stack([self.design, self.misclosure]))

    def determined_without(self, rows: np.ndarray) -> bool:
        """Whether the observations other than these determine the trend."""
        basis = self._leverage[rows]
        limit = 1.0 - SMALLEST_INFORMATION
        is_small = np.sum(basis**2) < limit  # of all singular values, which is quick
        return bool(is_small or np.linalg.svd(basis, compute_uv=False)[0] ** 2 < limit)

    def leave_out(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the other observations say of some: residuals (l - prediction) and covariance.

        The covariance includes the noise of the observations left out, which is what a test of
        them needs. Both come from the block of V^-1 less the trend's part, without solving again
        (Dubrule 1983, Math. Geology 15, 687-699).

        Parameters
        ----------
        rows : (k,) int array

        Raises
        ------
        ValueError
            Where the others don't determine the trend.
        """
        if not self.determined_without(rows):
            raise ValueError(
                f"Without the {len(rows)} observations that are left out the other "
                f"{len(self.misclosure) - len(rows)} do not determine the trend."
            )
        covariance = np.linalg.inv(self.precision_of(rows))
        return covariance @ self.weights[rows], covariance

    def precision_of(self, rows: np.ndarray) -> np.ndarray:
        """Inverse covariance (k, k) of rows that are left out, the trend unknown."""
        projected = self.projected[rows]
        return self.solver.precision(rows) - projected @ projected.T


def solve_trend(
    solver: Any, misclosure: np.ndarray, design: np.ndarray, believed: np.ndarray | None = None
) -> Collocation:
    """Generalised least squares, x = (A^T V^-1 A)^-1 A^T V^-1 l  (Eq. 13).

    What is believed of the trend stands below the whitened misclosures. The likelihood is the
    restricted one, of what the trend leaves (Rasmussen and Williams 2006, Eq. 2.43; 2.45 with the
    trend's prior infinitely wide where nothing is believed).

    Parameters
    ----------
    solver : DenseSolver or MarkovSolver
        Of V. It has ``whiten(columns)``, of which W^T W = c^T V^-1 c; ``log_determinant``;
        ``solve(columns)``, V^-1 c; ``precision(rows)``, a block of V^-1; ``predictor(columns,
        trend, root)``, of means alone where the root is None.
    misclosure, design : (m,), (m, p) array
    believed : (k, p) array, optional
        As of a Collocation.

    Raises
    ------
    ValueError
        Where the rank of A is less than its columns.
    """
    p = design.shape[1]
    believed = np.zeros((0, p)) if believed is None else believed
    whitened = solver.whiten(np.column_stack([design, misclosure]))
    whitened = np.vstack([whitened, np.column_stack([believed, np.zeros(len(believed))])])
    basis, triangle = np.linalg.qr(whitened[:, :p])
    values = np.linalg.svd(triangle, compute_uv=False)
    smallest = len(whitened) * np.finfo(float).eps  # of a rank, as numpy's matrix_rank has it
    redundancy = len(misclosure) + len(believed) - p
    if redundancy < 0 or (p and values[-1] <= smallest * values[0]):
        raise ValueError(
            f"{p} trend parameters are not determined by {len(misclosure)} "
            "misclosures. Lower the order or observe more control points."
        )
    root = np.linalg.inv(triangle)
    trend = root @ (basis.T @ whitened[:, p])
    residual = whitened[:, p] - whitened[:, :p] @ trend
    squares = float(residual @ residual)
    determinants = solver.log_determinant + 2 * np.log(np.abs(np.diag(triangle))).sum()
    determinants -= 2 * np.log(believed.sum(axis=1)).sum()
    log_likelihood = -0.5 * (squares + determinants + redundancy * np.log(2 * np.pi))
    return Collocation(
        solver=solver,
        misclosure=misclosure,
        design=design,
        trend=trend,
        trend_root=root,
        log_likelihood=float(log_likelihood),
        sigma0=float(np.sqrt(squares / redundancy)) if redundancy else float("nan"),
        believed=believed,
    )
