"""First pass over the cloud: an even sample of it, and the orientation of each target."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlscorr.evaluate import TargetRow
from mlscorr.report.sample import EvenSample
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import PointCloud


@dataclass(frozen=True)
class Scouted:
    """Even sample of the cloud before and after, and unit normals (n, 3) of the targets.

    A normal is NaN if the target has too few points.
    """

    before: PointCloud
    after: PointCloud
    normals: np.ndarray


def scout(
    chunks: Iterable[PointCloud], correction: Any, targets: list[TargetRow], sizes: np.ndarray
) -> Scouted:
    """Go through the cloud once, in flat memory.

    Parameters
    ----------
    chunks : iterable of PointCloud
    correction : anything with ``apply(cloud) -> cloud``
    targets : list of TargetRow
    sizes : (n,) array
        Sizes of the targets. Units: m.

    Raises
    ------
    ValueError
        If the cloud has no points.
    """
    near = [[np.empty((0, 4))] for _ in targets]
    sample = EvenSample(SETTINGS.sample_points)
    radii = 0.4 * sizes
    centres = np.array([row.observed for row in targets]).reshape(-1, 3)
    for cloud in chunks:
        sample.add(cloud)
        low = np.array([column.min(initial=np.inf) for column in cloud.xyz.T])
        high = np.array([column.max(initial=-np.inf) for column in cloud.xyz.T])
        distance = np.maximum(low - centres, centres - high).max(axis=1)
        for k in np.flatnonzero(distance <= radii):  # not every target in every chunk
            near[k].append(_around(cloud, centres[k], radii[k]))
    if not sample.count:
        raise ValueError("The cloud has no points to draw.")
    before = PointCloud.concatenate(sample.parts)
    normals = np.array([_normal(np.concatenate(parts)) for parts in near]).reshape(-1, 3)
    return Scouted(before, correction.apply(before), normals)


def _around(cloud, centre, radius):
    """Points within a radius of a center: coordinates relative to it, and intensity, (n, 4)."""
    rows = np.flatnonzero(np.abs(cloud.xyz[:, 0] - centre[0]) <= radius)
    local = cloud.xyz[rows] - centre
    near = (local**2).sum(axis=1) <= radius**2
    return np.column_stack([local, cloud.intensity[rows]])[near]


def _normal(points):
    """Unit normal of the bright ones of points (n, 4), NaN if there are too few."""
    if len(points):
        points = points[points[:, 3] >= np.percentile(points[:, 3], 90) / 2, :3]
    if len(points) < SETTINGS.normal_points:
        return np.full(3, np.nan)
    centred = points - np.median(points, axis=0)
    # points in front or behind are excluded by a second fit to the nearest points
    for _ in range(2):
        normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
        away = np.abs(centred @ normal)
        centred = centred[away <= max(2.5 * np.median(away), 0.02)]
        centred = centred - centred.mean(axis=0)
    return normal
