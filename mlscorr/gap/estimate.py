"""Parameters of a cause: estimate, sigma, and what this survey could detect at all."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.whitening import whitener

# Minimal detectable bias (Baarda 1968, A testing procedure for use in geodetic networks): found
# with a power of 80 % by a two-sided test at 0.1 % significance, 3.29 + 0.84 sigmas.
DETECTABLE = 4.13
WIDE = 0.3  # m: prior sigma of an amplitude that is as good as free


@dataclass(frozen=True)
class Parameter:
    """One number of a cause; detectable is its minimal detectable bias (80 %, 0.1 %)."""

    name: str
    unit: str
    estimate: float
    sigma: float
    detectable: float


@dataclass(frozen=True)
class Fit:
    """Amplitudes (p,) of some columns, their covariance, and 1 / sigma^2 (p,) of each alone."""

    estimate: np.ndarray
    covariance: np.ndarray
    information: np.ndarray


def fit(epochs, settings, log_weight, residual, columns):
    """Amplitudes of columns (n, p) in a residual (n,), averaged over settings: a Fit."""
    weight = np.exp(log_weight - np.logaddexp.reduce(log_weight))
    used = np.flatnonzero(weight > 0.01 * weight.max())
    weight, p = weight[used] / weight[used].sum(), columns.shape[1]
    means, covariances, information = [], [], np.zeros(p)
    for w, s in zip(weight, used, strict=True):
        white = whitener(epochs, settings[s]).whiten(np.column_stack([columns, residual]))
        normal = white.product(white)
        information += w * np.diag(normal)[:p]
        covariance = np.linalg.inv(normal[:p, :p] + np.eye(p) / WIDE**2)
        means.append(covariance @ normal[:p, p])
        covariances.append(covariance)
    mean = weight @ np.array(means)
    apart = np.array(means) - mean
    spread = np.einsum("s,sp,sq->pq", weight, apart, apart)
    return Fit(mean, np.tensordot(weight, np.array(covariances), 1) + spread, information)
