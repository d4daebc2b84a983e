"""Painted lines and dashes, from the crossings of scan lines brighter than the adjacent road."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mlscorr.compiled_loops import loop
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns, PointCloud, TieFeatures


@dataclass(frozen=True, eq=False, repr=False)
class Crossings(Columns):
    """Crossings of scan lines with paint, n of them.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    place : (n, 3) array
        Middle between both edges. Units: m.
    variance : (n,) array
        Variance of it along the scan line. Units: m^2.
    group : (n,) int array
        Group of the file and the trajectory's segment, as in the keys of cells.
    """

    gps_time: np.ndarray
    place: np.ndarray
    variance: np.ndarray
    group: np.ndarray


def find_crossings(cloud: PointCloud, passes: np.ndarray, group: int) -> Crossings:
    """Find the crossings in a chunk with ordered scan lines; none if beams alternate.

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
        # each edge is uniformly distributed between two points
        variance=(gaps[0] ** 2 + gaps[1] ** 2) / 48,
        group=group + segment,
    )
    return crossings[(segment >= 0) & (time <= passes[segment, 1])]


@loop
def bright_runs(xyz: np.ndarray, intensity: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Runs of points that are brighter than the level ground before and after them.

    Parameters
    ----------
    xyz, intensity : (n, 3), (n,) arrays
        In the order of scan lines.
    limits : (3,) array
        Widest run (m), also the length of ground that counts; smallest contrast, in sigmas of the
        ground's intensity; steepest ground.

    Returns
    -------
    (k, 4) int array
        Indices of the last point before each run, of its first and last point, and of the point
        after it.
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
        if step > widest / 5:  # too few points to show the ground's intensity
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
                distance = np.hypot(b[0] - a[0], b[1] - a[1])
                if end - first > 1 and rise <= steepest * distance:
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


@dataclass(frozen=True, eq=False, repr=False)
class Stripes(Columns):
    """Straight lines through the crossings of n pieces of paint.

    Parameters
    ----------
    group : (n,) int array
        Of its crossings.
    count : (n,) int array
        Of its crossings.
    gps_time : (n,) array
        Mean of them. Units: s.
    centre : (n, 3) array
        Mean of them. Units: m.
    along : (n, 3) array
        Unit vector, level.
    ends : (n, 2) array
        Extent along that direction from the center. Units: m.
    begin, end : (n,) array
        Times of the first and last observation. Units: s.
    length, width : (n,) array
        Variances of the crossings along and across. Units: m^2.
    pace : (n,) array
        Gradient of time along. Units: s/m.
    edges : (n,) array
        Mean variance of a crossing. Units: m^2.
    """

    group: np.ndarray
    count: np.ndarray
    gps_time: np.ndarray
    centre: np.ndarray
    along: np.ndarray
    ends: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    length: np.ndarray
    width: np.ndarray
    pace: np.ndarray
    edges: np.ndarray


def find_markings(crossings: Crossings, start: float) -> TieFeatures:
    """Painted lines, a cell of each in a row, and dashes, both of whose ends were seen.

    Parameters
    ----------
    crossings : Crossings
        All of their windows.
    start : float
        Of moments and windows. Units: s.

    Returns
    -------
    TieFeatures
        The group is that of pass_number and scanner.
    """
    since = crossings.gps_time - start
    whole = _connected(crossings, interval_of(since))
    moment = np.floor(since / SETTINGS.moment)
    pieces = _numbered(whole, moment, np.floor(crossings.place[:, :2] / SETTINGS.cell))
    dashes = _with_both_ends(fit_stripes(crossings, whole), start)
    return TieFeatures.concatenate([_lines(fit_stripes(crossings, pieces)), _dashes(dashes)])


def _lines(pieces):
    """Pieces of lines: where they are across."""
    # what all crossings share of their edges doesn't scatter; across the line it is less than along
    # the scan lines, but for those that cross straight
    variance = np.maximum(pieces.edges - pieces.width, 0.0) + pieces.width / pieces.count
    across = np.cross(pieces.along, [0.0, 0.0, 1.0])
    return _features("line", pieces, pieces.centre, across, variance, np.sqrt(pieces.length))


def _dashes(dashes):
    """Dashes: where the middle between their ends is along."""
    centre = dashes.centre + dashes.ends.mean(axis=1)[:, None] * dashes.along
    size = np.diff(dashes.ends)[:, 0]
    # either end is anywhere between two scan lines, as likely as elsewhere
    variance = (size / (dashes.count - 1)) ** 2 / 24
    return _features("dash", dashes, centre, dashes.along, variance, size / np.sqrt(12))


def _features(kind, stripes, centre, direction, variance, extent):
    return TieFeatures(
        pass_number=stripes.group,
        scanner=stripes.group,
        kind=np.full(len(stripes), kind),
        gps_time=stripes.gps_time,
        centre=centre,
        direction=direction,
        variance=variance,
        tilt=stripes.width / stripes.count / stripes.length,
        extent=extent,
        points=stripes.count,
        sweep=stripes.pace[:, None] * stripes.along,
    )


def interval_of(since: np.ndarray) -> np.ndarray:
    """Number (n,) of the window in which paint is followed: a dash is cut in few of them.

    Parameters
    ----------
    since : (n,) array
        The start. Units: s.
    """
    return np.floor(since / SETTINGS.pause)


def _with_both_ends(dashes, start):
    """Tracks observed at once, and entirely in one window: two lost crossings are no end."""
    took = dashes.end - dashes.begin
    margin = 3 * took / (dashes.count - 1)
    begin, end = (interval_of(t - start) for t in (dashes.begin - margin, dashes.end + margin))
    return dashes[(begin == end) & (took <= SETTINGS.moment)]


def _numbered(*columns):
    """Number (n,) from 0 of each different row of columns (n,) or (n, k)."""
    return np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1].ravel()


def _connected(crossings, interval):
    """Number (n,) of what each crossing is of: those near each other in a window of a group."""
    if len(crossings) == 0:
        return np.empty(0, int)
    radius = SETTINGS.cell / 2
    key = _numbered(crossings.group, interval)
    place = crossings.place[:, :2] - crossings.place[0, :2]
    tree = cKDTree(np.column_stack([place, 2 * radius * key]))
    pairs = tree.query_pairs(radius, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), (len(place), len(place)))
    return connected_components(links, directed=False)[1]


def fit_stripes(crossings: Crossings, number: np.ndarray) -> Stripes:
    """The Stripes of pieces of paint that are long and straight.

    Parameters
    ----------
    crossings : Crossings
    number : (n,) int array
        Of each one's piece, from 0.
    """
    count = np.bincount(number)
    place = crossings.place
    time = crossings.gps_time

    def mean(values):
        return np.bincount(number, values) / np.maximum(count, 1)

    rows = np.full(len(count), len(number))
    np.minimum.at(rows, number, np.arange(len(number)))
    origin = place[rows]
    centre = origin + np.column_stack([mean(c) for c in (place - origin[number]).T])
    gps_time = time[rows] + mean(time - time[rows][number])
    x, y, _ = (place - centre[number]).T
    covariance = np.stack([mean(x * x), mean(x * y), mean(x * y), mean(y * y)], axis=1)
    values, axes = np.linalg.eigh(covariance.reshape(-1, 2, 2))
    along = np.column_stack([axes[:, :, 1], np.zeros(len(count))])
    distance = x * along[number, 0] + y * along[number, 1]
    ends, times = (np.tile([np.inf, -np.inf], (len(count), 1)) for _ in range(2))
    for extremes, column in ((ends, distance), (times, time)):
        np.minimum.at(extremes[:, 0], number, column)
        np.maximum.at(extremes[:, 1], number, column)
    length = np.maximum(values[:, 1], SETTINGS.rounding**2)
    stripes = Stripes(
        group=crossings.group[rows],
        count=count,
        gps_time=gps_time,
        centre=centre,
        along=along,
        ends=ends,
        begin=times[:, 0],
        end=times[:, 1],
        length=length,
        width=np.maximum(values[:, 0], 0.0) * count / np.maximum(count - 2, 1),
        pace=mean((time - gps_time[number]) * distance) / length,
        edges=mean(crossings.variance),
    )
    kept = (count >= SETTINGS.crossings) & (stripes.width <= SETTINGS.roughest**2)
    return stripes[kept & (stripes.length >= SETTINGS.narrowest**2)]
