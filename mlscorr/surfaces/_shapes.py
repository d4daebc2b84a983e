"""Planes and poles among cells, from the moments of their points alone."""

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

# Visible is the half of a pole that faces the scanner, its points evenly spread across the beam:
# their mean lies pi / 4 of the radius before the axis, their variance across is radius^2 / 3, and
# that along the beam (2/3 - pi^2 / 16) radius^2. Of a square one that shows two sides they lie
# 1 / (1 + sin 2 a) of half its width before it, turned by a: 2 / pi on average.
DEPTH = np.pi / 4
SQUARE_DEPTH = 2 / np.pi
ACROSS = 1 / 3
ALONG = 2 / 3 - np.pi**2 / 16


@dataclass(frozen=True, eq=False, repr=False)
class Shapes(Columns):
    """Planes or poles of cells: as in TieFeatures, and where their centres are.

    Parameters
    ----------
    rows : (n,) int array
        Of the cells.
    direction : (n, 3) array
    variance, tilt, extent : (n,) array
    shift : (n, 3) array
        From the mean of the points to the centre. Units: m.
    """

    rows: np.ndarray
    direction: np.ndarray
    variance: np.ndarray
    tilt: np.ndarray
    extent: np.ndarray
    shift: np.ndarray


def find_shapes(survey: Survey, cells: Cells) -> TieFeatures:
    """The planes and poles among cells.

    Parameters
    ----------
    survey : Survey
    cells : Cells
        Their group stands for pass_number and scanner in what is returned.
    """
    cells, step = join_across_faces(cells)
    full = np.flatnonzero(cells.points >= SETTINGS.feature_points)
    covariance = cells[full].covariance
    # lambda_0 is not below det / (sum of the principal minors): spares what is no plane its axes
    minors = (np.trace(covariance, axis1=1, axis2=2) ** 2 - (covariance**2).sum(axis=(1, 2))) / 2
    is_thin = np.linalg.det(covariance) <= SETTINGS.roughest**2 * minors
    is_thin |= covariance[:, 0, 0] + covariance[:, 1, 1] <= SETTINGS.thickest**2
    rows = full[is_thin]
    cells = cells[rows]
    step = step[rows]
    values, axes = np.linalg.eigh(covariance[is_thin])
    values = np.maximum(values, SETTINGS.rounding**2)  # points of a file may be the same
    moments = cells.moments
    sight = cells.centre - scanner_position(survey.trajectory, survey.mounting, cells.gps_time)
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    noise = neighbour_covariances(moments)
    # points in no order, or beams that take turns
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
    """Planes among the cells."""
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
    """Variance about a plane (n,), and that of its mean. Units: m^2.

    What neighbours on a scan line differ by is noise, and independent; the rest is the surface.
    Neighbours that correlate by 1 - 1 / ripple, as in a first-order autoregression, leave of the
    points of a line 1 / (2 ripple - 1). Across the lines the surface is as smooth as along them:
    what is curved or broken is in a piece, and its mean no better than its roughness.
    """
    points = moments[:, 0]
    variance = variance * points / (points - 3)
    between = np.clip(between, SETTINGS.rounding**2, variance)
    lines = _lines(moments)
    pieces = np.maximum(points / lines / (2 * variance / between - 1), 1.0)
    pieces = pieces * np.minimum(lines, pieces)
    return variance, between / points + (variance - between) / pieces


def _lines(moments):
    """Number of scan lines (n,); a guess where the order of points does not show them."""
    points = moments[:, 0]
    followers = moments[:, 11]
    return np.where(_is_ordered(moments), points - followers, np.sqrt(points))


def _is_ordered(moments):
    """Cells (n,) in which enough points follow another one to show their noise."""
    return moments[:, 11] >= moments[:, 0] / 4


def _poles(moments, values, axes, noise, sight, step):
    """Poles among the cells that have nothing else."""
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
    # by variance a round pole is a seventh as thick as wide; a square one, turned by 5 deg or more,
    # shows two sides, a fifth as thick as wide and up to a third as deep; a cut arc is a
    # twentieth as thick as wide, a strip seen askew not at all, and a bush as deep as wide
    is_thick = values[:, 0] >= values[:, 1] / 10
    is_round = deep <= 1.5 * ALONG * radius**2 + 2 * between
    depth = np.where(is_round, DEPTH, SQUARE_DEPTH)
    is_pole = is_round | is_thick & (deep <= side / 2 + 2 * between)
    is_pole &= (values[:, 2] >= 2 * SETTINGS.narrowest**2) & (radius <= SETTINGS.thickest)
    is_pole &= axis[:, 2] >= np.cos(SETTINGS.largest_lean)
    # what touches the border of its cell or moment goes on beyond: it is cut, and its mean is not
    # the whole's. Of an even strip the border is sqrt(3) sigmas away, by few points up to 2.5. What
    # is thick is joined with what is beyond, and as wide there; what is flat may be a wall's border
    spread = np.sqrt(np.einsum("nii->ni", matrix)[:, :2])
    spread = np.where(is_thick[:, None], spread.max(axis=1, keepdims=True), spread)
    step = np.where(is_thick[:, None], step[:, :2], 0.0)
    from_middle = moments[:, 2:4] / points[:, None] - step * SETTINGS.cell / 2
    to_border = (1 + np.abs(step)) * SETTINGS.cell / 2 - np.abs(from_middle)
    is_pole &= (to_border >= 2.5 * spread).all(axis=1)
    time = np.einsum("ni,ni->n", across, _with_time(moments)) / np.sqrt(np.maximum(side, 1e-12))
    to_end = SETTINGS.moment / 2 - np.abs(moments[:, 1] / points - SETTINGS.moment / 2)
    is_pole &= to_end >= 2.5 * np.abs(time)
    of_radius = radius**2 / (5 * points)  # a uniform distribution's variance^2 is known to 0.8 / m
    # evenly spaced, scan lines leave the middle open by half of a step; one shows no width
    lines = _lines(moments)
    is_pole &= lines > 1
    variance = side / lines**2 + depth**2 * of_radius + (SETTINGS.roundness * radius) ** 2
    tilt = side / lines**2 / values[:, 2]
    extent = np.sqrt(values[:, 2])
    shift = (depth * radius)[:, None] * beam
    rows = np.arange(len(points))
    return Shapes(rows, axis, variance, tilt, extent, shift)[is_pole]


def _along(vector, matrix):
    """The forms v' M v (n,) of vectors (n, 3) and matrices (n, 3, 3)."""
    return np.einsum("ni,nij,nj->n", vector, matrix, vector)


def _stacked(cells):
    """Poles (n,) that go on in the cell above or below: people and bollards don't."""
    order = np.lexsort([*cells.middle.T[::-1], cells.begin, cells.group])
    column = np.column_stack([cells.middle, cells.begin, cells.group])[order]
    goes_on = (np.diff(column, axis=0) == [0, 0, SETTINGS.cell, 0, 0]).all(axis=1)
    stacked = np.zeros(len(order), bool)
    stacked[order[1:][goes_on]] = stacked[order[:-1][goes_on]] = True
    return stacked


def join_across_faces(cells: Cells) -> tuple[Cells, np.ndarray]:
    """Cells, of which those of two that share a plane or pole in their face are joined.

    Each would hold half of the plane's noise, whose mean lies 0.8 sigmas off the plane, or a part
    of the pole, whose middle is not the whole's.

    Parameters
    ----------
    cells : Cells

    Returns
    -------
    joined : Cells
        A cell that another one took up has no points.
    step : (n, 3) array
        To the cells beyond, whose points stand in each one too, if there are any. Units: cells.
    """
    moments = cells.moments
    points = moments[:, 0]
    mean = moments[:, 2:5] / points[:, None]
    spread = moments[:, [5, 8, 10]] / points[:, None] - mean**2
    spread = np.sqrt(np.maximum(spread, SETTINGS.rounding**2))
    # a pole's points are spread by its radius over sqrt(3), which along both axes no wall's are,
    # and more along it; of a square one a cell may hold one side, beyond which it is as wide
    widest = np.minimum(SETTINGS.thickest / np.sqrt(3), spread[:, 2:])
    is_pole = (spread[:, :2] <= widest).all(axis=1, keepdims=True)
    spread[:, :2] = np.where(is_pole, spread[:, :2].max(axis=1, keepdims=True), spread[:, :2])
    is_thin = (spread <= SETTINGS.roughest) | (is_pole & [True, True, False])
    # 99 % of a plane's noise lies within 2.5 sigmas
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
        kept = ~(is_half & (rank[rows] < rank[beyond]))  # the smaller half takes part there
        rows, beyond, step, is_half = (part[kept] for part in (rows, beyond, step, is_half))
        joined[rows] += _moved(joined[beyond], SETTINGS.cell * step)
        joined[beyond[is_half]] = 0.0
    return replace(cells, moments=joined), steps


def _cells_at(cells, rows, step):
    """Rows (k,) of the cells some steps (k, 3) from rows, of their moment and group; or -1."""
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
    """Moments (k, 22) about the middles of other cells, a shift (k, 3) before. Units: m."""
    points = moments[:, :1]
    sums = moments[:, 2:5]
    moved = moments.copy()
    moved[:, 2:5] += points * shift
    cross = sums[:, ROW_AXES] * shift[:, COLUMN_AXES] + shift[:, ROW_AXES] * sums[:, COLUMN_AXES]
    moved[:, 5:11] += cross + points * shift[:, ROW_AXES] * shift[:, COLUMN_AXES]
    moved[:, 18:21] += moments[:, 1:2] * shift
    return moved
