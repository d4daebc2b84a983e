"""Calibration of mountings by ties, starting from errors of degrees, with repeated pairing."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from mlscorr.correction import increments_by_scanner
from mlscorr.estimate import (
    Calibration,
    calibration_with_ties,
    mounted_corrections,
    previewed_mounting,
)
from mlscorr.frames import georeferenced_anew, mounting_partials, partials_by_scanner
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import PAINTED, Matched, Mounting, Survey, TieFeatures, Trajectory
from mlscorr.ties.agreement import narrowest_gate, placed_sigma, widest_gate
from mlscorr.ties.pairing import candidate_pairs, pair_features
from mlscorr.ties.search import agreeing_ties
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import some_blocks


def tie_mounting(
    survey: Survey, calibration: Calibration, matched: Matched, features: TieFeatures
) -> Calibration:
    """Return the calibration with the ties of a survey, or unchanged if there is no overlap.

    Mountings that align the planes of all visits are searched within the sigmas of the calibrated
    ones. Then features are paired within the gate that the POS allows, which is halved with each
    correction, down to the scatter of the residuals.

    Parameters
    ----------
    survey : Survey
        The search radius is the limit.
    calibration : Calibration
        From control points only, or the prior of the mountings.
    matched : Matched
        Matched control points.
    features : TieFeatures
    """
    recorded = calibration.recorded
    mountings = calibration.lsc.mountings
    drift = calibration.drift
    trajectory = calibration.trajectory
    views = (features.centre, features.gps_time, features.scanner)

    # Coarse: mountings within their sigmas that align the planes of all visits
    sigma = placed_sigma(drift, survey.with_mountings(mountings), features)
    radius = min(widest_gate(sigma), survey.search_radius)
    moved = remounted(features, trajectory, recorded, mountings)
    known = survey.with_mountings(replace(mounting, covariance=None) for mounting in mountings)
    sigma = placed_sigma(drift, known, features)
    start = coarse_mounting(moved, trajectory, mountings, sigma, radius)
    corrections = mounted_corrections(drift, recorded, start)

    # Fine: ties after the corrections of each position, within ever narrower gates
    def corrected(place, gps_time):
        return place + increments_by_scanner(corrections, place, gps_time, features.scanner)

    sigma = np.hypot(sigma, SURFACES.roughest)
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


def coarse_mounting(
    features: TieFeatures,
    trajectory: Trajectory,
    mountings: Sequence[Mounting],
    sigma: np.ndarray,
    radius: float,
) -> tuple[Mounting, ...]:
    """Mountings of k scanners that align the planes of all visits.

    One lever arm and one boresight of each scanner for the whole survey, and a shift of each pass,
    are estimated together. A shift of each interval of time would absorb half of a boresight error.
    A scanner without an overlap of its own is constrained by the other scanners. All parallel
    planes within a radius contribute, with weights (Geman-McClure) whose width is halved in each
    iteration, and are paired again each time. The result is only a start for pair_features.

    Parameters
    ----------
    features : TieFeatures
        Georeferenced with the recorded mountings.
    trajectory : Trajectory
    mountings : sequence of Mounting
        Recorded mountings, with the prior covariance of each.
    sigma : (n,) array
        One sigma of the features' positions due to the POS. Units: m.
    radius : float
        Search radius. Units: m.
    """
    count = len(mountings)
    planes = some_blocks(features[features.kind == "plane"], count * SETTINGS.coarse_features)
    passes = np.unique(planes.pass_number)
    shift = 0.0
    if len(sigma):
        shift = float(np.median(sigma))
    known = [mounting.covariance for mounting in mountings]
    each = np.full(3 * len(passes), max(shift, SETTINGS.surface_sigma) ** -2.0)
    prior = block_diag(*map(np.linalg.inv, known), np.diag(each))
    turn_sigma = np.sqrt(max(np.diag(covariance)[3:].max() for covariance in known))
    state = np.zeros(len(prior))
    width = radius / 2
    at = tuple(mountings)
    while width > SURFACES.roughest:
        angle = SETTINGS.parallel + 2 * turn_sigma * 2 * width / radius
        for _ in range(3):
            moved = remounted(planes, trajectory, mountings, at)
            shifts = state[6 * count :].reshape(-1, 3)[np.searchsorted(passes, planes.pass_number)]
            gates = np.full(len(planes), SETTINGS.gate_sigmas * width)
            pairs, _ = candidate_pairs(moved, shifts, gates, 2 * width, angle=angle)
            normal = moved.direction[pairs].sum(axis=1)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            place = (moved.centre + shifts)[pairs]
            left = np.einsum("ni,ni->n", normal, place[:, 1] - place[:, 0])
            design = _design(moved, trajectory, at, passes, pairs, normal)
            weight = width**2 / (width**2 + left**2) ** 2
            matrix = (design.T * weight) @ design + prior
            step = np.linalg.solve(matrix, design.T @ (weight * left) - prior @ state)
            state = state + step
            turns = step[: 6 * count].reshape(-1, 6)
            at = tuple(
                replace(
                    mounting,
                    lever_arm=mounting.lever_arm + turn[:3],
                    boresight=Rotation.from_rotvec(turn[3:]) * mounting.boresight,
                )
                for mounting, turn in zip(at, turns, strict=True)
            )
        width /= 2
    return at


def remounted(
    features: TieFeatures,
    trajectory: Trajectory,
    recorded: Sequence[Mounting],
    mountings: Sequence[Mounting],
) -> TieFeatures:
    """Return features recomputed for other mountings: positions and directions  (Eq. 1).

    Parameters
    ----------
    features : TieFeatures
    trajectory : Trajectory
    recorded, mountings : sequence of Mounting
        Of each scanner: the mounting behind the features, and the other one.
    """

    def move(place, gps_time):
        sightings = place, gps_time, features.scanner
        return georeferenced_anew(trajectory, recorded, mountings, *sightings)

    centre = move(features.centre, features.gps_time)
    return replace(features, centre=centre, direction=turned_directions(features, move))


def turned_directions(features: TieFeatures, move: Callable) -> np.ndarray:
    """Directions (n, 3) of features whose points are moved, each by its own time.

    A wall that a line scanner passes keeps its direction along the path, whatever the boresight;
    only the scan line turns.

    Parameters
    ----------
    features : TieFeatures
    move : function of places (n, 3) and times (n,)
        Returns positions. Units: m, s.
    """
    axis = features.direction
    rows = np.arange(len(features))
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    centre = move(features.centre, features.gps_time)

    def tangent(unit):
        offset = SURFACES.narrowest * unit
        return move(features.centre + offset, features.time_near(rows, offset)) - centre

    up = np.array([0.0, 0.0, 1.0])
    is_plane, is_line = ((features.kind == kind)[:, None] for kind in ("plane", "line"))
    turned = tangent(np.where(is_line, np.cross(up, axis), axis))
    turned[np.isin(features.kind, PAINTED), 2] = 0.0
    turned = np.where(is_line, np.cross(turned, up), turned)
    turned = np.where(is_plane, np.cross(tangent(side), tangent(np.cross(axis, side))), turned)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _design(features, trajectory, mountings, passes, pairs, normal):
    """Rows of pairs: n (first - second) of the k mountings and of the shifts of p passes (6 k +
    3 p).
    """
    first = 2 * len(mountings)
    numbered = dict(enumerate(mountings))
    rows = np.zeros((len(pairs), first + len(passes), 3))
    number = np.searchsorted(passes, features.pass_number[pairs])
    for view, sign in ((0, 1.0), (1, -1.0)):
        columns = features.centre, features.gps_time, features.scanner
        sightings = (column[pairs[:, view]] for column in columns)
        partials = partials_by_scanner(mounting_partials, trajectory, numbered, *sightings)
        along = np.einsum("ni,nij->nj", normal, partials)
        rows[:, :first] += sign * along.reshape(len(pairs), first, 3)
        rows[np.arange(len(pairs)), first + number[:, view]] += sign * normal
    return rows.reshape(len(pairs), 3 * rows.shape[1])
