"""Ties between the passes of a drive: pairing and correction within narrowing gates."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mlscorr.estimate import Estimate, previewed_correction, with_ties
from mlscorr.survey import Statement, Survey, TieFeatures, Ties, time_spans
from mlscorr.ties.agreement import (
    narrowest_gate,
    placed_sigma,
    unconstrained_directions,
    unconstrained_sentence,
    widest_gate,
)
from mlscorr.ties.coarse import coarse_correction
from mlscorr.ties.pairing import pair_features
from mlscorr.ties.search import agreeing_ties, least_pause
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import thinned_ties


def tie_passes(survey: Survey, estimate: Estimate, features: TieFeatures) -> Estimate:
    """Return the estimate with the ties of a survey, or with the reason if there are none.

    The first gate follows from the sigmas of the estimate. After each correction, the gate becomes
    the geometric mean of itself and the scatter of the residuals, at most half of itself, down to
    that scatter. If an iteration hardly reduces the residuals, the gate drops to the scatter at
    once.

    Parameters
    ----------
    survey : Survey
        The search radius is the limit.
    estimate : Estimate
        From control points only.
    features : TieFeatures
    """
    mountings = ()  # unknown mountings: those of several scanners, which ties determine
    if survey.scanners and None not in survey.mountings:
        mountings = survey.mountings
    sigma = placed_sigma(estimate.correction, survey, features)
    radius = min(max(widest_gate(sigma), SETTINGS.least_gate), survey.search_radius)
    moved = estimate.correction.increments(features.centre, features.gps_time)[0]
    moved += coarse_correction(replace(features, centre=features.centre + moved), radius)
    pause = SETTINGS.pause
    least = least_pause(survey, features)
    limit = 0.0
    while True:
        pairs = pair_features(features, moved, sigma, radius, pause=pause)
        if not mountings:  # two scanners give information on their mountings, not on the drift
            pairs = pairs[pairs.scanner[:, 0] == pairs.scanner[:, 1]]
        ties = agreeing_ties(pairs, moved)
        if len(ties) == 0 and not estimate.untied:
            estimate = _untied(estimate, features, radius)
        is_last = len(ties) == 0 or radius <= limit
        if is_last and least < pause:
            # visits come first: with meters between them, they had no tie within the gates of a
            # single one
            pause = least
            mountings = (survey.assumed_mounting,)
            continue
        if len(ties) == 0:
            return estimate
        if is_last:
            unconstrained = _unconstrained(estimate, features, ties)
            noted = replace(estimate, notes=(*estimate.notes, *unconstrained))
            return with_ties(noted, ties, mountings, survey.included)

        half = thinned_ties(ties, SETTINGS.ties // 2)  # also shows how near partners are
        correction = previewed_correction(estimate, half, mountings)
        moved = correction.increments(features.centre, features.gps_time)[0]
        before = limit
        limit = narrowest_gate(ties, moved)
        is_settled = 0.0 < before < 1.1 * limit
        if is_settled:
            radius = limit
        else:
            radius = max(min(radius / 2, np.sqrt(radius * limit)), limit)


def _untied(estimate: Estimate, features: TieFeatures, radius: float) -> Estimate:
    """Return the estimate with the reason why nothing is tied, a warning if ties were expected."""
    cells = np.floor(features.centre / radius)
    cell = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    first, last = time_spans(cell, features.gps_time)
    near = int(np.count_nonzero((last - first)[cell] > SETTINGS.pause))  # at two visits
    what = (
        f"{near} of {len(features)} planes, poles and markings are within about {radius:.1f} m "
        "of points scanned at another time"
    )
    if near < SETTINGS.neighbours:
        reason = (
            f"Passes hardly overlap: {what}. A second pass, preferably in the opposite "
            "direction, extends the effect of control points to where there are none."
        )
        return replace(estimate, untied=reason)
    reason = (
        f"No overlapping features agree: {what}, but none is parallel and near enough. The POS "
        "may be less accurate than it states (increase its sigmas, or search_radius under "
        "[matching]), or the mounting wrong by degrees (run mlscorr calibrate)."
    )
    return replace(estimate, untied=reason, notes=(*estimate.notes, _noted(reason)))


def _noted(sentence):
    return Statement("on ties", "warning", {"sentence": sentence})


def _unconstrained(estimate: Estimate, features: TieFeatures, ties: Ties) -> Iterator[Statement]:
    """Yield statements on passes with a direction that neither ties nor common control
    constrain.
    """
    control = estimate.adjustment.observed
    first, last = time_spans(features.pass_number, features.gps_time)

    for part, axis in unconstrained_directions(ties):
        if np.median(np.diff(part.gps_time)) < SETTINGS.pause:  # of one pass: the POS constrains it
            continue
        spans = zip(first[part.pass_number[0]], last[part.pass_number[0]], strict=True)
        if not all(((control >= begin) & (control <= end)).any() for begin, end in spans):
            yield _noted(unconstrained_sentence(part, axis))
