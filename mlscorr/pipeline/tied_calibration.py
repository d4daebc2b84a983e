"""Ties for a calibration: paired while the mounting may be wrong by degrees, and paired again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mlscorr.estimate import SETTINGS as LIMITS
from mlscorr.estimate import (
    Calibration,
    believed_mounting,
    calibration_with_ties,
    estimate_mounting,
    previewed_mounting,
    with_scanner_errors,
)
from mlscorr.pipeline.finding import Finding, find_control, find_or_compare_surfaces, read_into
from mlscorr.pipeline.tying import narrowest_gate, placed_sigma, widest_gate
from mlscorr.survey import SAME_EPOCH, Matched, Survey, TieFeatures
from mlscorr.ties import (
    SETTINGS,
    TieCollector,
    agreeing_ties,
    coarse_mounting,
    pair_features,
    remounted,
    turned_directions,
)

NOTHING_CALIBRATES = (
    "{} has nothing to calibrate with: {} control points were found (at least 3 are needed, at "
    "more than one time), and no two passes saw the same planes. A single pass without control "
    "shows everything once, as its mounting puts it. Drive the way back as well, or survey control "
    "points on both sides of the way, near and far."
)


def estimate_site(
    survey: Survey,
    ties: bool,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
) -> tuple[Matched, Matched, Finding, Calibration]:
    """Read a survey's clouds once, and calibrate with all that is in them.

    Parameters
    ----------
    survey : Survey
        With a mounting.
    ties : bool
        Whether what two passes both saw takes part.
    rng, progress
        As of ``find_targets``.

    Returns
    -------
    control, check : Matched
    finding : Finding
    calibration : Calibration

    Raises
    ------
    ValueError
        Where less than 3 control points were found, or all of them at one time, and nothing was
        seen twice or ties are not wanted.
    """
    if not ties:
        control, check, finding = find_control(survey, rng, progress)
        calibration = estimate_mounting(survey.trajectory, survey.mounting, control, survey.pos)
        return control, check, finding, with_scanner_errors(calibration, control)
    collector = TieCollector(survey)
    read = read_into(collector.add)
    finding, notes = find_or_compare_surfaces(survey, read, None, progress, rng)
    control, check = finding.matches.by_role(survey)
    number = len(set(control.name))
    is_enough = number >= LIMITS.smallest_targets and np.ptp(control.gps_time) >= SAME_EPOCH
    estimate = estimate_mounting if is_enough else believed_mounting
    start = estimate(survey.trajectory, survey.mounting, control, survey.pos)
    calibration = tie_mounting(survey, start, control, collector.features())
    if not is_enough and (calibration.ties is None or not calibration.ties.used.any()):
        raise ValueError(" ".join([NOTHING_CALIBRATES.format(survey.path, number), *notes]))
    return control, check, finding, with_scanner_errors(calibration, control)


def tie_mounting(
    survey: Survey, calibration: Calibration, matched: Matched, features: TieFeatures
) -> Calibration:
    """The calibration with the ties of a survey; the same where nothing was seen twice.

    A mounting that puts the planes of all visits on each other is looked for as far from the
    calibrated one as its sigmas allow. Then pairs are made as far apart as the POS allows, and half
    as far with each correction that they give, down to the scatter of what is left of them.

    Parameters
    ----------
    survey : Survey
        Its search radius is the limit.
    calibration : Calibration
        By control points alone, or what is believed of the mounting.
    matched : Matched
        These points.
    features : TieFeatures
    """
    correction, mounting = calibration.correction_with_drift, calibration.lsc.mounting
    sigma = placed_sigma(correction, replace(survey, mounting=mounting), features)
    radius = min(widest_gate(sigma), survey.search_radius)
    recorded, trajectory = calibration.recorded, calibration.trajectory
    moved = remounted(features, trajectory, recorded, mounting)
    known = replace(survey, mounting=replace(mounting, covariance=None))
    sigma = placed_sigma(correction, known, features)
    start = coarse_mounting(moved, trajectory, mounting, sigma, radius)
    correction = replace(correction, corrected_mounting=start)
    sigma = np.hypot(sigma, SETTINGS.roughest)
    radius = min(widest_gate(sigma), survey.search_radius)
    while True:
        moved = correction.increments(features.centre, features.gps_time)[0]
        turned = turned_directions(features, _move(correction))
        pairs = pair_features(features, moved, sigma, radius, turned=turned)
        ties = agreeing_ties(pairs, moved)
        if len(ties) == 0:
            return calibration
        correction = previewed_mounting(calibration, matched, ties)
        moved = correction.increments(features.centre, features.gps_time)[0]
        limit = narrowest_gate(ties, moved)
        if radius <= limit:
            return calibration_with_ties(calibration, matched, ties)
        radius = max(radius / 2, limit)


def _move(correction):
    """What a correction makes of places at times."""
    return lambda place, gps_time: place + correction.increments(place, gps_time)[0]
