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
    trend_variance : (p,) array
        Of the trend beside them.
    statistic, critical : float
        Chi-squared of k degrees of freedom, and its critical value.
    """

    correction: np.ndarray
    covariance: np.ndarray
    response: np.ndarray
    trend_variance: np.ndarray
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
        response = solved.trend_covariance @ trend.T @ added  # Eq. 13 of each column
        weights = solved.solver.solve(columns - solved.design @ response)  # P M
        covariance = np.linalg.inv(columns.T @ weights + np.diag(prior_sigma**-2.0))
        right = weights.T @ solved.misclosure
        correction = covariance @ right
        critical = float(chdtri(len(correction), SETTINGS.significance))
        beside = np.diag(solved.trend_covariance + response @ covariance @ response.T)
        return cls(correction, covariance, response, beside, float(right @ correction), critical)

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


def with_added(equations: Equations, added: np.ndarray) -> Equations:
    """The same equations with something added to their misclosures.

    Parameters
    ----------
    equations : Equations
    added : (3 (n + h) + m,) array
        To those of epochs, then of ties. Units: m.
    """
    epochs, of_ties = np.split(added, [equations.misclosure.size])
    ties = equations.ties
    return replace(
        equations,
        misclosure=equations.misclosure + epochs.reshape(-1, 3),
        ties=None if ties is None else replace(ties, misclosure=ties.misclosure + of_ties),
    )
