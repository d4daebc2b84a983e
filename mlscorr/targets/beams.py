"""What each beam did at the plane of a target: met it bright, met it dark, or went by.

A plate in the air has no darker neighbours on its plane. Beams that returned from behind it tell
as much; and where nothing returned, the next pulse of a scan line, or the same one a line later,
looked beside it.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.targets.shapes import BRIGHT, DARK, PASSED

SHARED_TIMES = 0.2  # of the points; a second echo of a pulse now and then is no second beam


@dataclass(frozen=True)
class Pulses:
    """Points of one piece and visit in order of time; sight (n, 3) is scanner to point in m,
    tree finds points by place; points as near to a plane as the tolerance (m) are on it.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    sight: np.ndarray
    tree: cKDTree
    tolerance: float


def beams_at_plane(pulses, plane, middle, reach, threshold):
    """Beams that met the plane near a place or went by it; those stopped in front tell nothing.

    Parameters
    ----------
    pulses : Pulses
    plane : Plane
    middle : (2,) array
        Of the place in the plane. Units: m.
    reach : float
        Units: m.
    threshold : float
        Of intensity: bright from here on.

    Returns their crossings (k, 2) in m, state (k,) and rows (k,), in order of time.
    """
    height = (pulses.xyz - plane.origin) @ plane.axes[2]
    beam = pulses.sight @ plane.axes[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = height / beam  # in units of the range; positive behind the plane
    on_plane = np.abs(height) <= pulses.tolerance
    rows = np.flatnonzero((on_plane | ((beyond > 0) & (beyond < 1))) & (np.abs(beyond) < 1))
    points = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
    near = np.sum((points - middle) ** 2, axis=1) < reach**2
    rows, points = rows[near], points[near]
    state = np.where(pulses.intensity[rows] >= threshold, BRIGHT, DARK)
    return points, np.where(on_plane[rows], state, PASSED), rows


def missed_points(pulses, rows, plane):
    """Places (k, 2) in the plane where beams beside the target's points met nothing at all.

    Parameters
    ----------
    pulses : Pulses
    rows : (n,) int array
        Those on the target.
    plane : Plane

    Returns (k, 2) in m; none when the target has fewer than two scan lines, or when the pulses
    don't follow each other regularly in one line (scanners of many beams at once).
    """
    uv = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
    pulse, lines = _scan_lines(pulses.gps_time[rows])
    if len(lines) < 2 or pulse == 0:
        return np.empty((0, 2))
    step = _median_step(uv, lines)
    period, advance = _line_advance(pulses.gps_time[rows], uv, lines, step)
    first, last = lines[0], lines[-1]
    ends = np.array([line[-1] for line in lines])
    starts = np.array([line[0] for line in lines])
    looks = [(ends, pulse, step), (starts, -pulse, -step)]
    if np.linalg.norm(advance) > np.linalg.norm(step) / 4:  # else the vehicle stands
        looks += [(last, period, advance), (first, -period, -advance)]
    missed = [
        uv[at][~_returned(pulses, pulses.gps_time[rows[at]] + lag, pulse)] + move
        for at, lag, move in looks
    ]
    return np.concatenate(missed)


def _returned(pulses, time, pulse):
    """Whether there is a point of the pulse at each time (n,)."""
    right = np.clip(np.searchsorted(pulses.gps_time, time), 1, len(pulses.gps_time) - 1)
    left = pulses.gps_time[right - 1]
    return np.minimum(np.abs(time - left), np.abs(pulses.gps_time[right] - time)) < 0.6 * pulse


def _scan_lines(gps_time):
    """Interval of pulses (s) and scan lines: index arrays of points without a longer pause.

    The interval is 0 where many points share a time: their order in it is unknown.
    """
    steps = np.diff(gps_time)
    if np.mean(steps <= 0) > SHARED_TIMES:
        return 0.0, []
    pulse = float(np.percentile(steps[steps > 0], 25))
    breaks = np.flatnonzero(steps > 12 * pulse) + 1  # a few lost returns don't end a line
    return pulse, np.split(np.arange(len(gps_time)), breaks)


def _median_step(uv, lines):
    """Typical move of the beam in the plane from one pulse to the next: (2,). Units: m."""
    return np.median(np.concatenate([np.diff(uv[line], axis=0) for line in lines]), axis=0)


def _line_advance(gps_time, uv, lines, step):
    """Time (s) and move (2,) in m from a point to its like on the next scan line."""
    along = step / max(np.linalg.norm(step), 1e-9)
    times, moves = [], []
    for line, following in pairwise(lines):
        nearest = np.abs(uv[following] @ along - (uv[line] @ along)[:, None]).argmin(axis=1)
        like = following[nearest]
        near = np.abs((uv[like] - uv[line]) @ along) <= np.linalg.norm(step)
        times.append(gps_time[like[near]] - gps_time[line[near]])
        moves.append(uv[like[near]] - uv[line[near]])
    times, moves = np.concatenate(times), np.concatenate(moves)
    if len(times) == 0:
        return 0.0, np.zeros(2)
    period = np.median(times)
    single = times < 1.5 * period  # lines that were skipped would make the move longer
    return float(period), np.median(moves[single], axis=0)
