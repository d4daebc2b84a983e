"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_triangular

from mlscorr.covariance import Covariance

CHUNK = 20_000  # epochs predicted at once, which bounds the memory


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
    weights : (m,) array
        V^-1 (l - A x), V = B D B^T + N.
    """

    gps_time: np.ndarray
    design: np.ndarray
    signals: tuple[Signal, ...]
    factor: tuple
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
        parts = [
            self._predict(gps_time[part], design[part], [mixing[part] for mixing in mixings])
            for part in (slice(i, i + CHUNK) for i in range(0, len(gps_time), CHUNK))
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
        lower, _ = self.factor
        rows = cross.reshape(-1, len(self.gps_time))
        half = solve_triangular(lower, rows.T, lower=True).T.reshape(cross.shape)
        whitened = solve_triangular(lower, self.design, lower=True)
        left = design - half @ whitened
        covariance = sum(mixing @ mixing.swapaxes(1, 2) for mixing in mixings)
        covariance -= half @ half.swapaxes(1, 2)
        covariance += left @ self.trend_covariance @ left.swapaxes(1, 2)
        return mean, covariance

    def leave_out(self, rows):
        """What the other observations say of some: residuals (l - prediction) and covariance.

        The covariance includes the noise of the observations left out, which is what a test of
        them needs. Source: Dubrule 1983, Math. Geology 15, 687-699.
        """
        inverse = cho_solve(self.factor, np.eye(len(self.gps_time))[:, rows])
        projected = cho_solve(self.factor, self.design)
        block = inverse[rows] - projected[rows] @ self.trend_covariance @ projected[rows].T
        covariance = np.linalg.pinv(block, hermitian=True)
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
    lag = gps_time[:, None] - gps_time
    total = noise + sum(  # V = D_omega + B D_Lambda B^T
        (signal.mixing @ signal.mixing.T) * signal.covariance(lag) for signal in signals
    )
    try:
        factor = cho_factor(total, lower=True)
        factor = (np.tril(factor[0]), True)
    except LinAlgError as problem:
        raise ValueError(
            "The covariance of the misclosures is not positive definite: two observations of one "
            "time without noise, or a sigma of zero."
        ) from problem
    normal = design.T @ cho_solve(factor, design)
    if np.linalg.matrix_rank(normal) < design.shape[1]:
        raise ValueError(
            f"{design.shape[1]} trend parameters are not determined by {len(misclosure)} "
            "misclosures. Lower the order or observe more control points."
        )
    trend_covariance = np.linalg.inv(normal)
    trend = trend_covariance @ (design.T @ cho_solve(factor, misclosure))  # Eq. 13
    residual = misclosure - design @ trend
    weights = cho_solve(factor, residual)  # the right part of Eq. 14 and 15
    squares = float(residual @ weights)
    redundancy = len(misclosure) - design.shape[1]
    determinants = 2 * np.log(np.diag(factor[0])).sum() + np.linalg.slogdet(normal)[1]
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
