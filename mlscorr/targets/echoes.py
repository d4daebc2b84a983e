"""What each beam did at the plane of a target: met it bright, met it dark, or went by.

A plate in the air has no darker neighbours on its plane. Beams that returned from behind it tell
as much; and where nothing returned, the next pulse of a scan line, or the same one a line later,
looked beside it.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit

from mlscorr.targets.plane import Plane
from mlscorr.targets.shapes import BRIGHT, DARK, MISS


@dataclass(frozen=True)
class Echoes:
    """Points of one piece and visit, in order of time.

    Parameters
    ----------
    xyz : (n, 3) array
        From any origin. Units: m.
    gps_time : (n,) array
        Units: s.
    intensity : (n,) array
    sight : (n, 3) array
        Scanner to point. Units: m.
    tolerance : float
        Points as near to a plane as this are on it. Units: m.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    sight: np.ndarray
    tolerance: float


def beams_at_plane(
    echoes: Echoes, plane: Plane, middle: np.ndarray, radius: float, threshold: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Beams that met the plane near a place or went by it; those stopped in front tell nothing.

    Parameters
    ----------
    echoes : Echoes
    plane : Plane
    middle : (2,) array
        Of the place in the plane. Units: m.
    radius : float
        Units: m.
    threshold : float
        Of intensity: bright from here on.

    Returns
    -------
    crossings : (k, 2) array
        In order of time. Units: m.
    state : (k,) int array
        BRIGHT, DARK or MISS.
    rows : (k,) int array
    """
    rows, on_plane = _beams_near(
        echoes.xyz, echoes.sight, echoes.tolerance, plane.origin, plane.axes, middle, radius
    )
    points = plane.crossing(echoes.xyz[rows], echoes.sight[rows])
    state = np.where(echoes.intensity[rows] >= threshold, BRIGHT, DARK)
    return points, np.where(on_plane, state, MISS), rows


@njit(cache=True, error_model="numpy")
def _beams_near(xyz, sight, tolerance, origin, axes, middle, radius):
    """Rows (k,) of these beams, and which of them ended on the plane: thousands of calls look."""
    rows, on_plane, count = np.empty(len(xyz), np.int64), np.empty(len(xyz), np.bool_), 0
    for row in range(len(xyz)):
        height = steep = 0.0
        for i in range(3):
            height += (xyz[row, i] - origin[i]) * axes[2, i]
            steep += sight[row, i] * axes[2, i]
        beyond, is_on = height / steep, abs(height) <= tolerance  # positive behind the plane
        if not (abs(beyond) < 1.0 and (is_on or beyond > 0.0)):  # in units of the range
            continue
        away = 0.0
        for axis in range(2):
            across = -middle[axis]
            for i in range(3):
                across += (xyz[row, i] - origin[i] - beyond * sight[row, i]) * axes[axis, i]
            away += across**2
        if away < radius**2:
            rows[count], on_plane[count] = row, is_on
            count += 1
    return rows[:count].copy(), on_plane[:count].copy()


def missed_points(echoes: Echoes, rows: np.ndarray, plane: Plane) -> np.ndarray:
    """Places in the plane where beams beside the target's points met nothing at all.

    Parameters
    ----------
    echoes : Echoes
    rows : (n,) int array
        Those on the target.
    plane : Plane

    Returns
    -------
    (k, 2) array
        Units: m. None when the target has fewer than two scan lines, or when the pulses don't
        follow each other regularly in one line (scanners of many beams at once).
    """
    uv = plane.crossing(echoes.xyz[rows], echoes.sight[rows])
    pulse, lines = _scan_lines(echoes.gps_time[rows])
    if len(lines) < 2 or pulse == 0:
        return np.empty((0, 2))
    step = np.median(np.concatenate([np.diff(uv[line], axis=0) for line in lines]), axis=0)
    period, advance = _line_advance(echoes.gps_time[rows], uv, lines, step)
    ends = np.array([line[-1] for line in lines])
    starts = np.array([line[0] for line in lines])
    neighbours = [(ends, pulse, step), (starts, -pulse, -step)]
    if np.linalg.norm(advance) > np.linalg.norm(step) / 4:  # else the vehicle stands
        neighbours += [(lines[-1], period, advance), (lines[0], -period, -advance)]
    missed = [
        uv[at][~_returned(echoes, echoes.gps_time[rows[at]] + lag, pulse)] + move
        for at, lag, move in neighbours
    ]
    return np.concatenate(missed)


def _returned(echoes, time, pulse):
    """Whether there is a point of the pulse at each time (n,)."""
    right = np.clip(np.searchsorted(echoes.gps_time, time), 1, len(echoes.gps_time) - 1)
    left = echoes.gps_time[right - 1]
    return np.minimum(np.abs(time - left), np.abs(echoes.gps_time[right] - time)) < 0.6 * pulse


def _scan_lines(gps_time):
    """Interval of pulses (s) and scan lines: index arrays of points without a longer pause.

    The interval is 0 where many points share a time: their order in it is unknown.
    """
    steps = np.diff(gps_time)
    if np.median(steps) <= 0:
        return 0.0, []
    pulse = float(np.percentile(steps[steps > 0], 25))
    breaks = np.flatnonzero(steps > 12 * pulse) + 1  # a few lost returns don't end a line
    return pulse, np.split(np.arange(len(gps_time)), breaks)


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
    return float(period), np.median(moves[times < 1.5 * period], axis=0)  # no line was skipped
