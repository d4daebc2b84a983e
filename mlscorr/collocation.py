"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from mlscorr.covariance import Covariance

CHUNK = 10_000_000  # covariances computed at once in a prediction, which bounds the memory
DETERMINED = 1e-9  # least share of the trend's information that must remain without some rows


@dataclass(frozen=True)
class Signal:
    """Random processes of one covariance function, and how they enter the observations.

    Parameters
    ----------
    mixing : (m, k) array, or (q, r, k) for q epochs of r quantities
        B times the sigmas of k independent processes, each of unit variance.
    covariance : Covariance
    """

    mixing: np.ndarray
    covariance: Covariance


@dataclass(frozen=True)
class Collocation:
    """A solved collocation: trend, and what is needed to predict the signal at any epoch.

    Parameters
    ----------
    trend, trend_covariance : (p,), (p, p) array
        x (Eq. 13) and its covariance.
    log_likelihood : float
        Restricted log-likelihood of the misclosures.
    sigma0 : float
        Square root of the weighted residual sum of squares over the redundancy m - p; one if the
        model is right.
    factor : (m, m) array
        Lower triangular F with F F^T = V = B D B^T + N.
    weights : (m,) array
        V^-1 (l - A x).
    """

    gps_time: np.ndarray
    design: np.ndarray
    signals: tuple[Signal, ...]
    factor: np.ndarray
    trend: np.ndarray
    trend_covariance: np.ndarray
    weights: np.ndarray
    log_likelihood: float
    sigma0: float

    def predict(self, gps_time, design, mixings):
        """Trend plus signal at other epochs, with covariance  (Eq. 15).

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        design : (q, r, p) array
        mixings : list of (q, r, k) arrays, one for each signal
            Row q of the result is design @ x + sum of mixing @ s(gps_time).

        Returns
        -------
        mean, covariance : (q, r), (q, r, r) array
        """
        step = max(CHUNK // (design.shape[1] * len(self.gps_time)), 1)
        parts = [
            self._predict(gps_time[part], design[part], [mixing[part] for mixing in mixings])
            for part in (slice(i, i + step) for i in range(0, len(gps_time), step))
        ]
        mean, covariance = zip(*parts, strict=True)
        return np.concatenate(mean), np.concatenate(covariance)

    def _predict(self, gps_time, design, mixings):
        lag = gps_time[:, None] - self.gps_time
        cross = sum(  # D_Lambda'Lambda B^T
            (mixing @ signal.mixing.T) * signal.covariance(lag)[:, None, :]
            for mixing, signal in zip(mixings, self.signals, strict=True)
        )
        mean = design @ self.trend + cross @ self.weights
        # Covariance of the prediction error: signal, less what was observed of it, plus trend
        rows = cross.reshape(-1, len(self.gps_time))
        half = solve_triangular(self.factor, rows.T, lower=True).T.reshape(cross.shape)
        left = design - half @ solve_triangular(self.factor, self.design, lower=True)
        covariance = sum(mixing @ mixing.swapaxes(1, 2) for mixing in mixings)
        covariance -= half @ half.swapaxes(1, 2)
        covariance += left @ self.trend_covariance @ left.swapaxes(1, 2)
        return mean, covariance

    @cached_property
    def _precision(self):
        """V^-1 - V^-1 A (A^T V^-1 A)^-1 A^T V^-1, (m, m): weight of what the trend leaves."""
        inverse = solve_triangular(self.factor, np.eye(len(self.gps_time)), lower=True)
        inverse = inverse.T @ inverse
        projected = inverse @ self.design
        return inverse - projected @ self.trend_covariance @ projected.T

    @cached_property
    def _leverage(self):
        """Orthonormal basis (m, p) of the columns of A."""
        return np.linalg.qr(self.design)[0]

    def determined_without(self, rows):
        """Whether the observations other than these determine the trend."""
        basis = self._leverage[rows]
        if basis.shape[1] == 0:
            return True
        return bool(np.linalg.svd(basis, compute_uv=False)[0] ** 2 < 1.0 - DETERMINED)

    def leave_out(self, rows):
        """What the other observations say of some: residuals (l - prediction) and covariance.

        The covariance includes the noise of the observations left out, which is what a test of
        them needs. Raises ValueError when the others don't determine the trend. Source: Dubrule
        1983, Math. Geology 15, 687-699.
        """
        if not self.determined_without(rows):
            raise ValueError(
                f"Without the {len(rows)} observations that are left out the other "
                f"{len(self.gps_time) - len(rows)} do not determine the trend."
            )
        covariance = np.linalg.inv(self._precision[np.ix_(rows, rows)])
        return covariance @ self.weights[rows], covariance


def collocate(gps_time, misclosure, noise, design, signals):
    r"""Separate misclosures into trend, signal and noise.

    Solves l = A x + B s + n with one covariance function throughout (Mao et al. 2015,
    Eq. 13-15; the paper's diagonal D_Lambda is no valid joint covariance with Eq. 20).

    Parameters
    ----------
    gps_time : (m,) array
        Time of each scalar observation. Units: s.
    misclosure : (m,) array
        Surveyed - observed. Units: m.
    noise : (m, m) array
        Covariance of survey and extraction (Eq. 19). Units: m^2.
    design : (m, p) array
        A. May have no column.
    signals : sequence of Signal

    Returns a Collocation. Raises ValueError when the trend is not determined (rank of A) or the
    covariance of the observations is not positive definite.

    >>> time = np.array([0.0, 10.0, 20.0]) + 413200.0
    >>> one = np.ones((3, 1))
    >>> signal = Signal(0.1 * one, Covariance("matern32", 30.0))
    >>> solved = collocate(time, np.full(3, 0.5), 1e-6 * np.eye(3), one, [signal])
    >>> solved.trend.round(6)
    array([0.5])
    """
    factor = _factor(gps_time, noise, signals)
    whitened = solve_triangular(factor, design, lower=True)
    if np.linalg.matrix_rank(whitened) < design.shape[1]:
        raise ValueError(
            f"{design.shape[1]} trend parameters are not determined by {len(misclosure)} "
            "misclosures. Lower the order or observe more control points."
        )
    basis, triangle = np.linalg.qr(whitened)
    root = np.linalg.inv(triangle)
    trend_covariance = root @ root.T  # (A^T V^-1 A)^-1
    trend = root @ (basis.T @ solve_triangular(factor, misclosure, lower=True))  # Eq. 13
    residual = solve_triangular(factor, misclosure - design @ trend, lower=True)
    weights = solve_triangular(factor, residual, lower=True, trans="T")  # of Eq. 14 and 15
    squares = float(residual @ residual)
    redundancy = len(misclosure) - design.shape[1]
    determinants = 2 * np.log(np.diag(factor)).sum()
    determinants += 2 * np.log(np.abs(np.diag(triangle))).sum()
    log_likelihood = -0.5 * (squares + determinants + redundancy * np.log(2 * np.pi))
    return Collocation(
        gps_time=gps_time,
        design=design,
        signals=tuple(signals),
        factor=factor,
        trend=trend,
        trend_covariance=trend_covariance,
        weights=weights,
        log_likelihood=float(log_likelihood),
        sigma0=float(np.sqrt(squares / redundancy)) if redundancy else float("nan"),
    )


def _factor(gps_time, noise, signals):
    """Lower triangular factor (m, m) of V = D_omega + B D_Lambda B^T."""
    epochs, of = np.unique(gps_time, return_inverse=True)
    lag = epochs[:, None] - epochs
    total = noise + sum(
        (signal.mixing @ signal.mixing.T) * signal.covariance(lag)[np.ix_(of, of)]
        for signal in signals
    )
    try:
        return cholesky(total, lower=True)
    except LinAlgError as problem:
        raise ValueError(
            f"The covariance of the {len(gps_time)} misclosures is not positive definite: two "
            "observations of one time without noise, or a sigma of zero. Give each observation "
            "and control point the sigma that it has."
        ) from problem
