"""What each beam did at the plane of a target: met it bright, met it dark, or went by.

A plate in the air has no darker neighbours on its plane. Beams that returned from behind it tell
as much; and where nothing returned, the next pulse of a scan line, or the same one a line later,
looked beside it.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.targets._plane import Plane
from mlscorr.targets.scanner_path import ScannerPath
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
    path : ScannerPath
        Of the scanner, from the same origin.
    tolerance : float
        Points as near to a plane as this are on it. Units: m.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    path: ScannerPath
    tolerance: float

    def sight(self, rows: np.ndarray | slice) -> np.ndarray:
        """Scanner to point (k, 3) of some rows. Units: m."""
        return self.xyz[rows] - self.path.at(self.gps_time[rows])


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
    path = echoes.path.gps_time, np.ascontiguousarray(echoes.path.position)
    place = plane.origin, plane.axes, middle, radius
    rows, on_plane = _beams_near(echoes.xyz, echoes.gps_time, path, echoes.tolerance, place)
    points = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
    state = np.where(echoes.intensity[rows] >= threshold, BRIGHT, DARK)
    return points, np.where(on_plane, state, MISS), rows


@loop
def _beams_near(xyz, gps_time, path, tolerance, place):
    """Rows (k,) of these beams, and which of them ended on the plane: thousands of calls look."""
    origin, axes, middle, radius = place
    epochs, scanner = path
    rows = np.empty(len(xyz), np.int64)
    on_plane = np.empty(len(xyz), np.bool_)
    count = 0
    # the plane, where the scanner was
    above = np.zeros(len(epochs))
    epoch = 0
    for i in range(3):
        for k in range(len(epochs)):
            above[k] += (scanner[k, i] - origin[i]) * axes[2, i]
    for row in range(len(xyz)):
        while epoch < len(epochs) - 2 and epochs[epoch + 1] <= gps_time[row]:
            epoch += 1
        share = (gps_time[row] - epochs[epoch]) / (epochs[epoch + 1] - epochs[epoch])
        height = 0.0
        for i in range(3):
            height += (xyz[row, i] - origin[i]) * axes[2, i]
        steep = height - above[epoch] - share * (above[epoch + 1] - above[epoch])
        is_on = abs(height) <= tolerance
        is_behind = height * steep > 0.0
        if not (abs(height) < abs(steep) and (is_on or is_behind)):
            continue
        # behind the plane, in units of the range
        beyond = height / steep
        away = 0.0
        for axis in range(2):
            across = -middle[axis]
            for i in range(3):
                start = scanner[epoch, i] + share * (scanner[epoch + 1, i] - scanner[epoch, i])
                met = xyz[row, i] - beyond * (xyz[row, i] - start)
                across += (met - origin[i]) * axes[axis, i]
            away += across**2
        if away < radius**2:
            rows[count] = row
            on_plane[count] = is_on
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
    uv = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
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
    times = []
    moves = []
    for line, following in pairwise(lines):
        nearest = np.abs(uv[following] @ along - (uv[line] @ along)[:, None]).argmin(axis=1)
        like = following[nearest]
        near = np.abs((uv[like] - uv[line]) @ along) <= np.linalg.norm(step)
        times.append(gps_time[like[near]] - gps_time[line[near]])
        moves.append(uv[like[near]] - uv[line[near]])
    times = np.concatenate(times)
    moves = np.concatenate(moves)
    if len(times) == 0:
        return 0.0, np.zeros(2)
    period = np.median(times)
    return float(period), np.median(moves[times < 1.5 * period], axis=0)  # no line was skipped
