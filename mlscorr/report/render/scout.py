"""A first look at the cloud: an even sample of it, and how each target is turned."""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import PointCloud

SAMPLE = 600_000  # points, enough for some ten on each square metre of a wall of 1 km of street
FEWEST = 8  # points, to tell how a target is turned


@dataclass(frozen=True)
class Scouted:
    """An even sample of the cloud before and after, and unit normals (n, 3) of the targets.

    A normal is NaN where too few points lie on the target.
    """

    before: PointCloud
    after: PointCloud
    normals: np.ndarray


def scout(chunks, correction, targets, sizes):
    """Look through the cloud once, in flat memory: Scouted.

    Parameters
    ----------
    chunks : iterable of PointCloud
    correction : anything with ``apply(cloud) -> cloud``
    targets : list of dict
        Rows as report.json has them.
    sizes : (n,) array
        Of the targets. Units: m.
    """
    centres = np.array([row["observed"] for row in targets], float).reshape(-1, 3)
    near = [[] for _ in targets]
    sample, every, first = [], 1, 0
    for cloud in chunks:
        sample.append(_every(cloud, every, first))
        first += len(cloud)
        while sum(map(len, sample)) > 2 * SAMPLE:
            every *= 2
            sample = [PointCloud.concatenate(sample)[::2]]
        for k, centre in enumerate(centres):
            near[k].append(_around(cloud, centre, 0.4 * sizes[k]))
    if not sample:
        raise ValueError("The cloud has no points: there is nothing to draw.")
    before = PointCloud.concatenate(sample)
    normals = np.array([_normal(np.concatenate(parts)) for parts in near]).reshape(-1, 3)
    return Scouted(before, correction.apply(before), normals)


def _every(cloud, step, first):
    """Each step-th point of the whole cloud, of which first came in earlier chunks."""
    picked = cloud[(-first) % step :: step]
    return PointCloud.concatenate([picked])  # a copy, or the whole chunk would stay in memory


def _around(cloud, centre, radius):
    """Points within a radius of a centre: coordinates relative to it, and intensity, (n, 4)."""
    rows = np.flatnonzero(np.abs(cloud.xyz[:, 0] - centre[0]) <= radius)
    local = cloud.xyz[rows] - centre
    near = (local**2).sum(axis=1) <= radius**2
    return np.column_stack([local, cloud.intensity[rows]])[near]


def _normal(points):
    """Unit normal of the bright ones of points (n, 4), NaN for fewer than FEWEST."""
    if len(points) < FEWEST:
        return np.full(3, np.nan)
    local = points[points[:, 3] >= np.percentile(points[:, 3], 90) / 2, :3]
    if len(local) < FEWEST:
        return np.full(3, np.nan)
    centred = local - np.median(local, axis=0)
    # what stands before or behind is left out by a second fit to the nearest points
    for _ in range(2):
        normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
        away = np.abs(centred @ normal)
        centred = centred[away <= max(2.5 * np.median(away), 0.02)]
        centred = centred - centred.mean(axis=0)
    return normal
