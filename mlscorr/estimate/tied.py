"""Ties beside control points: which of them hold, and the parameters that both choose.

Of a thousand ties some are wrong: a car has gone, a row of windows was taken for the next. Robust
weights come before parameters, since a likelihood that believes all ties prefers noise to drift:
graduated ones under what control chose or what is believed (Geman-McClure, whose scale shrinks:
Black and Rangarajan 1996), then Student's t in turn with the restricted likelihood, at last a cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from mlscorr.correction import Correction, increments_by_scanner
from mlscorr.estimate._prediction import GridPredictions
from mlscorr.estimate._screening import Screening, may_go
from mlscorr.estimate._tie_equations import TieEquations
from mlscorr.estimate._tie_weights import robust_ties, solved_ties, student
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.outages import with_likely_starts
from mlscorr.estimate.posterior import Objective, Posterior, choose_parameters
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters
from mlscorr.estimate.target_tests import all_tests
from mlscorr.survey import Ties

WRONG_BUT_USED = "It is used, as too few are left to tell which point is wrong"
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
    def warnings(self) -> tuple[str, ...]:
        """A sentence where no tie was used."""
        if self.used.any():
            return ()
        return (
            f"None of the {len(self.ties)} ties between passes was used: more than half of them "
            "contradict the others, or all of them several control points. Did the street change "
            "between the passes, is the mounting wrong (mlscorr calibrate), or does the scanner's "
            "own encoder turn by another scale (milliradians per radian)?",
        )


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
            *(_contradiction(test, "It takes no part") for test in rejected),
            *(_contradiction(test, WRONG_BUT_USED) for test in doubtful),
        ),
    )
    return predictions, changed, tied.used


def _contradiction(test, what):
    """A sentence on a control point that ties and the other points contradict."""
    worst = test.left_out[np.linalg.norm(test.left_out, axis=1).argmax()]
    off = "/".join(f"{value:.3f}" for value in worst)
    return (
        f"Control point {test.name} contradicts what ties carry to it from the other control "
        f"points: it is {off} m (E/N/H) off that, statistic {test.statistic:.1f} against "
        f"{test.critical:.1f}. {what}: survey it again, or see by --no-ties whether ties are wrong."
    )


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
