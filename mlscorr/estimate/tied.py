"""Ties in addition to control points: acceptance of ties, and the parameters estimated from both.

Of a thousand ties some are wrong: a car has left, a row of windows was confused with the next.
Robust weights precede parameters, because a likelihood that trusts all ties prefers noise to drift:
graduated ones under the parameters from control or the prior (Geman-McClure with shrinking scale:
Black and Rangarajan 1996), then Student's t alternating with the restricted likelihood, finally a
cut.
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
    """Residuals of n ties after a correction.

    Parameters
    ----------
    ties : Ties
    used : (n,) bool array
        Mask of accepted ties.
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
        """Return the residuals of ties that involve a scanner; None without any.

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
        """A warning if no tie was used."""
        if self.used.any():
            return ()
        return (Statement("no tie used", "warning", {"ties": len(self.ties)}),)


@dataclass(frozen=True)
class Tied:
    """An estimate's equations with the accepted ties.

    Parameters
    ----------
    adjustment : Adjustment
    posterior : Posterior
        Of the parameters, by both.
    used : (n,) bool array
        Mask of accepted ties.
    """

    adjustment: Adjustment
    posterior: Posterior
    used: np.ndarray


def add_ties(tied: Adjustment, parameters: SignalParameters) -> Tied:
    """Return the ties accepted besides the control points, and the parameters by both.

    Parameters
    ----------
    tied : Adjustment
        With all ties.
    parameters : SignalParameters
        Parameters chosen by the control points.
    """
    weighed = robust_ties(tied, parameters)
    tied = weighed.adjustment
    parameters = weighed.parameters
    tied = tied.with_starts(with_likely_starts(sample(tied))[0].errors.starts)
    objective = Objective.of(sample(tied))
    at, _ = objective.maximum(parameters.family, objective.logarithms(parameters))
    parameters = objective.parameters(parameters.family, at)  # the weights of the ties are kept
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
    """Return predictions by equations with ties, tests of control, and the mask of used ties.

    A control point that few others could test is tested again with the support of ties.

    Parameters
    ----------
    adjustment : Adjustment
        Of the accepted control points, with all ties.
    screening : Screening
        Of these points.
    kept_in : collection of str
        Names of control points that are never rejected.
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
    """Return the equations with as many of the ties as are needed to choose parameters.

    Three for each two of the prior correlation intervals with any view: then each has a view along
    every axis. Fewer are not informative about times as short, which keep their prior values; more
    cost the cube of their number, and show errors common to neighbors rather than the drift.

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
        Weights of the first solution, to which others are relative.
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
        """Return the ties with weights by each function of the residuals in turn.

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
    """Graduated weights of ties, under the parameters that accept more of them.

    Few control points may choose drift that is too slow or too small; then ties that agree with
    each other contradict it. So they are also weighted under the prior without control.

    Parameters
    ----------
    tied : Adjustment
        With ties.
    parameters : SignalParameters
        Parameters chosen by the control points.
    """
    weighed = graduated(tied, parameters)
    accepted = _accepted_ties(weighed)
    if accepted == len(weighed.ties):
        return weighed
    prior = Objective((), tied.prior(tied))
    other = graduated(tied, prior.parameters(INTEGRATED, prior.initial))
    if _accepted_ties(other) > accepted:
        return other
    return weighed


def _accepted_ties(weighed):
    """Number of accepted ties."""
    least = _geman_mcclure(SETTINGS.tie_cut)(SETTINGS.tie_cut)
    return np.count_nonzero(weighed.weight > least)


def graduated(tied: Adjustment, parameters: SignalParameters) -> WeighedTies:
    """Weights of ties after the scale has shrunk from that of all ties to that of good ones.

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
    """The adjustment with ties, solved without changes.

    Parameters
    ----------
    tied : Adjustment
    parameters : SignalParameters
    """
    assert tied.ties is not None
    return WeighedTies(tied, parameters, tied.solve(parameters), _weight_of(tied.ties))


def _weight_of(ties):
    """Weights (n,) of ties, ones if they have none."""
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
