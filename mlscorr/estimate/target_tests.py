"""What the other targets say of each."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, ndtri

from mlscorr.collocation import Collocation
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.posterior import Objective, Posterior
from mlscorr.estimate.settings import SETTINGS


@dataclass(frozen=True)
class TargetTest:
    """What the other targets say of one, of k passes.

    Parameters
    ----------
    name : str
    statistic, critical : float
        Chi-squared, and its critical value.
    left_out, sigma : (k, 3) array
        Its misclosures once the others have corrected them, and their sigmas. Units: m.
    redundancy : (k, 3) array
        The share of an error that its residual shows.
    """

    name: str
    statistic: float
    critical: float
    left_out: np.ndarray
    sigma: np.ndarray
    redundancy: np.ndarray

    @property
    def w(self) -> np.ndarray:
        """Data snooping's w (k, 3): standard normal without a gross error."""
        return self.left_out / self.sigma

    @property
    def detectable(self) -> np.ndarray:
        """Least error (k, 3) that w finds in 4 of 5 cases. Units: m."""
        factor = -ndtri(SETTINGS.significance / 2) - ndtri(SETTINGS.undetected)
        return factor * self.sigma  # Baarda's usual 4.13

    @property
    def excess(self) -> float:
        """Statistic over critical value."""
        return self.statistic / self.critical

    def document(self) -> dict[str, str | float]:
        """What report.json says of an outlier."""
        return {"name": self.name, "statistic": self.statistic, "critical": self.critical}


def all_tests(
    equations: Equations, posterior: Posterior, visit: Callable | None = None
) -> list[TargetTest]:
    """TargetTest of each target by all others.

    Parameters
    ----------
    equations : Equations
    posterior : Posterior
        Of the parameters, by these equations.
    visit : function of SignalParameters and a Collocation, optional
        Called with each solution of these equations while it is held, for what else it tells.
    """
    tests = []
    targets = len(equations.target_rows)
    for block in Objective.of(equations).blocks:
        whole = len(block.names) == len(equations.names)
        tests += _tests(block, block.target_rows, posterior, targets, visit if whole else None)
    return tests


def single_test(equations: Equations, name: str, posterior: Posterior) -> TargetTest:
    """TargetTest of one target by all others.

    Parameters
    ----------
    equations : Equations
        This target's among them.
    name : str
    posterior : Posterior
        Of the parameters, by the others.
    """
    block = next(block for block in Objective.of(equations).blocks if name in block.names)
    return _tests(block, [name], posterior, len(equations.target_rows))[0]


def _tests(equations, names, posterior, targets, visit=None):
    """TargetTests of some targets, by a Collocation after the other: many would fill the memory."""
    left_out = {name: [] for name in names}
    # targets of several passes first: sparse rows part with the factor that these need for the
    # inverse, which those of one pass need, and the visitor
    largest_first = sorted(names, key=lambda name: -len(equations.target_rows[name]))
    for chosen, weight in reversed(posterior.mixture):  # a visitor may keep the most probable
        solved = equations.solve(chosen)
        for name in largest_first:
            left_out[name].append((weight, *solved.leave_out(equations.target_rows[name])))
        if visit is not None:
            visit(chosen, solved)
        del solved  # before the next one takes as much
    return [_test(equations, name, parts[::-1], targets) for name, parts in left_out.items()]


def _test(equations, name, left_out, targets):
    """TargetTest by the left-out misclosure, averaged over the parameters.

    What the parameters leave open is a part of its covariance, so that neither a mode that is too
    sure of itself decides nor one that the target itself has raised.
    """
    rows = equations.target_rows[name]
    critical = float(chdtri(len(rows), SETTINGS.significance / targets))
    mean = 0.0
    square = 0.0
    for weight, residual, covariance in left_out:
        mean = mean + weight * residual
        square = square + weight * (covariance + np.outer(residual, residual))
    covariance = square - np.outer(mean, mean)
    redundancy = np.diag(equations.noise.block(rows) @ np.linalg.inv(covariance))
    statistic = float(mean @ np.linalg.solve(covariance, mean))
    parts = (mean, np.sqrt(np.diag(covariance)), redundancy)
    return TargetTest(name, statistic, critical, *(part.reshape(-1, 3) for part in parts))


def gross_evidence(solved: Collocation, rows_of: dict) -> dict:
    """Log Bayes factor of an error, the same in all of some rows' epochs, against none, by name.

    With b = E^T V^-1 (l - A x) and M = E^T V^-1 E of what the rows see of three axes, E, an error
    of sigma s has the log factor (s^2 b^T (I + s^2 M)^-1 b - log det(I + s^2 M)) / 2, along the
    eigenvectors of M; averaged over the sizes that gross errors have.

    Parameters
    ----------
    solved : Collocation
    rows_of : dict
        Rows of three each by name.
    """
    score = [solved.weights[rows].reshape(-1, 3).sum(axis=0) for rows in rows_of.values()]
    blocks = [
        solved.precision_of(rows).reshape(-1, 3, len(rows) // 3, 3) for rows in rows_of.values()
    ]
    values, vectors = np.linalg.eigh([block.sum(axis=(0, 2)) for block in blocks])
    along = np.einsum("nij,ni->nj", vectors, score) ** 2
    variance = np.square(SETTINGS.gross_sizes)[:, None, None]
    more = 1.0 + variance * np.maximum(values, 0.0)
    density = 0.5 * np.sum(variance * along / more - np.log(more), axis=2)
    gains = np.logaddexp.reduce(density, axis=0) - np.log(len(SETTINGS.gross_sizes))
    return dict(zip(rows_of, gains.tolist(), strict=True))
