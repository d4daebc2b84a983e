"""Whether control points that were refused are wrong, or the POS drifted beside each of them.

A misread point, and a drift that nothing states and that comes and goes between two points, make
the same misclosure. What parts them: a wrong point is wrong in all its passes alike, what was seen
within a second drifted together, and control points are seldom wrong in great numbers.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from mlscorr.estimate._screening import Screening
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.posterior import choose_parameters
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters
from mlscorr.estimate.target_tests import all_tests, gross_evidence
from mlscorr.matching import log_share
from mlscorr.pos import SETTINGS as POS_SETTINGS


def weighed_refusals(
    equations: Equations, plain: Equations, screening: Screening, windows: int
) -> Screening:
    """A Screening that refuses no more targets than are likely to be wrong.

    Parameters
    ----------
    equations : Equations
        Of all targets.
    plain : Equations
        The same before anything was raised in windows.
    screening : Screening
        Of the former.
    windows : int
        Number of the stretches that are known to be drift that nothing states.
    """
    rejected = screening.outliers
    refused = {test.name for test in rejected}
    names = [name for name in equations.target_rows if name in refused]
    odds = drift_odds(equations, names, screening.posterior.modes[0][0], windows)
    if not names or odds <= 0.0:
        return screening
    size = max(np.linalg.norm(test.left_out, axis=1).max() for test in rejected)
    number = f"{len(names)} of {len(equations.target_rows)} control points ({', '.join(names)})"
    if odds < np.log(SETTINGS.strong_evidence):
        sentence = (
            f"{number} were refused as wrong. That the POS drifts for a short time beside each of "
            f"them, and doesn't state it, is {np.exp(odds):.1f} times as probable: then up to "
            f"{size:.2f} m are left there, which no sigma holds. Survey these points again, or "
            "more of them around."
        )
        return replace(screening, warnings=(*screening.warnings, sentence))
    sentence = (
        f"{number} deviate from their neighbours, by up to {size:.2f} m, each in its own way. So "
        "many are seldom wrong: they were used, as the POS drifts there for a short time and "
        "doesn't state it. What it drifts between control points is left: more points would tell."
    )
    posterior = choose_parameters(plain)
    return Screening(posterior, (), tuple(all_tests(plain, posterior)), (sentence,))


def drift_odds(
    equations: Equations, names: Collection[str], parameters: SignalParameters, windows: int
) -> float:
    """Log odds of drift beside each of some targets against a gross error of each.

    Before the data are seen both are as probable; a share of gross_share of the targets is wrong,
    known by its mean alone, and any share of the observations sees drift that nothing states.

    Parameters
    ----------
    equations : Equations
        Of all targets.
    names : collection of str
        Of those that were refused.
    parameters : SignalParameters
        That the others chose.
    windows : int
        Number of the stretches that are known to be such drift.
    """
    odds = 0.0
    drifts = windows
    for name in names:
        others = equations.without(set(names) - {name})
        solved = others.solve(parameters)
        passes = np.flatnonzero(others.names == name).tolist()
        misread = gross_evidence(solved, {name: others.target_rows[name]})[name]
        mistaken = _positive(solved, {number: _rows([number]) for number in passes})
        drift = _positive(solved, {number: _rows(_beside(others, number)) for number in passes})
        odds += sum(drift) - max(misread, sum(mistaken))
        drifts += len(drift)
    if windows:  # with none the POS may as well never drift so
        odds -= log_share(windows, len(equations.names), 0.5)
    odds += log_share(drifts, len(equations.names), 0.5)
    return odds - log_share(len(names), len(equations.target_rows), SETTINGS.gross_share)


def _positive(solved, rows_of):
    """The evidence of those errors that are more probable than none."""
    return [gain for gain in gross_evidence(solved, rows_of).values() if gain > 0.0]


def _beside(equations, number):
    """Numbers of all observations within a second of one."""
    times = equations.observed
    return np.flatnonzero(np.abs(times - times[number]) <= POS_SETTINGS.sigma_interval)


def _rows(numbers):
    return (3 * np.array(numbers)[:, None] + np.arange(3)).ravel()
