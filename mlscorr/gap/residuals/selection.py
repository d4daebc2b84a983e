"""Which differences count: those near enough, those that agree, and a choice of many."""

from dataclasses import replace

import numpy as np

from mlscorr.correction import Correction
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.pos import stated_sigma
from mlscorr.survey import SEARCH_RADIUS, Survey


def moved_by(correction: Correction | None, xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """What a correction adds to points (n, 3); nothing without one. Units: m.

    Parameters
    ----------
    correction : Correction or None
    xyz, gps_time : (n, 3), (n,) array
        Units: m, s.
    """
    if correction is None:
        return np.zeros(xyz.shape)
    return correction.increments(xyz, gps_time)[0]


def places(
    survey: Survey, patches: Patches, correction: Correction | None
) -> list[tuple[Survey, Patches]]:
    """The survey and its patches as recorded, and where a correction puts them.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    correction : Correction or None
    """
    if correction is None:
        return [(survey, patches)]
    samples = patches.xyz.reshape(-1, 3)
    moved = moved_by(correction, samples, patches.time.ravel()).reshape(patches.xyz.shape)
    centre = patches.centre + moved_by(correction, patches.centre, patches.gps_time)
    near = replace(patches, centre=centre, xyz=patches.xyz + moved)
    return [(survey, patches), (replace(survey, trajectory=correction.corrected), near)]


def support(residual: np.ndarray) -> float:
    """How much speaks for the places that leave residuals (n,) in m: the nearer, the more.

    Parameters
    ----------
    residual : (n,) array
        Units: m.
    """
    return float(np.maximum(1.0 - (residual / SETTINGS.least_surface_gate) ** 2, 0.0).sum())


def gate(survey: Survey, gps_time: np.ndarray) -> np.ndarray:
    """Largest credible distance of a surface from where it should be.

    Parameters
    ----------
    survey : Survey
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n,) array
        Units: m.
    """
    sigma = stated_sigma(survey.trajectory, survey.pos, gps_time)
    size = SETTINGS.surface_gate_sigmas * np.linalg.norm(sigma.drift + sigma.held, axis=1)
    return np.clip(size, SETTINGS.least_surface_gate, SEARCH_RADIUS)


def consistent(gps_time: np.ndarray, direction: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Which differences agree with one shift of their window of time.

    What doesn't is another surface: a car, a curb that the reference lacks. The shift is the one
    of least absolute differences, by reweighting; in windows with little in them, all agree.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    direction : (n, 3) array
        Along which the differences are measured.
    residual : (n,) array
        Units: m.

    Returns
    -------
    (n,) bool array
    """
    order = np.argsort(gps_time, kind="stable")
    size = SETTINGS.plane_points  # in a street they come within a second
    group = np.arange(len(order)) // size
    moment = np.floor(gps_time[order] / SETTINGS.outlier_interval)
    begins = np.flatnonzero((np.diff(group) != 0) | (np.diff(moment) != 0)) + 1
    agree = np.ones(len(gps_time), dtype=bool)
    for rows in np.split(order, begins):
        if len(rows) >= size // 3:  # three unknowns: fewer don't tell which of them is off
            left = residual[rows] - _shift(direction[rows], residual[rows])
            scatter = 1.4826 * np.median(np.abs(left))  # a normal distribution's sigma
            agree[rows] = np.abs(left) <= max(SETTINGS.odd_distance, SETTINGS.odd_sigmas * scatter)
    return agree


def _shift(direction, residual):
    """What a shift of least absolute differences makes of each of the directions (n,). m."""
    weight = np.ones(len(residual))
    for _ in range(15):
        normal = (direction * weight[:, None]).T @ direction + 1e-3 * np.eye(3) * weight.sum()
        fitted = direction @ np.linalg.solve(normal, direction.T @ (weight * residual))
        weight = 1 / np.maximum(np.abs(residual - fitted), 1e-3)
    return fitted


def spread(columns: list[np.ndarray], limit: int, rng: np.random.Generator) -> np.ndarray:
    """Choose at most `limit` of n things, evenly spread over the values of each column.

    Each column is cut into equal bins; a thing's chance grows with the emptiness of its bins.

    Parameters
    ----------
    columns : list of (n,) arrays
    limit : int
    rng : numpy.random.Generator

    Returns
    -------
    (k,) int array
        Sorted rows.

    >>> spread([np.arange(5.0)], 10, np.random.default_rng(0))
    array([0, 1, 2, 3, 4])
    """
    n = len(columns[0])
    if n <= limit:
        return np.arange(n)
    chance = np.zeros(n)
    for values in columns:
        span = np.ptp(values)
        number = (
            (values - values.min()) / (span if span > 0 else 1.0) * SETTINGS.spread_bins
        ).astype(int)
        chance += 1 / np.bincount(number)[number]
    keys = rng.exponential(size=n) / chance  # the least of these are a sample without replacement
    return np.sort(np.argpartition(keys, limit)[:limit])
