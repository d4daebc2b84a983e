"""Whether further unknowns explain what trend and signals leave (Baarda's alternative hypothesis).

They stand beside the others as more columns M of A; with P = V^-1 - V^-1 A (A'V^-1 A)^-1 A'V^-1,
which the solver applies to any misclosures, they are (M'PM)^-1 M'Pl (Mao et al. 2015, Eq. 13-18).
Nothing in the estimate changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from mlscorr.estimate.equations import Equations
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters


@dataclass(frozen=True)
class AddedUnknowns:
    """What k further unknowns are, and whether that is chance.

    Parameters
    ----------
    correction : (k,) array
    covariance : (k, k) array
    response : (p, k) array
        Of the trend: by how much a unit of each would change it, where it is left out.
    statistic, critical : float
        Chi-squared of k degrees of freedom, and its critical value.
    """

    correction: np.ndarray
    covariance: np.ndarray
    response: np.ndarray
    statistic: float
    critical: float

    @classmethod
    def of(
        cls,
        equations: Equations,
        parameters: SignalParameters,
        columns: np.ndarray,
        prior_sigma: np.ndarray,
    ) -> AddedUnknowns:
        """Estimate the unknowns.

        Parameters
        ----------
        equations : Equations
            Of n + h epochs and m ties, or none.
        parameters : SignalParameters
        columns : (3 (n + h) + m, k) array
            Partial derivatives of the misclosures by the unknowns.
        prior_sigma : (k,) array
            One sigma of what is known of them without the survey.
        """
        solved = equations.solve(parameters)
        white = solved.solver.whiten(np.column_stack([solved.design, columns]))
        trend, added = np.split(white, [solved.design.shape[1]], axis=1)
        response = np.linalg.lstsq(trend, added, rcond=None)[0]  # Eq. 13 of each column
        weights = solved.solver.solve(columns - solved.design @ response)  # P M
        covariance = np.linalg.inv(columns.T @ weights + np.diag(prior_sigma**-2.0))
        right = weights.T @ misclosures_of(equations)
        correction = covariance @ right
        critical = float(chdtri(len(correction), SETTINGS.significance))
        return cls(correction, covariance, response, float(right @ correction), critical)

    @property
    def sigma(self) -> np.ndarray:
        """One sigma (k,) of the correction."""
        return np.sqrt(np.diag(self.covariance))

    def is_wrong(self, least: np.ndarray) -> np.ndarray:
        """Which unknowns (k,) are significant, and large enough to matter.

        Parameters
        ----------
        least : (k,) array
            Below it none matters.
        """
        size = np.abs(self.correction)
        is_large = size > np.maximum(SETTINGS.setup_sigmas * self.sigma, least)
        return is_large & (self.statistic > self.critical)


def misclosures_of(equations: Equations) -> np.ndarray:
    """All misclosures (3 (n + h) + m,) of equations: of epochs, then of ties. Units: m.

    Parameters
    ----------
    equations : Equations
    """
    of_ties = [] if equations.ties is None else equations.ties.misclosure
    return np.append(equations.misclosure.ravel(), of_ties)


def with_misclosures(equations: Equations, misclosure: np.ndarray) -> Equations:
    """The same equations with other misclosures.

    Parameters
    ----------
    equations : Equations
    misclosure : (3 (n + h) + m,) array
        Units: m.
    """
    number, ties = equations.misclosure.size, equations.ties
    return replace(
        equations,
        misclosure=misclosure[:number].reshape(-1, 3),
        ties=None if ties is None else replace(ties, misclosure=misclosure[number:]),
    )
