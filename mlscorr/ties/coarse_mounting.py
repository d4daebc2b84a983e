"""How degrees of boresight are found before anything but a drawing is known of them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import georeference, mounting_partials, to_scanner
from mlscorr.survey import PAINTED, Mounting, TieFeatures, Trajectory
from mlscorr.ties.pairing import candidate_pairs
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import some_blocks


def coarse_mounting(
    features: TieFeatures,
    trajectory: Trajectory,
    mounting: Mounting,
    sigma: np.ndarray,
    radius: float,
) -> Mounting:
    """A mounting that puts the planes of several visits on each other.

    One lever arm and one boresight for the whole survey, and a shift of each pass, are looked for
    together: a shift of each stretch of time would take up what a boresight does, and leave it half
    unexplained. All parallel planes within a radius pull, with weights (Geman-McClure) whose width
    halves, and are paired anew each time. It is a start for pair_features, no more.

    Parameters
    ----------
    features : TieFeatures
        As georeferenced with the recorded mounting.
    trajectory : Trajectory
    mounting : Mounting
        As recorded, with the covariance of what is known of it.
    sigma : (n,) array
        One sigma of the features' places by the POS. Units: m.
    radius : float
        Of the search. Units: m.
    """
    planes = some_blocks(features[features.kind == "plane"], SETTINGS.coarse_features)
    passes = np.unique(planes.pass_number)
    shift = float(np.median(sigma)) if len(sigma) else 0.0
    prior = np.zeros((6 + 3 * len(passes),) * 2)
    prior[:6, :6] = np.linalg.inv(mounting.covariance)
    prior[range(6, len(prior)), range(6, len(prior))] = max(shift, SETTINGS.surface_sigma) ** -2.0
    turn_sigma = np.sqrt(mounting.covariance[range(3, 6), range(3, 6)].max())
    state, width, at = np.zeros(len(prior)), radius / 2, mounting
    while width > SETTINGS.roughest:
        angle = SETTINGS.parallel + 2 * turn_sigma * 2 * width / radius
        for _ in range(3):
            moved = remounted(planes, trajectory, mounting, at)
            shifts = state[6:].reshape(-1, 3)[np.searchsorted(passes, planes.pass_number)]
            gates = np.full(len(planes), SETTINGS.gate_sigmas * width)
            pairs, _ = candidate_pairs(moved, shifts, gates, 2 * width, angle)
            normal = moved.direction[pairs].sum(axis=1)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            place = (moved.centre + shifts)[pairs]
            left = np.einsum("ni,ni->n", normal, place[:, 1] - place[:, 0])
            design = _design(moved, trajectory, at, passes, pairs, normal)
            weight = width**2 / (width**2 + left**2) ** 2
            matrix = (design.T * weight) @ design + prior
            step = np.linalg.solve(matrix, design.T @ (weight * left) - prior @ state)
            state = state + step
            at = Mounting(at.lever_arm + step[:3], Rotation.from_rotvec(step[3:6]) * at.boresight)
        width /= 2
    return replace(at, covariance=mounting.covariance)


def remounted(
    features: TieFeatures, trajectory: Trajectory, recorded: Mounting, mounting: Mounting
) -> TieFeatures:
    """Features as another mounting gives them: their places and directions  (Eq. 1).

    Parameters
    ----------
    features : TieFeatures
    trajectory : Trajectory
    recorded, mounting : Mounting
        That of the features, and the other.
    """

    def move(place, gps_time):
        in_scanner = to_scanner(trajectory, recorded, place, gps_time)
        return georeference(trajectory, mounting, in_scanner, gps_time)

    centre = move(features.centre, features.gps_time)
    return replace(features, centre=centre, direction=turned_directions(features, move))


def turned_directions(features: TieFeatures, move: Callable) -> np.ndarray:
    """Directions (n, 3) of features whose points are moved, each by its own time.

    A wall that a line scanner passes keeps the direction of the way, whatever the boresight: what
    turns is the scan line.

    Parameters
    ----------
    features : TieFeatures
    move : function of places (n, 3) and times (n,)
        Gives places. Units: m, s.
    """
    axis, rows = features.direction, np.arange(len(features))
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    centre = move(features.centre, features.gps_time)

    def tangent(unit):
        way = SETTINGS.narrowest * unit
        return move(features.centre + way, features.time_beside(rows, way)) - centre

    up = np.array([0.0, 0.0, 1.0])
    is_plane, is_line = ((features.kind == kind)[:, None] for kind in ("plane", "line"))
    turned = tangent(np.where(is_line, np.cross(up, axis), axis))
    turned[np.isin(features.kind, PAINTED), 2] = 0.0
    turned = np.where(is_line, np.cross(turned, up), turned)
    turned = np.where(is_plane, np.cross(tangent(side), tangent(np.cross(axis, side))), turned)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _design(features, trajectory, mounting, passes, pairs, normal):
    """Rows (k, 6 + 3 p) of pairs: n (first - second) of the mounting and of each pass's shift."""
    rows = np.zeros((len(pairs), len(passes) + 2, 3))
    number = np.searchsorted(passes, features.pass_number[pairs])
    for view, sign in ((0, 1.0), (1, -1.0)):
        view_rows = pairs[:, view]
        partials = mounting_partials(
            trajectory, mounting, features.centre[view_rows], features.gps_time[view_rows]
        )
        along = np.einsum("ni,nij->nj", normal, partials).reshape(len(pairs), 2, 3)
        rows[:, :2] += sign * along
        rows[np.arange(len(pairs)), 2 + number[:, view]] += sign * normal
    return rows.reshape(len(pairs), 3 * len(passes) + 6)
