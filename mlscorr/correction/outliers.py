"""Control points that the others contradict."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

SIGNIFICANCE = 0.001  # Baarda's (1968), but over all targets together: real drift has outliers
LEAST_TARGETS = 5  # four can't tell a wrong one from a POS that is worse than stated


@dataclass(frozen=True)
class Outlier:
    """A target that the others contradict: chi-squared statistic and its critical value."""

    name: str
    statistic: float
    critical: float


def find_outlier(model, parameters, order):
    """The target that the others contradict most, or None where they agree with all.

    The statistic is e^T Q^-1 e of its misclosures e once the others have corrected them, Q their
    covariance. The parameters were chosen with it, so a wrong target hides a part of itself and
    the test errs on the side of keeping. Chosen without it they would condemn good targets too,
    14 of 336 on the real drift of the tests, because an outage's drift is seen by few targets.
    """
    targets = model.target_rows
    if len(targets) < LEAST_TARGETS:
        return None
    solved = model.solve(parameters, order)
    worst, excess = None, 1.0
    for name, rows in targets.items():
        if not solved.determined_without(rows):
            continue
        statistic = _statistic(solved, rows)
        critical = float(chi2.isf(SIGNIFICANCE / len(targets), len(rows)))
        if statistic / critical > excess:
            worst, excess = Outlier(name, statistic, critical), statistic / critical
    return worst


def _statistic(solved, rows):
    residual, covariance = solved.leave_out(rows)
    return float(residual @ np.linalg.solve(covariance, residual))
