"""What the other targets say of each."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, ndtri

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
    tests, targets = [], len(equations.target_rows)
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
    for chosen, weight in posterior.mixture:
        solved = equations.solve(chosen)
        for name in largest_first:
            left_out[name].append((weight, *solved.leave_out(equations.target_rows[name])))
        if visit is not None:
            visit(chosen, solved)
        del solved  # before the next one takes as much
    return [_test(equations, name, parts, targets) for name, parts in left_out.items()]


def _test(equations, name, left_out, targets):
    """TargetTest by the left-out misclosure, averaged over the parameters.

    What the parameters leave open is a part of its covariance, so that neither a mode that is too
    sure of itself decides nor one that the target itself has raised.
    """
    rows = equations.target_rows[name]
    critical = float(chdtri(len(rows), SETTINGS.significance / targets))
    mean, square = 0.0, 0.0
    for weight, residual, covariance in left_out:
        mean = mean + weight * residual
        square = square + weight * (covariance + np.outer(residual, residual))
    covariance = square - np.outer(mean, mean)
    redundancy = np.diag(equations.noise.block(rows) @ np.linalg.inv(covariance))
    statistic = float(mean @ np.linalg.solve(covariance, mean))
    parts = (mean, np.sqrt(np.diag(covariance)), redundancy)
    return TargetTest(name, statistic, critical, *(part.reshape(-1, 3) for part in parts))
