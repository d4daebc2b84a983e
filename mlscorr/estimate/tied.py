"""Ties beside control points: which of them hold, and the parameters that both choose.

Of a thousand ties some are wrong: a car has gone, a row of windows was taken for the next. Robust
weights come before parameters, since a likelihood that believes all ties prefers noise to drift:
graduated ones under what control chose or what is believed (Geman-McClure, whose scale shrinks:
Black and Rangarajan 1996), then Student's t in turn with the restricted likelihood, at last a cut.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from mlscorr.collocation import INTEGRATED, Collocation, reweight
from mlscorr.correction import Correction, increments_by_scanner
from mlscorr.estimate._prediction import GridPredictions
from mlscorr.estimate._tie_equations import TieEquations
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.outages import with_likely_starts
from mlscorr.estimate.posterior import Objective, Posterior, choose_parameters
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters
from mlscorr.estimate.target_tests import Screening, all_tests, may_go
from mlscorr.survey import Statement, Ties

MEDIAN = float(ndtri(0.75))  # of the absolute value of a standard normal variable


@dataclass(frozen=True)
class TieResiduals:
    """What a correction leaves of n ties.

    Parameters
    ----------
    ties : Ties
    used : (n,) bool array
        Those that hold.
    after : (n,) array
        Misclosures that remain. Units: m.
    """

    ties: Ties
    used: np.ndarray
    after: np.ndarray

    @classmethod
    def of(
        cls, ties: Ties, used: np.ndarray, correction: Correction | Sequence[Correction]
    ) -> TieResiduals:
        """The residuals of ties after a correction.

        Parameters
        ----------
        ties : Ties
        used : (n,) bool array
        correction : Correction, or sequence of Correction
            Of all scanners, or of each.
        """
        if isinstance(correction, Correction):
            correction = [correction] * (1 + ties.scanner.max(initial=0))
        moved = increments_by_scanner(correction, ties.place, ties.gps_time, ties.scanner)
        change = np.einsum("ni,ni->n", ties.direction, moved[:, 0] - moved[:, 1])
        return cls(ties, used, ties.misclosure - change)

    def of_scanner(self, number: int) -> TieResiduals | None:
        """The residuals of what a scanner saw, by itself or with another; None without any.

        Parameters
        ----------
        number : int
            From 0.
        """
        rows = (self.ties.scanner == number).any(axis=1)
        residuals = TieResiduals(self.ties[rows], self.used[rows], self.after[rows])
        if rows.any():
            return residuals
        return None

    @property
    def statements(self) -> tuple[Statement, ...]:
        """A warning where no tie was used."""
        if self.used.any():
            return ()
        return (Statement("no tie used", "warning", {"ties": len(self.ties)}),)


@dataclass(frozen=True)
class Tied:
    """An estimate's equations with the ties that hold.

    Parameters
    ----------
    equations : Equations
    posterior : Posterior
        Of the parameters, by both.
    used : (n,) bool array
        Which of the ties hold.
    """

    equations: Equations
    posterior: Posterior
    used: np.ndarray


def add_ties(equations: Equations, parameters: SignalParameters, ties: TieEquations) -> Tied:
    """The equations with the ties that hold, and the parameters that both choose.

    Parameters
    ----------
    equations : Equations
        Of the control points.
    parameters : SignalParameters
        That these chose.
    ties : TieEquations
    """
    weighed = robust_ties(equations, parameters, ties)
    tied = weighed.equations
    parameters = weighed.parameters
    tied = tied.with_starts(with_likely_starts(sample(tied))[0].stated.starts)
    rows = tied.ties
    objective = Objective.of(sample(tied))
    at, _ = objective.maximum(parameters.family, objective.logarithms(parameters))
    parameters = objective.parameters(parameters.family, at)  # the weights of the ties stay
    weighed = solved_ties(tied, parameters).graded((student,))
    tied = weighed.equations
    ratio = np.abs(weighed.ratio)
    factor = float(np.clip(np.median(ratio) / MEDIAN, 1.0, SETTINGS.tie_cut))
    used = ratio <= SETTINGS.tie_cut * factor
    kept = replace(rows, variance=factor**2 * rows.variance, weight=np.ones(len(rows)))
    tied = replace(tied, ties=kept.select(used))
    return Tied(tied, choose_parameters(sample(tied), (parameters,), SETTINGS.tie_points), used)


def screen_with_ties(
    equations: Equations, screening: Screening, ties: TieEquations
) -> tuple[GridPredictions, Screening, np.ndarray]:
    """Equations with ties and what they predict, what both say of control, which ties hold (n,).

    A control point that few others could test is tested again, now that ties hold the drive.

    Parameters
    ----------
    equations : Equations
        Of the control points that the others don't contradict.
    screening : Screening
        Of these.
    ties : TieEquations
    """
    parameters = screening.posterior.modes[0][0]
    kept = equations
    rejected = []
    untied = GridPredictions(equations), screening, np.zeros(len(ties), dtype=bool)
    while True:
        tied = add_ties(kept, parameters, ties)
        if tied.used.mean() < SETTINGS.tie_majority:
            return untied
        predictions = GridPredictions(tied.equations, mode=tied.posterior.modes[0][0])
        tests = all_tests(tied.equations, tied.posterior, predictions.add)
        doubtful = sorted((t for t in tests if t.excess > 1.0), key=lambda t: -t.excess)
        if not doubtful or not may_go(equations, {t.name for t in (*rejected, doubtful[0])}):
            break
        rejected.append(doubtful[0])
        kept = kept.without({doubtful[0].name})
    if rejected and doubtful:  # points that agree with each other aren't wrong in such numbers
        return untied
    changed = replace(
        screening,
        posterior=tied.posterior,
        tests=tuple(tests),
        outliers=(*screening.outliers, *rejected),
        warnings=(
            *screening.warnings,
            *(_contradiction(test, is_used=False) for test in rejected),
            *(_contradiction(test, is_used=True) for test in doubtful),
        ),
    )
    return predictions, changed, tied.used


def _contradiction(test, is_used):
    """A Statement on a control point that ties and the other points contradict."""
    worst = test.left_out[np.linalg.norm(test.left_out, axis=1).argmax()]
    values = {**test.document(), "misclosure": tuple(worst.tolist()), "is_used": is_used}
    return Statement("contradicts ties", "warning", values)


def sample(tied: Equations) -> Equations:
    """The equations with as many of the ties as are needed to choose parameters.

    Three for each two of the believed intervals that any view falls into: then each has a view
    along every axis. Fewer tell nothing of times as short, which stay as they are believed; more
    cost the cube of their number, and tell what neighbours share rather than how the drift goes.

    Parameters
    ----------
    tied : Equations
        With ties.
    """
    since = tied.ties.gps_time - tied.ties.gps_time.min(initial=np.inf)
    intervals = len(np.unique(np.floor(since / tied.interval)))
    number = min(3 * intervals // 2, SETTINGS.dense_rows - tied.misclosure.size)
    step = -(-len(tied.ties) // max(number, SETTINGS.tie_sample))
    return replace(tied, ties=tied.ties.select(slice(None, None, step)))


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
    held = _held(weighed)
    if held == len(ties):
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
