"""Onset of drift, and classification of steps of the path as re-acquisitions.

The error of a filtered POS is small until GNSS is lost, and small again after its re-acquisition.
The recorded path shows re-acquisitions but not the starts of drift, so each segment's start is
sought between its control epochs by likelihood. A step that contradicts the control points is no
re-acquisition, only a restart.
"""

import numpy as np
from scipy.special import chdtri

from mlscorr.collocation import INTEGRATED
from mlscorr.estimate.adjustment import Adjustment, with_reacquisitions
from mlscorr.estimate.factors import REACQUISITION, TIE
from mlscorr.estimate.posterior import Objective
from mlscorr.estimate.settings import SETTINGS
from mlscorr.pos import SETTINGS as POS_SETTINGS
from mlscorr.pos import SignalParameters


def with_drift_history(adjustment: Adjustment) -> Adjustment:
    """Return the equations with re-acquisitions, and the most likely start of each drift.

    Parameters
    ----------
    adjustment : Adjustment
        Of control points alone.
    """
    adjustment = with_reacquisitions(adjustment, adjustment.errors.history.steps)
    while True:
        complete, parameters = with_likely_starts(adjustment)
        contradicted = _contradicted(complete, parameters)
        if contradicted is None:
            return complete
        steps = adjustment.of_kind(REACQUISITION)
        others = np.arange(len(steps)) != contradicted
        adjustment = adjustment.with_some(REACQUISITION, others)


def with_likely_starts(adjustment: Adjustment) -> tuple[Adjustment, SignalParameters]:
    """Return the equations with the most likely starts, and the corresponding parameters.

    Parameters
    ----------
    adjustment : Adjustment
        Of control points, and of some ties, whose epochs separate starts between the points.
    """
    history = adjustment.errors.history
    edges = history.edges
    stated = adjustment.errors.starts
    ends_by_step = np.isin(edges[1:], history.steps.middle)
    begins_pass = np.isin(edges[:-1], history.trajectory.passes[:, 0])
    segments = list(zip(edges[:-1], edges[1:], begins_pass, ends_by_step, strict=True))
    if adjustment.ties is None:
        tied = ()
    else:
        tied = adjustment.ties.gps_time.ravel()
    times = np.append(adjustment.observed, tied)
    objective = Objective.of(adjustment)
    mode, _ = objective.maximum(INTEGRATED, objective.initial)
    starts = stated
    for _ in range(SETTINGS.rounds):
        before = starts
        for number, segment in enumerate(segments):
            if not (segment[-1] or np.any((times > segment[0]) & (times < segment[1]))):
                continue  # no observation there separates starts
            part = _about(adjustment, *segment[:2])
            candidates = np.append(starts[number], _candidates(times, *segment))
            scores = []
            for candidate in candidates:
                tried = np.where(np.arange(len(starts)) == number, candidate, starts)
                scores.append(Objective.of(part.with_starts(tried))(INTEGRATED, mode))
            # The stated start is kept unless control makes another one as likely as all together
            scores += np.log(len(scores)) * (candidates == stated[number])
            likeliest = candidates[np.argmax(scores)]
            starts = np.where(np.arange(len(starts)) == number, likeliest, starts)
        if np.array_equal(before, starts):
            break
        objective = Objective.of(adjustment.with_starts(starts))
        mode, _ = objective.maximum(INTEGRATED, mode)
    return adjustment.with_starts(starts), objective.parameters(INTEGRATED, mode)


def _about(adjustment, first, last):
    """The equations; of large surveys, those of targets and ties that a segment affects."""
    ties = adjustment.ties
    if ties is not None and len(ties) > SETTINGS.tie_sample:
        inside = ((ties.gps_time >= first) & (ties.gps_time <= last)).any(axis=1)
        adjustment = adjustment.with_some(TIE, inside)
    if len(adjustment.names) <= SETTINGS.block:
        return adjustment
    times = adjustment.observed
    inside = np.abs(times - (first + last) / 2) <= (last - first) / 2 + POS_SETTINGS.outage
    inside |= np.isin(np.arange(len(times)), np.argsort(np.abs(times - last))[: SETTINGS.block])
    return adjustment.select(inside).without_outer_steps()


def _candidates(times, first, last, begins_pass, ends_by_step):
    """Starts that control epochs can separate: the segment's own, halfway between them, never.

    Another one is before the pass, which may have begun without GNSS.
    """
    inside = np.sort(times[(times > first) & (times < last)])
    inside = inside[:: max(1, len(inside) // SETTINGS.start_epochs)]
    edges = np.concatenate([[first], inside, [last]])
    before = [first - POS_SETTINGS.outage] * bool(begins_pass)
    endless = [np.inf] * (not ends_by_step)
    return np.concatenate([[first], before, (edges[1:] + edges[:-1]) / 2, endless])


def _contradicted(adjustment, parameters):
    """Number of the step that contradicts the other observations most, or None."""
    steps = adjustment.rows_of(REACQUISITION).reshape(-1, 3)
    if len(steps) == 0:
        return None
    solved = adjustment.solve(parameters)
    critical = chdtri(3, SETTINGS.significance / len(steps))
    statistics = []
    for rows in steps:
        residual, covariance = solved.leave_out(rows)
        statistics.append(float(residual @ np.linalg.solve(covariance, residual)))
    worst = int(np.argmax(statistics))
    if statistics[worst] > critical:
        return worst
    return None
