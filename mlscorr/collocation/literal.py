"""Predictor of the paper as printed (Mao et al. 2015, Eq. 13-15, 19 and 20).

Two covariances there describe the same signal, but are inconsistent. D_Lambda, between the control
epochs, is diagonal and contains the variances v(Lambda) that the POS states. D_Lambda'Lambda,
between control and other epochs, is C0 exp(-t / dt). C0 appears only in the second, so the
predicted signal is proportional to it: the squared RMS of any residuals is exactly a parabola in
C0, whose value at C0 = 0 is that of the trend only. The paper's Table 3 confirms this: parabolas
through its rows have R^2 = 1 - 1e-6, and the one of 21 points starts at 0.1619 m, where LS of order
5 has 0.1618 m. If C0 also appeared in D_Lambda, the signal would grow less than proportionally.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from mlscorr.collocation.covariance import Covariance
from mlscorr.collocation.dense import CHUNK, DenseSolver
from mlscorr.collocation.model import NOT_POSITIVE, Collocation, Noise, solve_trend


@dataclass(frozen=True)
class LiteralSignal:
    """Random variables Lambda of one correlation time.

    Parameters
    ----------
    partials : (n, r, k) array
        B at n epochs with r observations each.
    variance : (k,) or (n, k) array
        v(Lambda), the diagonal of D_Lambda (section 2.5).
    base : (k,) array
        C0 of Eq. 20.
    correlation_time : float
        dt of Eq. 20. Units: s.
    """

    partials: np.ndarray
    variance: np.ndarray
    base: np.ndarray
    correlation_time: float


@dataclass(frozen=True)
class LiteralCollocation:
    """Solved literal collocation.

    Covariances of predictions are None. The paper gives none, and its covariances cannot give any:
    they do not form a joint covariance, so the resulting error variance may be negative.

    Parameters
    ----------
    gps_time, misclosure, signals
        See collocate_literal.
    least_squares : Collocation
        Of the trend, with V = B D_Lambda B^T + D_omega.
    """

    gps_time: np.ndarray
    misclosure: np.ndarray
    signals: tuple[LiteralSignal, ...]
    least_squares: Collocation

    @property
    def trend(self) -> np.ndarray:
        """Parameters (p,) of the trend, x of Eq. 13."""
        return self.least_squares.trend

    def predict(
        self, gps_time: np.ndarray, design: np.ndarray, partials: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, None]:
        """Predict trend plus signal at other epochs: (q, r), and None for its covariance.

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        design : (q, r, p) array
        partials : sequence of (q, r, k) arrays
            Partial derivatives by each signal's Lambda'.
        """
        weights = self.least_squares.weights.reshape(self.misclosure.shape)  # V^-1 (l - A x)
        mean = design @ self.trend
        step = max(CHUNK // max(len(self.gps_time), 1), 1)
        for signal, partial in zip(self.signals, partials, strict=True):
            correlation = Covariance("exponential", signal.correlation_time)
            weighted = np.einsum("nrk,nr->nk", signal.partials, weights)  # B^T V^-1 (l - A Y)
            for i in range(0, len(gps_time), step):
                part = slice(i, i + step)
                lag = gps_time[part, None] - self.gps_time
                predicted = signal.base * (correlation(lag) @ weighted)  # Eq. 20 in Eq. 15
                mean[part] += np.einsum("qrk,qk->qr", partial[part], predicted)
        return mean, None


def collocate_literal(
    gps_time: np.ndarray,
    misclosure: np.ndarray,
    noise: Noise,
    design: np.ndarray,
    signals: Sequence[LiteralSignal],
) -> LiteralCollocation:
    """Solve the collocation as the paper prints it; for its experiments, not for surveys.

    Without signals, or with C0 = 0, it is least squares of the trend with weights (B D_Lambda B^T +
    D_omega)^-1, which is plain LS if these are the same at all epochs.

    Parameters
    ----------
    gps_time, misclosure, noise, design
        See collocate.
    signals : sequence of LiteralSignal

    Raises
    ------
    ValueError
        See collocate.

    Examples
    --------
    >>> time, unit = np.array([0.0, 10.0, 20.0]) + 413200.0, np.ones((3, 1, 1))
    >>> signal = LiteralSignal(unit, np.array([0.08]), np.array([0.04]), 30.0)
    >>> misclosure = np.array([[0.4], [0.6], [0.5]])
    >>> solved = collocate_literal(time, misclosure, Noise(0.02 * unit), unit, [signal])
    >>> solved.trend.round(6)
    array([0.5])
    >>> solved.predict(time[:1] - 1e4, unit[:1], [unit[:1]])[0].round(6)  # far away: the trend
    array([[0.5]])
    """
    n, r = np.shape(misclosure)
    blocks = np.zeros((n, r, n, r))
    for signal in signals:  # B D_Lambda B^T of Eq. 13 and 14, without correlation in time
        scaled = signal.partials * np.sqrt(np.atleast_2d(signal.variance))[:, None, :]
        blocks[np.arange(n), :, np.arange(n), :] += scaled @ scaled.swapaxes(1, 2)
    try:
        factor = cholesky(blocks.reshape(n * r, n * r) + noise.matrix, lower=True)
    except LinAlgError as problem:
        raise ValueError(NOT_POSITIVE.format(n * r)) from problem
    solver = DenseSolver(np.repeat(gps_time, r), (), (), np.arange(len(factor)), factor)
    solved = solve_trend(solver, misclosure.ravel(), design.reshape(n * r, -1))  # Eq. 13
    return LiteralCollocation(gps_time, misclosure, tuple(signals), solved)
