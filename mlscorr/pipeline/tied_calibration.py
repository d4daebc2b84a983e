"""Ties for a calibration: paired while mountings may be wrong by degrees, and paired again."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mlscorr.correction import increments_by_scanner
from mlscorr.estimate import (
    Calibration,
    believed_mounting,
    calibration_with_ties,
    control_fault,
    estimate_mounting,
    mounted_corrections,
    previewed_mounting,
    with_scanner_errors,
)
from mlscorr.pipeline.finding import Finding, find_control, find_or_compare_surfaces, read_into
from mlscorr.pipeline.tying import narrowest_gate, placed_sigma, widest_gate
from mlscorr.survey import Matched, Survey, TieFeatures
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
    survey: Survey, ties: bool, rng: np.random.Generator | None, progress: Callable | None
) -> tuple[Matched, Matched, Finding, Calibration]:
    """Read a survey's clouds once, and calibrate all its scanners together by what is in them.

    Parameters
    ----------
    survey : Survey
        With a mounting of each scanner.
    ties : bool
        Whether what two passes, or two scanners, both saw takes part.
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
        Where a scanner saw less than 3 control points, or all of them at one time, and nothing that
        was seen twice, or ties are not wanted.
    """
    collector = TieCollector(survey)
    notes = ()
    if ties:
        read = read_into(collector.add)
        finding, notes = find_or_compare_surfaces(survey, read, None, progress, rng)
        control, check = finding.matches.by_role(survey)
    else:
        control, check, finding = find_control(survey, rng, progress)
    of_pass = finding.scanners(survey)
    control, check = (
        replace(part, scanner=np.array([of_pass[n] for n in part.observations.pass_number], int))
        for part in (control, check)
    )
    faults = [control_fault(control, number) for number in range(len(survey.mountings))]
    if all(faults):
        estimate = believed_mounting
    else:
        estimate = estimate_mounting
    calibration = estimate(survey.trajectory, survey.mountings, control, survey.pos)
    if ties:
        calibration = tie_mounting(survey, calibration, control, collector.features())
    for number, (name, fault) in enumerate(zip(survey.by_scanner, faults, strict=True)):
        if fault and not _is_tied(calibration, number):
            count = len(set(control[control.scanner == number].name))
            untied = " ".join([NOTHING_CALIBRATES.format(survey.path, count), *notes])
            sentence = untied if ties else fault
            raise ValueError(f"Scanner {name}: {sentence}" if name else sentence)
    return control, check, finding, with_scanner_errors(calibration, control)


def _is_tied(calibration, number):
    """Whether a tie that is used has a scanner's view."""
    ties = calibration.ties and calibration.ties.of_scanner(number)
    return bool(ties and ties.used.any())


def tie_mounting(
    survey: Survey, calibration: Calibration, matched: Matched, features: TieFeatures
) -> Calibration:
    """The calibration with the ties of a survey; the same where nothing was seen twice.

    Mountings that put the planes of all visits on each other are looked for as far from the
    calibrated ones as their sigmas allow. Then pairs are made as far apart as the POS allows, and
    half as far with each correction that they give, down to the scatter of what is left of them.

    Parameters
    ----------
    survey : Survey
        Its search radius is the limit.
    calibration : Calibration
        By control points alone, or what is believed of the mountings.
    matched : Matched
        These points.
    features : TieFeatures
    """
    recorded = calibration.recorded
    mountings = calibration.lsc.mountings
    drift = calibration.drift
    trajectory = calibration.trajectory
    sigma = placed_sigma(drift, survey.with_mountings(mountings), features)
    radius = min(widest_gate(sigma), survey.search_radius)
    moved = remounted(features, trajectory, recorded, mountings)
    known = survey.with_mountings(replace(mounting, covariance=None) for mounting in mountings)
    sigma = placed_sigma(drift, known, features)
    start = coarse_mounting(moved, trajectory, mountings, sigma, radius)
    corrections = mounted_corrections(drift, recorded, start)
    sigma = np.hypot(sigma, SETTINGS.roughest)
    radius = min(widest_gate(sigma), survey.search_radius)
    sightings = features.centre, features.gps_time, features.scanner
    while True:
        moved = increments_by_scanner(corrections, *sightings)
        turned = turned_directions(features, _move(corrections, features.scanner))
        ties = agreeing_ties(pair_features(features, moved, sigma, radius, turned=turned), moved)
        if len(ties) == 0:
            return calibration
        corrections = previewed_mounting(calibration, matched, ties)
        moved = increments_by_scanner(corrections, *sightings)
        limit = narrowest_gate(ties, moved)
        if radius <= limit:
            return calibration_with_ties(calibration, matched, ties)
        radius = max(radius / 2, limit)


def _move(corrections, scanner):
    """What corrections make of places at times, each by that of its scanner."""
    return lambda place, gps_time: (
        place + increments_by_scanner(corrections, place, gps_time, scanner)
    )
