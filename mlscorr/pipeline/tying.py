"""Ties for a correction: paired, corrected, and paired again as the passes come together."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction, PointSigma
from mlscorr.estimate import (
    Estimate,
    believed_correction,
    check_order,
    estimate_correction,
    find_mounting_error,
    mounting_warnings,
    previewed_correction,
    scanner_warnings,
    with_ties,
)
from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline.finding import Finding, find_control, find_or_compare_surfaces, read_into
from mlscorr.survey import Matched, Survey, TieFeatures, Ties, time_spans
from mlscorr.ties import (
    NORMAL_SCATTER,
    SETTINGS,
    TieCollector,
    agreeing_ties,
    coarse_correction,
    least_pause,
    pair_features,
    residuals,
    thinned_ties,
    unheld_directions,
    unheld_sentence,
)

TieUse = Literal["auto", "off", "only"]

NOTHING_TIED = (
    "No two passes of {} saw the same thing, so ties alone correct nothing. Drive the street "
    "twice, or survey control points."
)
LEFT_OUT = (
    'What two passes both saw was left out, as asked: --no-ties, or use = "off" of [ties] in '
    "survey.toml."
)


def estimate_survey(
    survey: Survey,
    order: int,
    ties: TieUse | None = None,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
) -> tuple[Survey, Matched, Matched, Finding, Estimate]:
    """Read a survey's clouds once, and estimate the POS error from all that is in them.

    Parameters
    ----------
    survey : Survey
    order : int
        Of the trend.
    ties : str, optional
        As of ``correct``.
    rng, progress
        As of ``find_targets``.

    Returns
    -------
    survey : Survey
        Without control where ties alone are asked for.
    control, check : Matched
    finding : Finding
    estimate : Estimate

    Raises
    ------
    ValueError
        As ``find_control``, for another use of ties, an order that is none, and where they alone
        are asked for and there is none.
    """
    ties = tie_use(survey, ties)
    check_order(order)
    if ties == "only":
        survey = without_control(survey)
    survey, control, check, finding, features = observe_survey(survey, ties, rng, progress)
    estimate = estimate_together(survey, control, features, order)
    if ties == "only" and estimate.ties is None:
        raise ValueError(f"{NOTHING_TIED.format(survey.path)} {estimate.untied}")
    return survey, control, check, finding, estimate


def tie_use(survey: Survey, ties: TieUse | None) -> TieUse:
    """Use of ties that is asked for; what survey.toml states where nothing is.

    Parameters
    ----------
    survey : Survey
    ties : str or None
        As of ``correct``.

    Raises
    ------
    ValueError
        For another use than there is.
    """
    if ties is None:
        if survey.use_ties:
            return "auto"
        return "off"
    if ties not in get_args(TieUse):
        known = ", ".join(map(repr, get_args(TieUse)))
        raise ValueError(f"ties = {ties!r} is no use of ties: give one of {known}, or None.")
    return ties


def observe_survey(
    survey: Survey,
    ties: TieUse,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
) -> tuple[Survey, Matched, Matched, Finding, TieFeatures | None]:
    """Read a survey's clouds once, for its targets and for the features that may tie its passes.

    Parameters
    ----------
    survey : Survey
    ties : str
        ``only``: no control point is needed.
    rng, progress
        As of ``find_targets``.

    Returns
    -------
    survey : Survey
        Its trajectory knows the seconds in which points lie.
    control, check : Matched
    finding : Finding
    features : TieFeatures or None
        None where ties are off.

    Raises
    ------
    ValueError
        As ``find_control``.
    """
    collector = TieCollector(survey)
    if ties == "off":
        read = read_chunks
    else:
        read = read_into(collector.add)
    if ties == "only":
        finding, _ = find_or_compare_surfaces(survey, read, None, progress)
        control, check = finding.matches.by_role(survey)
    else:
        control, check, finding = find_control(survey, rng, progress, read)
    features = None if ties == "off" else collector.features()
    trajectory = survey.trajectory.scanned_at(finding.candidates.seconds)
    return replace(survey, trajectory=trajectory), control, check, finding, features


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads, other last digits
def estimate_together(
    survey: Survey, control: Matched, features: TieFeatures | None, order: int
) -> Estimate:
    """The POS error by matched control points, and by what two passes both saw.

    Parameters
    ----------
    survey : Survey
    control : Matched
        Without any, ties alone bring passes together where the POS says that they are.
    features : TieFeatures or None
        None where ties are left out.
    order : int
        Of the trend.
    """
    if len(control):
        estimate = estimate_correction(survey.trajectory, control, survey.pos, order)
    else:
        estimate = believed_correction(survey.trajectory, survey.pos)
    if features is None:
        return replace(estimate, untied=LEFT_OUT)
    estimate = tie_passes(survey, estimate, features)
    return _with_mounting_checked(survey, estimate, control)


def _with_mounting_checked(survey, estimate, control):
    """The estimate with a note where its ties tell of a wrong mounting."""
    mountings = survey.mountings
    warned = ()
    if estimate.equations.mounting is not None:
        warned = tuple(scanner_warnings(estimate, list(survey.by_scanner)))
    if not warned and None not in mountings:  # all of them may be wrong alike
        check = find_mounting_error(estimate, control, mountings)
        warned = mounting_warnings(check, len(mountings))
    return replace(estimate, notes=(*estimate.notes, *warned))


def tie_passes(survey: Survey, estimate: Estimate, features: TieFeatures) -> Estimate:
    """The estimate with the ties of a survey; the same with the reason where nothing is tied.

    Pairs are looked for as far apart as the sigmas of the estimate allow; with each correction that
    they make, within the geometric mean of that and of the scatter of what is left of them, half as
    far at most, down to that scatter: at once, where a round left hardly less than that before.

    Parameters
    ----------
    survey : Survey
        Its search radius is the limit.
    estimate : Estimate
        By control points alone.
    features : TieFeatures
    """
    correction = estimate.correction
    sigma = placed_sigma(correction, survey, features)
    radius = min(max(widest_gate(sigma), SETTINGS.least_gate), survey.search_radius)
    limit = 0.0
    moved = _moved(correction, features)
    pause = SETTINGS.pause
    least = least_pause(survey, features)
    if survey.scanners and None not in survey.mountings:
        mountings = survey.mountings
    else:
        mountings = ()
    moved += coarse_correction(replace(features, centre=features.centre + moved), radius)
    while True:
        pairs = pair_features(features, moved, sigma, radius, pause=pause)
        if not mountings:  # two scanners tell of their mountings, not of the drift
            pairs = pairs[pairs.scanner[:, 0] == pairs.scanner[:, 1]]
        ties = agreeing_ties(pairs, moved)
        if len(ties) == 0:
            estimate = _untied(estimate, features, radius)
        if least < pause and (len(ties) == 0 or radius <= limit):
            # visits come first: metres apart, they had no tie within the gates of a single one
            pause = least
            mountings = (survey.assumed_mounting,)
            continue
        if len(ties) == 0:
            return estimate
        if radius <= limit:
            unheld = _unheld(estimate, features, ties)
            return with_ties(replace(estimate, notes=(*estimate.notes, *unheld)), ties, mountings)
        half = thinned_ties(ties, SETTINGS.ties // 2)  # shows as well how near partners are
        moved = _moved(previewed_correction(estimate, half, mountings), features)
        before = limit
        limit = narrowest_gate(ties, moved)
        is_settled = 0.0 < before < 1.1 * limit
        if is_settled:
            radius = limit
        else:
            radius = max(min(radius / 2, np.sqrt(radius * limit)), limit)


def placed_sigma(correction: Correction, survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the places of features along any axis, after a correction. Units: m.

    Parameters
    ----------
    correction : Correction
    survey : Survey
        Its mountings with the covariance of what is open in them.
    features : TieFeatures
    """
    sigma = np.empty(len(features))
    for part, rows in survey.rows_by_scanner(features.scanner):
        of_part = PointSigma.of(correction, part.scanner, part.mounting)
        sigma[rows] = of_part.at(features.centre[rows], features.gps_time[rows]).max(axis=1)
    return sigma


def widest_gate(sigma: np.ndarray) -> float:
    """How far two features may be apart whose places have sigmas (n,). Units: m.

    Parameters
    ----------
    sigma : (n,) array
        Units: m.
    """
    return float(np.sqrt(2) * SETTINGS.gate_sigmas * sigma.max(initial=0.0))


def narrowest_gate(ties: Ties, moved: np.ndarray) -> float:
    """How far features may be apart by the scatter of what a correction leaves of ties. Units: m.

    Parameters
    ----------
    ties : Ties
    moved : (m, 3) array
        What the correction adds to each feature. Units: m.
    """
    scatter = NORMAL_SCATTER * float(np.median(np.abs(residuals(ties, moved))))
    return SETTINGS.gate_sigmas * max(scatter, SETTINGS.best_second)


def without_control(survey: Survey) -> Survey:
    """The survey with all its surveyed points as check points.

    Parameters
    ----------
    survey : Survey
    """
    return replace(survey, control=survey.control[[]], check=survey.surveyed)


def _untied(estimate, features, radius):
    """The estimate with the reason why nothing is tied, a warning where something should be."""
    if estimate.untied:
        return estimate
    near = _revisited(features, radius)
    what = (
        f"{near} of {len(features)} planes, poles and markings lie within about {radius:.1f} m of "
        "what was scanned at another time"
    )
    if near < SETTINGS.neighbours:
        reason = (
            f"Nothing was scanned twice, or hardly: {what}. A second pass, best in the opposite "
            "direction, carries what control points tell to where there are none."
        )
        return replace(estimate, untied=reason)
    reason = (
        f"Nothing that two passes both saw agrees: {what}, yet none is parallel and near enough. "
        "Passes may lie farther apart than the POS states (raise its sigmas, or search_radius of "
        "[matching]), or the mounting be wrong by degrees (mlscorr calibrate)."
    )
    return replace(estimate, untied=reason, notes=(*estimate.notes, reason))


def _revisited(features, radius):
    """Number of features in cells as wide as a radius that were scanned at two visits."""
    cells = np.floor(features.centre / radius)
    cell = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    first, last = time_spans(cell, features.gps_time)
    return int(np.count_nonzero((last - first)[cell] > SETTINGS.pause))


def _unheld(estimate, features, ties):
    """Sentences on passes between which neither ties nor control of both hold a direction."""
    control = estimate.equations.observed
    first, last = time_spans(features.pass_number, features.gps_time)

    for part, axis in unheld_directions(ties):
        if np.median(np.diff(part.gps_time)) < SETTINGS.pause:  # of one pass: the POS holds it
            continue
        spans = zip(first[part.pass_number[0]], last[part.pass_number[0]], strict=True)
        if not all(((control >= begin) & (control <= end)).any() for begin, end in spans):
            yield unheld_sentence(part, axis)


def _moved(correction: Correction, features):
    """What a correction adds (n, 3) to the places of features. Units: m."""
    return correction.increments(features.centre, features.gps_time)[0]
