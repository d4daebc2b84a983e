"""Position of the most instructive cross-section: the wall with the largest correction."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.estimate import TieResiduals
from mlscorr.report.render._scout import Scouted
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import Ties
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class Place:
    """Wall to cut through.

    Parameters
    ----------
    focus : (3,) array
        Point on the wall, after the correction. Units: m.
    normal : (3,) array
        Horizontal unit vector across the wall.
    shift : (3,) array
        Correction of its points. Units: m.
    ground, foot : float
        Heights of the lowest point nearby, and of the wall's lower end. Units: m.
    moved : float
        Motion across itself and upward; for a wall with several visits, the change of distance
        between the scanned faces. Units: m.
    splits : tuple of float
        Times between visits; empty for a single scan. Units: s.
    before, after : float
        Distance of its faces if it was scanned again. Units: m.
    passes : tuple of int
        Pass of each visit, if known from ties.
    """

    focus: np.ndarray
    normal: np.ndarray
    shift: np.ndarray
    ground: float
    foot: float
    moved: float
    splits: tuple[float, ...]
    before: float = np.nan
    after: float = np.nan
    passes: tuple[int, ...] = ()


def find_place(scouted: Scouted, ties: TieResiduals | None = None) -> Place | None:
    """Wall with the most visible misclosure in a cross-section, or None without any wall.

    A facade with ties has priority, then a wall with two visits and different corrections, then the
    one with the largest correction.

    Parameters
    ----------
    scouted : Scouted
    ties : TieResiduals, optional
    """
    if ties is not None:
        places = [pair for pair in _places(scouted, _tied(scouted, ties)) if pair[1].splits]
        if places:
            place = max(places, key=lambda pair: pair[0])[1]
            return replace(place, passes=_passes(place, ties.ties))
    places = _places(scouted, _cells(scouted))
    twice = [p for p in places if p[1].splits and p[1].moved > SETTINGS.visible / 2]
    once = [p for p in places if not p[1].splits]
    return max(twice or once or places, key=lambda pair: pair[0], default=(0.0, None))[1]


def worst_facades(residuals: TieResiduals) -> Ties:
    """Facades with the largest misclosures of used ties between passes.

    Parameters
    ----------
    residuals : TieResiduals
    """
    ties = residuals.ties[residuals.used]
    ties = ties[(ties.kind == "plane") & (np.abs(ties.direction[:, 2]) < 0.5)]
    return ties[np.argsort(-np.abs(ties.misclosure), kind="stable")[: SETTINGS.facades]]


def _places(scouted, cells):
    """Place of each cell (rows of the sample) that is a wall, after its visibility."""
    places = []
    clear = 10 * SETTINGS.normal_points  # more points do not make a wall clearer
    for rows in cells:
        if (place := _wall(scouted, rows)) is not None:
            # the junction of wall and ground is more instructive
            floats = place.foot - place.ground > SETTINGS.wall_height / 2
            places.append((place.moved * min(len(rows) / clear, 1.0) / (1 + 9 * floats), place))
    return places


def _tied(scouted, residuals):
    """Rows of the sample about each of the worst facades, of every pass."""
    time = scouted.before.gps_time
    facades = worst_facades(residuals)
    for places, times in zip(facades.place, facades.gps_time, strict=True):
        rows = _about(scouted.before.xyz, places[0, :2])
        at_first = rows[np.abs(time[rows] - times[0]) < TIES.pause / 2]
        if len(at_first):
            yield _about(scouted.after.xyz, np.median(scouted.after.xyz[at_first, :2], axis=0))


def _about(xyz, middle):
    """Rows of points (n, 3) in the cell about a place in plan."""
    half = SETTINGS.plan_cell / 2
    rows = np.flatnonzero(np.abs(xyz[:, 0] - middle[0]) < half)
    return rows[np.abs(xyz[rows, 1] - middle[1]) < half]


def _cells(scouted):
    """Rows of the sample in each cell that is high enough for a wall."""
    xyz = scouted.after.xyz
    plan = np.floor((xyz[:, :2] - xyz[:, :2].min(axis=0)) / SETTINGS.plan_cell).astype(np.int64)
    key = plan[:, 0] * (plan[:, 1].max() + 1) + plan[:, 1]
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    height = xyz[order, 2]
    extent = np.maximum.reduceat(height, starts) - np.minimum.reduceat(height, starts)
    ends = np.append(starts[1:], len(order))
    kept = (extent > 4 / 3 * SETTINGS.wall_height) & (ends - starts >= SETTINGS.normal_points)
    return [order[starts[k] : ends[k]] for k in np.flatnonzero(kept)]


def _wall(scouted, rows):
    """Place of a cell, or None if its points are not a wall."""
    xyz = scouted.after.xyz[rows]
    ground = float(xyz[:, 2].min())
    rows = rows[xyz[:, 2] > ground + SETTINGS.wall_height / 3]
    if len(rows) < SETTINGS.normal_points:
        return None
    xyz = scouted.after.xyz[rows]
    if np.ptp(xyz[:, 2]) < SETTINGS.wall_height:
        return None
    middle = np.median(xyz, axis=0)
    plan = xyz[:, :2] - xyz[:, :2].mean(axis=0)
    variance, vectors = np.linalg.eigh(plan.T @ plan / (len(plan) - 1))
    length = np.sqrt(12 * variance[1])  # of an evenly covered wall
    if variance[0] > SETTINGS.wall_flatness**2 or length < SETTINGS.plan_cell / 2:
        return None
    normal = np.append(vectors[:, 0], 0.0)
    foot = float(np.percentile(xyz[:, 2], 5))
    shift = np.median(xyz - scouted.before.xyz[rows], axis=0)
    splits, visits = _visits(scouted.before.gps_time[rows])
    if len(visits) < 2:
        moved = float(np.hypot(shift @ normal, shift[2]))
        return Place(middle, normal, shift, ground, foot, moved, ())
    across = [(cloud.xyz[rows] - middle) @ normal for cloud in (scouted.before, scouted.after)]
    faces = np.array([[np.median(values[visit]) for visit in visits] for values in across])
    moved = float(np.ptp(faces[1] - faces[0]))
    before, after = np.ptp(faces, axis=1).tolist()
    return Place(middle, normal, shift, ground, foot, moved, splits, before, after)


def _visits(time):
    """Times between visits, and the rows of each visit with enough points for a wall."""
    order = np.argsort(time, kind="stable")
    last = np.flatnonzero(np.diff(time[order]) >= TIES.pause)
    splits = (time[order[last]] + time[order[last + 1]]) / 2
    visits = [rows for rows in np.split(order, last + 1) if len(rows) >= SETTINGS.normal_points]
    return tuple(splits.tolist()), visits


def _passes(place, ties):
    """Pass of each visit from the nearest tie in time; () if two visits are of one pass."""
    time = ties.gps_time.ravel()
    number = ties.pass_number.ravel()
    away = np.linalg.norm(ties.place.reshape(-1, 3) - place.focus, axis=1)
    visit = np.searchsorted(place.splits, time)
    visits = range(len(place.splits) + 1)
    passes = [int(number[np.where(visit == k, away, np.inf).argmin()]) for k in visits]
    if len(set(passes)) == len(passes):
        return tuple(passes)
    return ()
