"""Where scan lines cross painted markings: short bright runs of points on level ground."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from mlscorr.survey import Columns, PointCloud
from mlscorr.ties.settings import SETTINGS


@dataclass(frozen=True, eq=False, repr=False)
class Crossings(Columns):
    """Where scan lines crossed paint, n times.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    place : (n, 3) array
        The middle between both edges. Units: m.
    variance : (n,) array
        Of that along the scan line. Units: m^2.
    group : (n,) int array
        Of the file and the segment of the trajectory, as in the keys of cells.
    """

    gps_time: np.ndarray
    place: np.ndarray
    variance: np.ndarray
    group: np.ndarray


def find_crossings(cloud: PointCloud, passes: np.ndarray, group: int) -> Crossings:
    """The Crossings of a chunk whose scan lines are in order; none where beams take turns.

    Parameters
    ----------
    cloud : PointCloud
    passes : (s, 2) array
        Start and end of the trajectory's segments. Units: s.
    group : int
        Of the first segment.
    """
    limits = np.array([SETTINGS.widest_paint, SETTINGS.contrast, SETTINGS.largest_lean])
    before, first, last, after = bright_runs(cloud.xyz, cloud.intensity, limits).T
    edges = ((before, first), (last, after))
    gaps = [np.linalg.norm(cloud.xyz[a] - cloud.xyz[b], axis=1) for a, b in edges]
    time = (cloud.gps_time[first] + cloud.gps_time[last]) / 2
    segment = np.searchsorted(passes[:, 0], time, side="right") - 1
    crossings = Crossings(
        gps_time=time,
        place=(cloud.xyz[before] + cloud.xyz[first] + cloud.xyz[last] + cloud.xyz[after]) / 4,
        # each edge is anywhere between two points, as likely as elsewhere
        variance=(gaps[0] ** 2 + gaps[1] ** 2) / 48,
        group=group + segment,
    )
    return crossings[(segment >= 0) & (time <= passes[segment, 1])]


@njit(cache=True)
def bright_runs(xyz: np.ndarray, intensity: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Runs of points that are brighter than the level ground before and after them.

    Parameters
    ----------
    xyz, intensity : (n, 3), (n,) arrays
        In the order of scan lines.
    limits : (3,) array
        Widest run (m), which is how far back the ground counts too; least contrast, in sigmas of
        the ground's intensity; steepest ground.

    Returns
    -------
    (k, 4) int array
        Numbers of the last point before each run, of its first and last, and of that after it.
    """
    widest, contrast, steepest = limits
    runs = np.empty((len(xyz) // 3 + 1, 4), np.int64)
    count = 0
    first = -1
    end = -1
    known = mean = variance = width = 0.0
    for i in range(1, len(xyz)):
        x = xyz[i, 0] - xyz[i - 1, 0]
        y = xyz[i, 1] - xyz[i - 1, 1]
        z = xyz[i, 2] - xyz[i - 1, 2]
        step = np.sqrt(x * x + y * y + z * z)
        value = float(intensity[i])
        if step > widest / 5:  # fewer points don't tell the ground's intensity
            first = -1
            end = -1
            known = 0.0
            continue
        sigma = np.sqrt(variance + 1 / 12)  # of integers
        is_bright = known >= widest and value > mean + contrast * sigma
        if is_bright and first < 0:
            first = i
            width = 0.0
        if first >= 0:
            width += step
            if width > widest:  # another surface
                first = -1
                end = -1
                known = 0.0
            elif is_bright:
                end = -1
            elif end < 0:  # a single dark point may be texture
                end = i
            else:
                a = xyz[first - 1]
                b = xyz[end]
                rise = abs(b[2] - a[2])
                way = np.hypot(b[0] - a[0], b[1] - a[1])
                if end - first > 1 and rise <= steepest * way:
                    runs[count] = first - 1, first, end - 1, end
                    count += 1
                first = -1
                end = -1
            continue
        if known == 0.0:
            mean = value
            variance = 0.0
            known = step
            continue
        share = step / min(known + step, widest)
        variance = (1.0 - share) * (variance + share * (value - mean) ** 2)
        mean += share * (value - mean)
        known += step
    return runs[:count]
