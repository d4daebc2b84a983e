"""Mountings by ties: paired while these may be wrong by degrees, and paired again, ever nearer."""

from dataclasses import replace

import numpy as np

from mlscorr.correction import increments_by_scanner
from mlscorr.estimate import (
    Calibration,
    calibration_with_ties,
    mounted_corrections,
    previewed_mounting,
)
from mlscorr.survey import Matched, Survey, TieFeatures
from mlscorr.ties._coarse_mounting import coarse_mounting, remounted, turned_directions
from mlscorr.ties._gates import narrowest_gate, placed_sigma, widest_gate
from mlscorr.ties.pairing import pair_features
from mlscorr.ties.search import agreeing_ties
from mlscorr.ties.settings import SETTINGS


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
    views = (features.centre, features.gps_time, features.scanner)

    # Coarsely: mountings within their sigmas that put the planes of all visits on each other
    sigma = placed_sigma(drift, survey.with_mountings(mountings), features)
    radius = min(widest_gate(sigma), survey.search_radius)
    moved = remounted(features, trajectory, recorded, mountings)
    known = survey.with_mountings(replace(mounting, covariance=None) for mounting in mountings)
    sigma = placed_sigma(drift, known, features)
    start = coarse_mounting(moved, trajectory, mountings, sigma, radius)
    corrections = mounted_corrections(drift, recorded, start)

    # Finely: ties about what the corrections make of each place, within ever nearer gates
    def corrected(place, gps_time):
        return place + increments_by_scanner(corrections, place, gps_time, features.scanner)

    sigma = np.hypot(sigma, SETTINGS.roughest)
    radius = min(widest_gate(sigma), survey.search_radius)
    while True:
        moved = increments_by_scanner(corrections, *views)
        turned = turned_directions(features, corrected)
        pairs = pair_features(features, moved, sigma, radius, turned=turned)
        ties = agreeing_ties(pairs, moved)
        if len(ties) == 0:
            return calibration
        corrections = previewed_mounting(calibration, matched, ties)
        moved = increments_by_scanner(corrections, *views)
        limit = narrowest_gate(ties, moved)
        if radius <= limit:
            return calibration_with_ties(calibration, matched, ties)
        radius = max(radius / 2, limit)
