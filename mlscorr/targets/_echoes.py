"""State of each beam at the plane of a target: bright return, dark return, or passed by.

A plate in the air has no darker neighbors in its plane, but beams that returned from behind it give
the same information. If nothing returned, the next pulse of the scan line, or the same pulse one
line later, shows the direction of the missing beam.
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
        Relative to any origin. Units: m.
    gps_time : (n,) array
        Units: s.
    intensity : (n,) array
    path : ScannerPath
        Path of the scanner, relative to the same origin.
    tolerance : float
        Points within this distance of a plane are on it. Units: m.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    path: ScannerPath
    tolerance: float

    def sight(self, rows: np.ndarray | slice) -> np.ndarray:
        """Return the vectors scanner to point (k, 3) of some rows. Units: m."""
        return self.xyz[rows] - self.path.at(self.gps_time[rows])


def beams_at_plane(
    echoes: Echoes, plane: Plane, middle: np.ndarray, radius: float, threshold: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Beams that met the plane near a position or passed it; beams stopped in front are ignored.

    Parameters
    ----------
    echoes : Echoes
    plane : Plane
    middle : (2,) array
        Position in the plane. Units: m.
    radius : float
        Units: m.
    threshold : float
        Threshold of intensity: bright from this value.

    Returns
    -------
    crossings : (k, 2) array
        Sorted by time. Units: m.
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
    """Rows (k,) of these beams, and flags of those that ended on the plane; called thousands of
    times.
    """
    origin, axes, middle, radius = place
    epochs, scanner = path
    rows = np.empty(len(xyz), np.int64)
    on_plane = np.empty(len(xyz), np.bool_)
    count = 0
    # the plane, seen from the scanner
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
    """Positions in the plane where beams adjacent to the target's points had no return.

    Parameters
    ----------
    echoes : Echoes
    rows : (n,) int array
        Points on the target.
    plane : Plane

    Returns
    -------
    (k, 2) array
        Units: m. Empty if the target has fewer than two scan lines, or if pulses are not regular
        within a line (scanners with several beams).
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
    if np.linalg.norm(advance) > np.linalg.norm(step) / 4:  # otherwise the vehicle stands still
        neighbours += [(lines[-1], period, advance), (lines[0], -period, -advance)]
    missed = [
        uv[at][~_returned(echoes, echoes.gps_time[rows[at]] + lag, pulse)] + move
        for at, lag, move in neighbours
    ]
    return np.concatenate(missed)


def _returned(echoes, time, pulse):
    """Flag (n,) of times at which a point of the pulse exists."""
    right = np.clip(np.searchsorted(echoes.gps_time, time), 1, len(echoes.gps_time) - 1)
    left = echoes.gps_time[right - 1]
    return np.minimum(np.abs(time - left), np.abs(echoes.gps_time[right] - time)) < 0.6 * pulse


def _scan_lines(gps_time):
    """Interval of pulses (s), and scan lines as index arrays of points without a longer pause.

    The interval is 0 if many points share a time, because their order is unknown.
    """
    steps = np.diff(gps_time)
    if np.median(steps) <= 0:
        return 0.0, []
    pulse = float(np.percentile(steps[steps > 0], 25))
    breaks = np.flatnonzero(steps > 12 * pulse) + 1  # a few lost returns do not end a line
    return pulse, np.split(np.arange(len(gps_time)), breaks)


def _line_advance(gps_time, uv, lines, step):
    """Time (s) and motion (2,) in m from a point to the corresponding point on the next scan
    line.
    """
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
