"""Where the scanner looked beside a target: pulses that tell where its outline is.

A plate in the air has no darker neighbours on its plane. That the next pulse of a scan line, or
the same pulse one line later, missed it says as much, unless something stood in front.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

IN_FRONT = 0.10  # m: a neighbour nearer to the vehicle by this hides the target


@dataclass(frozen=True)
class Pulses:
    """Points of one region and visit in order of time; sight (n, 3) is scanner to point in m,
    tree finds points by place.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    sight: np.ndarray
    tree: cKDTree


def missed_points(pulses, rows, plane, tolerance):
    """Points (k, 2) in the plane where pulses beside the target's points passed it.

    Parameters
    ----------
    pulses : Pulses
    rows : (n,) int array
        Those on the target.
    plane : Plane
    tolerance : float
        A point this near to the plane is on it, and speaks for itself. Units: m.

    Returns (k, 2) in m; none when the target has fewer than two scan lines.
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
        uv[at][_passes(pulses, rows[at], lag, plane, tolerance, pulse)] + move
        for at, lag, move in looks
    ]
    return np.concatenate(missed)


def _scan_lines(gps_time):
    """Interval of pulses (s) and scan lines: index arrays of points without a longer pause."""
    steps = np.diff(gps_time)
    pulse = float(np.percentile(steps[steps > 0], 25)) if (steps > 0).any() else 0.0
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


def _passes(pulses, rows, lag, plane, tolerance, pulse):
    """Whether the pulse a lag (s) after each row passed the target: (n,) bool.

    It did when it has no return or one behind the plane; not when it hit the plane, nor when it
    hit something in front.
    """
    time = pulses.gps_time[rows] + lag
    right = np.clip(np.searchsorted(pulses.gps_time, time), 1, len(pulses.gps_time) - 1)
    nearer = time - pulses.gps_time[right - 1] < pulses.gps_time[right] - time
    neighbour = right - nearer
    returned = np.abs(pulses.gps_time[neighbour] - time) < 0.6 * pulse
    height = np.abs(plane.coordinates(pulses.xyz[neighbour])[:, 2])
    distance = np.linalg.norm(pulses.sight[rows], axis=1)
    in_front = np.linalg.norm(pulses.sight[neighbour], axis=1) < distance - IN_FRONT
    return ~returned | ((height > tolerance) & ~in_front)
