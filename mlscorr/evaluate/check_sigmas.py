"""Test of the stated sigmas by independent check points.

The test of the variance of unit weight (Ghilani 2017, Adjustment Computations, chapter 4).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from mlscorr.evaluate._settings import SETTINGS


@dataclass(frozen=True)
class CheckSigmas:
    """Residuals of check points over their stated sigmas, and their test.

    Parameters
    ----------
    z : (n, 3) array
        Residuals in E, N, H over one sigma of target, survey and correction together.
    points : int
        Number of different check points.

    >>> sigmas = CheckSigmas.of(np.full((8, 3), 0.011), np.full((8, 3), 0.01), 8)
    >>> round(sigmas.statistic, 1), np.round(sigmas.limits, 1).tolist(), sigmas.verdict
    (29.0, [12.4, 39.4], 'hold')
    """

    z: np.ndarray
    points: int

    @classmethod
    def of(cls, residuals: np.ndarray, sigma: np.ndarray, points: int) -> "CheckSigmas":
        """Make the test from residuals (n, 3) and their sigmas (n, 3), in m.

        Parameters
        ----------
        residuals, sigma : (n, 3) array
            Units: m.
        points : int
        """
        return cls(np.asarray(residuals, float) / sigma, points)

    @property
    def statistic(self) -> float:
        """Sum of squares of z, chi-squared distributed if the sigmas are correct."""
        return float((self.z**2).sum())

    @property
    def degrees_of_freedom(self) -> int:
        """Number of residuals: three for each observation."""
        return self.z.size

    @property
    def limits(self) -> tuple[float, float]:
        """Two-sided limits of the statistic at the level ``significance``."""
        tail = SETTINGS.check_significance / 2
        freedom = self.degrees_of_freedom
        return float(chdtri(freedom, 1 - tail)), float(chdtri(freedom, tail))

    @property
    def verdict(self) -> str:
        """Result of the test: ``hold``, ``too small`` or ``too large``."""
        low, high = self.limits
        if self.statistic > high:
            return "too small"
        if self.statistic < low:
            return "too large"
        return "hold"

    @property
    def factor(self) -> float:
        """Root mean square of z, the factor by which the sigmas would have to be multiplied."""
        return float(np.sqrt(self.statistic / self.degrees_of_freedom))

    def document(self) -> dict[str, object]:
        """Return the section ``check_sigmas`` of report.json."""
        return {
            "points": self.points,
            "n": len(self.z),
            "z": self.z.tolist(),
            "statistic": self.statistic,
            "degrees_of_freedom": self.degrees_of_freedom,
            "limits": list(self.limits),
            "significance": SETTINGS.check_significance,
            "factor": self.factor,
            "verdict": self.verdict,
        }
