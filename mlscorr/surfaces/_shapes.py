"""Planes and poles among cells, from the moments of their points only."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.frames import scanner_position
from mlscorr.surfaces.cells import (
    COLUMN_AXES,
    ROW_AXES,
    Cells,
    neighbour_covariances,
)
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns, Survey, TieFeatures

# The scanner measures the facing half of a pole, with points evenly spread across the beam. Their
# mean is pi / 4 of the radius in front of the axis, their variance is radius^2 / 3 across and (2/3
# - pi^2 / 16) radius^2 along the beam. For a square pole turned by a, with two visible sides, it is
# 1 / (1 + sin 2 a) of half its width in front: 2 / pi on average.
DEPTH = np.pi / 4
SQUARE_DEPTH = 2 / np.pi
ACROSS = 1 / 3
ALONG = 2 / 3 - np.pi**2 / 16


@dataclass(frozen=True, eq=False, repr=False)
class Shapes(Columns):
    """Planes or poles of cells: fields of TieFeatures, and shifts to their centers.

    Parameters
    ----------
    rows : (n,) int array
        Rows of the cells.
    direction : (n, 3) array
    variance, tilt, extent : (n,) array
    shift : (n, 3) array
        From the mean of the points to the center. Units: m.
    """

    rows: np.ndarray
    direction: np.ndarray
    variance: np.ndarray
    tilt: np.ndarray
    extent: np.ndarray
    shift: np.ndarray


def find_shapes(survey: Survey, cells: Cells) -> TieFeatures:
    """Find the planes and poles among cells.

    Parameters
    ----------
    survey : Survey
    cells : Cells
        Their group is used as pass_number and scanner of the result.
    """
    cells, step = join_across_faces(cells)
    full = np.flatnonzero(cells.points >= SETTINGS.feature_points)
    covariance = cells[full].covariance
    # lambda_0 is not below det / (sum of the principal minors); saves the axes of non-planar cells
    minors = (np.trace(covariance, axis1=1, axis2=2) ** 2 - (covariance**2).sum(axis=(1, 2))) / 2
    is_thin = np.linalg.det(covariance) <= SETTINGS.roughest**2 * minors
    is_thin |= covariance[:, 0, 0] + covariance[:, 1, 1] <= SETTINGS.thickest**2
    rows = full[is_thin]
    cells = cells[rows]
    step = step[rows]
    values, axes = np.linalg.eigh(covariance[is_thin])
    values = np.maximum(values, SETTINGS.rounding**2)  # points of a file may coincide
    moments = cells.moments
    sight = cells.centre - scanner_position(survey.trajectory, survey.mounting, cells.gps_time)
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    noise = neighbour_covariances(moments)
    # unordered points, or alternating beams
    noise[~_is_ordered(moments)] = survey.scanner.range_noise**2 * np.eye(3)
    planes = _planes(moments, values, axes, noise, sight)
    poles = _poles(moments, values, axes, noise, sight, step)
    poles = poles[_stacked(cells[poles.rows])]
    rows = np.concatenate([planes.rows, poles.rows])
    shapes = Shapes.concatenate([planes, poles])
    kind = np.repeat(["plane", "pole"], [len(planes), len(poles)])
    return TieFeatures(
        pass_number=cells.group[rows],
        scanner=cells.group[rows],
        kind=kind,
        gps_time=cells.gps_time[rows],
        centre=cells.middle[rows] + (cells.offset[rows] + shapes.shift),
        direction=shapes.direction,
        variance=shapes.variance,
        tilt=shapes.tilt,
        extent=shapes.extent,
        points=cells.points[rows].astype(int),
        sweep=_sweep(moments[rows], values[rows], axes[rows], kind == "pole"),
    )


def _sweep(moments, values, axes, is_pole):
    """Gradient (n, 3) of the points' times over planes, or along poles. Units: s/m."""
    along = np.einsum("nik,ni->nk", axes, _with_time(moments)) / values
    along[:, 0] = 0.0
    along[is_pole, 1] = 0.0
    return np.einsum("nik,nk->ni", axes, along)


def _with_time(moments):
    """Covariances (n, 3) of the points' places with their times. Units: m s."""
    count = moments[:, :1]
    return moments[:, 18:21] / count - moments[:, 1:2] * moments[:, 2:5] / count**2


def _planes(moments, values, axes, noise, sight):
    """Find planes among the cells."""
    normal = axes[:, :, 0]
    points = moments[:, 0]
    variance, of_mean = _scatter(values[:, 0], moments, _along(normal, noise))
    slant = np.einsum("ni,ni->n", normal, sight)
    is_plane = (variance <= SETTINGS.roughest**2) & (values[:, 1] >= SETTINGS.narrowest**2)
    is_plane &= np.abs(slant) >= SETTINGS.least_plane_sine
    direction = normal * -np.sign(slant)[:, None]
    shift = np.zeros_like(normal)
    narrow = values[:, 1]
    rows = np.arange(len(points))
    shapes = Shapes(rows, direction, of_mean, of_mean / narrow, np.sqrt(narrow), shift)
    return shapes[is_plane]


def _scatter(variance, moments, between):
    """Variance about a plane (n,), and variance of its mean. Units: m^2.

    Differences of neighbors on a scan line are independent noise; the rest is the surface.
    Neighbors that correlate by 1 - 1 / ripple, as in a first-order autoregression, reduce the
    points of a line to 1 / (2 ripple - 1) independent ones. The surface is equally smooth across
    the lines, so a curved or broken one is a single sample, whose mean is as uncertain as its
    roughness.
    """
    points = moments[:, 0]
    variance = variance * points / (points - 3)
    between = np.clip(between, SETTINGS.rounding**2, variance)
    lines = _lines(moments)
    pieces = np.maximum(points / lines / (2 * variance / between - 1), 1.0)
    pieces = pieces * np.minimum(lines, pieces)
    return variance, between / points + (variance - between) / pieces


def _lines(moments):
    """Number of scan lines (n,); estimated if the order of points does not show them."""
    points = moments[:, 0]
    followers = moments[:, 11]
    return np.where(_is_ordered(moments), points - followers, np.sqrt(points))


def _is_ordered(moments):
    """Flag (n,) of cells with enough consecutive points to determine their noise."""
    return moments[:, 11] >= moments[:, 0] / 4


def _poles(moments, values, axes, noise, sight, step):
    """Find poles among the cells that contain nothing else."""
    points = moments[:, 0]
    axis = axes[:, :, 2] * np.where(axes[:, 2, 2:] < 0, -1.0, 1.0)
    across = np.cross(axis, sight)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), SETTINGS.least_plane_sine)
    beam = np.cross(across, axis)
    matrix = np.einsum("nik,nk,njk->nij", axes, values, axes)
    side = _along(across, matrix)
    deep = _along(beam, matrix)
    between = _along(beam, noise)
    radius = np.sqrt(side / ACROSS)
    # ratio of variances, depth over width: 1/7 for a round pole; 1/5 to 1/3 for a square one with
    # two visible sides, turned by 5 deg or more; 1/20 for a cut arc; 0 for an oblique strip; 1 for
    # a bush
    is_thick = values[:, 0] >= values[:, 1] / 10
    is_round = deep <= 1.5 * ALONG * radius**2 + 2 * between
    depth = np.where(is_round, DEPTH, SQUARE_DEPTH)
    is_pole = is_round | is_thick & (deep <= side / 2 + 2 * between)
    is_pole &= (values[:, 2] >= 2 * SETTINGS.narrowest**2) & (radius <= SETTINGS.thickest)
    is_pole &= axis[:, 2] >= np.cos(SETTINGS.largest_lean)
    # an object at the border of its cell or moment continues beyond: it is cut, and its mean is
    # biased. The border of a uniform strip is sqrt(3) sigmas away, with few points up to 2.5. A
    # thick object is joined with the part beyond and has the same width there; a flat one may be
    # the edge of a wall
    spread = np.sqrt(np.einsum("nii->ni", matrix)[:, :2])
    spread = np.where(is_thick[:, None], spread.max(axis=1, keepdims=True), spread)
    step = np.where(is_thick[:, None], step[:, :2], 0.0)
    from_middle = moments[:, 2:4] / points[:, None] - step * SETTINGS.cell / 2
    to_border = (1 + np.abs(step)) * SETTINGS.cell / 2 - np.abs(from_middle)
    is_pole &= (to_border >= 2.5 * spread).all(axis=1)
    time = np.einsum("ni,ni->n", across, _with_time(moments)) / np.sqrt(np.maximum(side, 1e-12))
    to_end = SETTINGS.moment / 2 - np.abs(moments[:, 1] / points - SETTINGS.moment / 2)
    is_pole &= to_end >= 2.5 * np.abs(time)
    of_radius = radius**2 / (5 * points)  # variance^2 of a uniform distribution is known to 0.8 / m
    # for evenly spaced scan lines the middle is uncertain by half a step; a single one gives no
    # width
    lines = _lines(moments)
    is_pole &= lines > 1
    variance = side / lines**2 + depth**2 * of_radius + (SETTINGS.roundness * radius) ** 2
    tilt = side / lines**2 / values[:, 2]
    extent = np.sqrt(values[:, 2])
    shift = (depth * radius)[:, None] * beam
    rows = np.arange(len(points))
    return Shapes(rows, axis, variance, tilt, extent, shift)[is_pole]


def _along(vector, matrix):
    """Quadratic forms v' M v (n,) of vectors (n, 3) and matrices (n, 3, 3)."""
    return np.einsum("ni,nij,nj->n", vector, matrix, vector)


def _stacked(cells):
    """Flag (n,) of poles that continue in the cell above or below, unlike people and bollards."""
    order = np.lexsort([*cells.middle.T[::-1], cells.begin, cells.group])
    column = np.column_stack([cells.middle, cells.begin, cells.group])[order]
    goes_on = (np.diff(column, axis=0) == [0, 0, SETTINGS.cell, 0, 0]).all(axis=1)
    stacked = np.zeros(len(order), bool)
    stacked[order[1:][goes_on]] = stacked[order[:-1][goes_on]] = True
    return stacked


def join_across_faces(cells: Cells) -> tuple[Cells, np.ndarray]:
    """Join cells that share a plane or pole in their common face.

    Otherwise each would contain half of the plane's noise, with a mean 0.8 sigmas off the plane, or
    a part of the pole, with a biased middle.

    Parameters
    ----------
    cells : Cells

    Returns
    -------
    joined : Cells
        A cell that was merged into another one has no points.
    step : (n, 3) array
        Step to the cells beyond whose points are included, if there are any. Units: cells.
    """
    moments = cells.moments
    points = moments[:, 0]
    mean = moments[:, 2:5] / points[:, None]
    spread = moments[:, [5, 8, 10]] / points[:, None] - mean**2
    spread = np.sqrt(np.maximum(spread, SETTINGS.rounding**2))
    # a pole's points are spread by its radius over sqrt(3) in both axes, unlike a wall's, and more
    # along the pole. A cell may contain one side of a square pole, which is equally wide beyond it
    widest = np.minimum(SETTINGS.thickest / np.sqrt(3), spread[:, 2:])
    is_pole = (spread[:, :2] <= widest).all(axis=1, keepdims=True)
    spread[:, :2] = np.where(is_pole, spread[:, :2].max(axis=1, keepdims=True), spread[:, :2])
    is_thin = (spread <= SETTINGS.roughest) | (is_pole & [True, True, False])
    # 99 % of a plane's noise is within 2.5 sigmas
    is_cut = is_thin & (points >= SETTINGS.feature_points)[:, None]
    is_cut &= SETTINGS.cell / 2 - np.abs(mean) < 2.5 * spread
    rank = np.argsort(np.argsort(points, kind="stable"))
    joined = moments.copy()
    steps = np.zeros_like(mean)
    for axis in np.flatnonzero(is_cut.any(axis=0)):
        rows = np.flatnonzero(is_cut[:, axis])
        step = np.sign(mean[rows, axis, None]) * np.eye(3)[axis]
        steps[rows] += step
        beyond = _cells_at(cells, rows, step)
        rows, beyond, step = (part[beyond >= 0] for part in (rows, beyond, step))
        is_half = is_cut[beyond, axis] & (mean[beyond, axis] * step[:, axis] < 0)
        kept = ~(is_half & (rank[rows] < rank[beyond]))  # the smaller half contributes there
        rows, beyond, step, is_half = (part[kept] for part in (rows, beyond, step, is_half))
        joined[rows] += _moved(joined[beyond], SETTINGS.cell * step)
        joined[beyond[is_half]] = 0.0
    return replace(cells, moments=joined), steps


def _cells_at(cells, rows, step):
    """Rows (k,) of the cells a given step (k, 3) from rows, in the same moment and group; or -1."""
    corner = cells.middle.min(axis=0)
    place = np.round((cells.middle - corner) / SETTINGS.cell).astype(np.int64) + 1
    moment = np.column_stack([cells.begin, cells.group])
    own = np.unique(moment, axis=0, return_inverse=True)[1].ravel()
    size = (own.max() + 1, *(place.max(axis=0) + 2))
    keys = np.ravel_multi_index((own, *place.T), size)
    partner = np.ravel_multi_index((own[rows], *(place[rows] + step.astype(np.int64)).T), size)
    order = np.argsort(keys)
    nearest = order[np.minimum(np.searchsorted(keys, partner, sorter=order), len(keys) - 1)]
    return np.where(keys[nearest] == partner, nearest, -1)


def _moved(moments, shift):
    """Moments (k, 22) about the middles of other cells, given a shift (k, 3). Units: m."""
    points = moments[:, :1]
    sums = moments[:, 2:5]
    moved = moments.copy()
    moved[:, 2:5] += points * shift
    cross = sums[:, ROW_AXES] * shift[:, COLUMN_AXES] + shift[:, ROW_AXES] * sums[:, COLUMN_AXES]
    moved[:, 5:11] += cross + points * shift[:, ROW_AXES] * shift[:, COLUMN_AXES]
    moved[:, 18:21] += moments[:, 1:2] * shift
    return moved
