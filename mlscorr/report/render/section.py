"""Where a cross-section shows the most: the wall that the correction moves the farthest."""

from dataclasses import dataclass

import numpy as np

CELL = 2.0  # m, of the plan grid in which walls are looked for
LOW = 0.5  # m above the lowest point of a cell: lower ones are ground
TALL = 1.5  # m, the least height of a wall over that
FLAT = 0.05  # m, the largest standard deviation of a wall's points from its plane
LONG = 0.3  # m, the least standard deviation of a wall's points along it
FEWEST = 15  # points of a visit on a wall
MANY = 150  # points of a wall, above which more don't make it clearer
FLOATING = 0.8  # m between a wall's lower end and the ground: less to see than where they meet
PAUSE = 10.0  # s between two visits of one place
CLEAR = 0.005  # m, a misfit between visits that can be seen


@dataclass(frozen=True)
class Place:
    """A wall to cut through.

    Parameters
    ----------
    focus : (3,) array
        A point on the wall, after the correction. Units: m.
    normal : (3,) array
        Horizontal unit vector across the wall.
    shift : (3,) array
        The correction of its points. Units: m.
    ground, foot : float
        Heights of the lowest point there, and of the wall's lower end. Units: m.
    moved : float
        How far it moves across itself and upwards; of a wall visited twice, how much the two
        faces approach or part. Units: m.
    split : float or None
        Time between two visits; None where it was seen once. Units: s.
    before, after : float
        Where it was seen twice, how far apart its two faces lie. Units: m.
    """

    focus: np.ndarray
    normal: np.ndarray
    shift: np.ndarray
    ground: float
    foot: float
    moved: float
    split: float | None
    before: float = np.nan
    after: float = np.nan


def find_place(scouted):
    """The wall at which the misfit shows best in a cross-section, or None without any wall.

    One that was visited twice and that the correction moves by different amounts comes first;
    else the one that it moves the farthest.
    """
    places = []
    for rows in _cells(scouted):
        if (place := _wall(scouted, rows)) is not None:
            floats = place.foot - place.ground > FLOATING
            places.append((place.moved * min(len(rows) / MANY, 1.0) / (1 + 9 * floats), place))
    twice = [p for p in places if p[1].split is not None and p[1].moved > CLEAR]
    once = [p for p in places if p[1].split is None]
    return max(twice or once or places, key=lambda pair: pair[0], default=(0.0, None))[1]


def _cells(scouted):
    """Rows of the sample in each cell that is high enough to hold a wall."""
    xyz = scouted.after.xyz
    plan = np.floor((xyz[:, :2] - xyz[:, :2].min(axis=0)) / CELL).astype(np.int64)
    key = plan[:, 0] * (plan[:, 1].max() + 1) + plan[:, 1]
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    height = xyz[order, 2]
    tall = np.maximum.reduceat(height, starts) - np.minimum.reduceat(height, starts) > TALL + LOW
    many = np.diff(np.append(starts, len(order))) >= FEWEST
    ends = np.append(starts[1:], len(order))
    return [order[starts[k] : ends[k]] for k in np.flatnonzero(tall & many)]


def _wall(scouted, rows):
    """The Place of a cell, or None when its points are no wall."""
    xyz = scouted.after.xyz[rows]
    ground = float(xyz[:, 2].min())
    rows = rows[xyz[:, 2] > ground + LOW]
    if len(rows) < FEWEST:
        return None
    xyz = scouted.after.xyz[rows]
    middle = np.median(xyz, axis=0)
    variance, vectors = np.linalg.eigh(np.cov((xyz - middle)[:, :2].T))
    if variance[0] > FLAT**2 or variance[1] < LONG**2 or np.ptp(xyz[:, 2]) < TALL:
        return None
    normal = np.append(vectors[:, 0], 0.0)
    foot = float(np.percentile(xyz[:, 2], 5))
    shift = np.median(xyz - scouted.before.xyz[rows], axis=0)
    time = scouted.before.gps_time[rows]
    split = _split(time)
    if split is None:
        moved = float(np.hypot(shift @ normal, shift[2]))
        return Place(middle, normal, shift, ground, foot, moved, None)
    apart = []
    for cloud in (scouted.before, scouted.after):
        across = (cloud.xyz[rows] - middle) @ normal
        apart.append(float(np.median(across[time > split]) - np.median(across[time <= split])))
    moved = abs(apart[1] - apart[0])
    return Place(middle, normal, shift, ground, foot, moved, split, abs(apart[0]), abs(apart[1]))


def _split(time):
    """The middle of the longest pause between two visits, or None."""
    ordered = np.sort(time)
    steps = np.diff(ordered)
    k = int(np.argmax(steps))
    if steps[k] < PAUSE or min(k + 1, len(time) - k - 1) < FEWEST:
        return None
    return float((ordered[k] + ordered[k + 1]) / 2)
