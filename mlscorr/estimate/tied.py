"""Ties beside control points: which of them hold, and the parameters that both choose.

Of a thousand ties some are wrong: a car has gone, a row of windows was taken for the next. Robust
weights come before parameters, since a likelihood that believes all ties prefers noise to drift:
graduated ones under what control chose or what is believed (Geman-McClure, whose scale shrinks:
Black and Rangarajan 1996), then Student's t in turn with the restricted likelihood, at last a cut.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from mlscorr.collocation import INTEGRATED, Collocation, reweight
from mlscorr.correction import Correction, increments_by_scanner
from mlscorr.estimate._prediction import GridPredictions
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.factors import TIE, Factor
from mlscorr.estimate.outages import with_likely_starts
from mlscorr.estimate.posterior import Objective, Posterior, choose_parameters
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import Screening, all_tests, may_go
from mlscorr.pos import SignalParameters
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
    adjustment : Adjustment
    posterior : Posterior
        Of the parameters, by both.
    used : (n,) bool array
        Which of the ties hold.
    """

    adjustment: Adjustment
    posterior: Posterior
    used: np.ndarray


def add_ties(tied: Adjustment, parameters: SignalParameters) -> Tied:
    """The ties that hold beside the control points, and the parameters that both choose.

    Parameters
    ----------
    tied : Adjustment
        With all ties.
    parameters : SignalParameters
        That the control points chose.
    """
    weighed = robust_ties(tied, parameters)
    tied = weighed.adjustment
    parameters = weighed.parameters
    tied = tied.with_starts(with_likely_starts(sample(tied))[0].errors.starts)
    objective = Objective.of(sample(tied))
    at, _ = objective.maximum(parameters.family, objective.logarithms(parameters))
    parameters = objective.parameters(parameters.family, at)  # the weights of the ties stay
    weighed = solved_ties(tied, parameters).graded((student,))
    tied = weighed.adjustment
    ratio = np.abs(weighed.ratio)
    factor = float(np.clip(np.median(ratio) / MEDIAN, 1.0, SETTINGS.tie_cut))
    used = ratio <= SETTINGS.tie_cut * factor
    tied = tied.with_factor(tied.ties.scaled(factor**2).select(used))
    return Tied(tied, choose_parameters(sample(tied), (parameters,), SETTINGS.tie_points), used)


def screen_with_ties(
    adjustment: Adjustment, screening: Screening, kept_in: Collection[str] = ()
) -> tuple[GridPredictions, Screening, np.ndarray]:
    """Equations with ties and what they predict, what both say of control, which ties hold (n,).

    A control point that few others could test is tested again, now that ties hold the drive.

    Parameters
    ----------
    adjustment : Adjustment
        Of the control points that the others don't contradict, with all ties.
    screening : Screening
        Of these points.
    kept_in : collection of str
        Names of control points that are used whatever the others say of them.
    """
    parameters = screening.posterior.modes[0][0]
    kept = adjustment
    rejected = []
    bare = GridPredictions(adjustment.without_kind(TIE))
    untied = bare, screening, np.zeros(len(adjustment.ties), dtype=bool)
    while True:
        tied = add_ties(kept, parameters)
        if tied.used.mean() < SETTINGS.tie_majority:
            return untied
        predictions = GridPredictions(tied.adjustment, mode=tied.posterior.modes[0][0])
        tests = all_tests(tied.adjustment, tied.posterior, predictions.add)
        free = (t for t in tests if t.name not in kept_in)
        doubtful = sorted((t for t in free if t.excess > 1.0), key=lambda t: -t.excess)
        if not doubtful or not may_go(adjustment, {t.name for t in (*rejected, doubtful[0])}):
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


def sample(tied: Adjustment) -> Adjustment:
    """The equations with as many of the ties as are needed to choose parameters.

    Three for each two of the believed intervals that any view falls into: then each has a view
    along every axis. Fewer tell nothing of times as short, which stay as they are believed; more
    cost the cube of their number, and tell what neighbours share rather than how the drift goes.

    Parameters
    ----------
    tied : Adjustment
        With ties.
    """
    since = tied.ties.gps_time - tied.ties.gps_time.min(initial=np.inf)
    intervals = len(np.unique(np.floor(since / tied.interval)))
    others = sum(f.misclosure.size for f in tied.observing if f.kind != TIE)
    number = min(3 * intervals // 2, SETTINGS.dense_rows - others)
    step = -(-len(tied.ties) // max(number, SETTINGS.tie_sample))
    return tied.with_factor(tied.ties.select(slice(None, None, step)))


@dataclass(frozen=True)
class WeighedTies:
    """Equations with robust weights of ties, solved.

    Parameters
    ----------
    adjustment : Adjustment
        With ties.
    parameters : SignalParameters
    solved : Collocation
        By both.
    first : (n,) array
        Weights with which it was solved first, to which others are relative.
    """

    adjustment: Adjustment
    parameters: SignalParameters
    solved: Collocation
    first: np.ndarray

    @property
    def ties(self) -> Factor:
        """The ties with their weights."""
        ties = self.adjustment.ties
        assert ties is not None
        return ties

    @property
    def weight(self) -> np.ndarray:
        """Weights (n,) of the ties."""
        return _weight_of(self.ties)

    @property
    def ratio(self) -> np.ndarray:
        """Residuals (n,) of the ties over their sigmas."""
        variance = self.ties.variance[:, 0]
        weights = self.solved.weights[self.adjustment.rows_of(TIE)]
        return np.sqrt(variance) / self.weight * weights  # N V^-1 (l - A x), over its sigma

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
            tied = weighed.adjustment.with_factor(replace(weighed.ties, weight=weight))
            relative = [
                weight / self.first if factor.kind == TIE else np.ones(len(factor))
                for factor in tied.observing
            ]
            weighed = replace(weighed, adjustment=tied, solved=reweight(weighed.solved, relative))
        return weighed


def robust_ties(tied: Adjustment, parameters: SignalParameters) -> WeighedTies:
    """Graduated weights of ties, under those parameters by which more hold.

    Few control points may choose drift that is too slow or too small; then ties that agree with
    each other contradict it. So they are also weighed by what is believed without control.

    Parameters
    ----------
    tied : Adjustment
        With ties.
    parameters : SignalParameters
        That the control points chose.
    """
    weighed = graduated(tied, parameters)
    held = _held(weighed)
    if held == len(weighed.ties):
        return weighed
    prior = Objective((), tied.prior(tied))
    other = graduated(tied, prior.parameters(INTEGRATED, prior.initial))
    if _held(other) > held:
        return other
    return weighed


def _held(weighed):
    """Number of ties that hold."""
    least = _geman_mcclure(SETTINGS.tie_cut)(SETTINGS.tie_cut)
    return np.count_nonzero(weighed.weight > least)


def graduated(tied: Adjustment, parameters: SignalParameters) -> WeighedTies:
    """Weights of ties whose scale has shrunk from all to the honest ones.

    Parameters
    ----------
    tied : Adjustment
        With ties.
    parameters : SignalParameters
    """
    weighed = solved_ties(tied, parameters)
    largest = float(np.abs(weighed.ratio).max(initial=0.0))
    steps = max(int(np.ceil(np.log2(max(largest, 1.0) / SETTINGS.tie_cut))), 1)
    scales = SETTINGS.tie_cut * 2.0 ** np.arange(steps)[::-1]
    return weighed.graded(_geman_mcclure(scale) for scale in scales)


def solved_ties(tied: Adjustment, parameters: SignalParameters) -> WeighedTies:
    """The adjustment with ties, solved as it is.

    Parameters
    ----------
    tied : Adjustment
    parameters : SignalParameters
    """
    assert tied.ties is not None
    return WeighedTies(tied, parameters, tied.solve(parameters), _weight_of(tied.ties))


def _weight_of(ties):
    """Weights (n,) of ties, ones where they have none."""
    if ties.weight is None:
        return np.ones(len(ties))
    return ties.weight


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
