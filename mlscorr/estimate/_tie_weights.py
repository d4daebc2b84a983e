"""Robust weights of ties: which of them hold, under parameters that they didn't choose.

Graduated ones first (Geman-McClure, whose scale shrinks: Black and Rangarajan 1996), so that a
thousand ties of which some are wrong find what the others agree on; then Student's t.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import INTEGRATED, Collocation, reweight
from mlscorr.estimate._tie_equations import TieEquations
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.posterior import Objective
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters


@dataclass(frozen=True)
class WeighedTies:
    """Equations with robust weights of ties, solved.

    Parameters
    ----------
    equations : Equations
        With ties.
    parameters : SignalParameters
    solved : Collocation
        By both.
    first : (n,) array
        Weights of the ties when the equations were solved first; others are put beside these.
    """

    equations: Equations
    parameters: SignalParameters
    solved: Collocation
    first: np.ndarray

    @property
    def ties(self) -> TieEquations:
        """The ties with their weights."""
        ties = self.equations.ties
        assert ties is not None
        return ties

    @property
    def ratio(self) -> np.ndarray:
        """Residuals (n,) of the ties over their sigmas."""
        variance = self.ties.variance / self.ties.weight
        residual = variance * self.solved.weights[-len(self.ties) :]  # N V^-1 (l - A x)
        return residual / np.sqrt(self.ties.variance)

    def graded(self, functions: Iterable[Callable]) -> WeighedTies:
        """With weights by each function of the residuals in turn.

        Parameters
        ----------
        functions : iterable of function
            Of residuals over their sigmas (n,).
        """
        weighed = self
        for function in functions:
            weight = np.maximum(function(weighed.ratio), SETTINGS.resolution)
            tied = replace(weighed.equations, ties=replace(weighed.ties, weight=weight))
            both = [np.ones(len(tied.gps_time)), weight / self.first]
            weighed = replace(weighed, equations=tied, solved=reweight(weighed.solved, both))
        return weighed


def robust_ties(
    equations: Equations, parameters: SignalParameters, ties: TieEquations
) -> WeighedTies:
    """The equations with graduated weights of ties, under those parameters by which more hold.

    Few control points may choose drift that is too slow or too small; then ties that agree with
    each other contradict it. So they are also weighed by what is believed without control.

    Parameters
    ----------
    equations : Equations
        Of the control points.
    parameters : SignalParameters
        That these chose.
    ties : TieEquations
    """
    weighed = graduated(equations, parameters, ties)
    if (held := _held(weighed)) == len(ties):
        return weighed
    prior = Objective((), weighed.equations.prior(weighed.equations))
    other = graduated(equations, prior.parameters(INTEGRATED, prior.initial), ties)
    if _held(other) > held:
        return other
    return weighed


def _held(weighed):
    """Number of ties that hold."""
    least = _geman_mcclure(SETTINGS.tie_cut)(SETTINGS.tie_cut)
    return np.count_nonzero(weighed.ties.weight > least)


def graduated(
    equations: Equations, parameters: SignalParameters, ties: TieEquations
) -> WeighedTies:
    """The equations with ties, whose weights' scale has shrunk from all to the honest ones.

    Parameters
    ----------
    equations : Equations
        Without ties.
    parameters : SignalParameters
    ties : TieEquations
    """
    weighed = solved_ties(replace(equations, ties=ties), parameters)
    largest = float(np.abs(weighed.ratio).max(initial=0.0))
    steps = max(int(np.ceil(np.log2(max(largest, 1.0) / SETTINGS.tie_cut))), 1)
    scales = SETTINGS.tie_cut * 2.0 ** np.arange(steps)[::-1]
    return weighed.graded(_geman_mcclure(scale) for scale in scales)


def solved_ties(tied: Equations, parameters: SignalParameters) -> WeighedTies:
    """Equations with ties, solved as they are.

    Parameters
    ----------
    tied : Equations
    parameters : SignalParameters
    """
    assert tied.ties is not None
    return WeighedTies(tied, parameters, tied.solve(parameters), tied.ties.weight)


def _geman_mcclure(scale: float) -> Callable:
    return lambda ratio: (1.0 + (ratio / scale) ** 2) ** -2.0


def student(ratio: np.ndarray) -> np.ndarray:
    """Weights (n,) of Student's t for residuals over their sigmas.

    Parameters
    ----------
    ratio : (n,) array
    """
    freedom = SETTINGS.tie_freedom
    return (freedom + 1.0) / (freedom + ratio**2)
