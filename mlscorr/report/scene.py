"""A thinned cloud with trajectory and targets, as the data of a view that can be turned."""

import base64

import numpy as np

from mlscorr.report.look import break_at_gaps, thin
from mlscorr.report.render.quantities import PERCENTILES, colour_table
from mlscorr.report.tables import group
from mlscorr.survey import PointCloud

EVEN = 36_000  # points, spread evenly over the scene
CLOSE = 24_000  # points, near the targets
MANY = 400_000  # points that the even ones are chosen from
ON_IT, NEAR = 0.8, 3.0  # m from a target, where most and where more points are shown
EPOCHS = 1500  # of the trajectory
LARGEST = 200.0  # m, edge of a cell


def turnable(correction, cloud, targets, near):
    """The scene before and after a correction: content of a JSON document.

    Arrays are base64 of little-endian float32 (x, y, z in m about origin) or uint8.

    Parameters
    ----------
    correction : Correction
    cloud : PointCloud
        A sample of the cloud as recorded.
    targets : list of dict
        Rows of report.json, which are all drawn.
    near : list of dict
        Those near which the cloud is shown more densely.
    """
    even, spacing = thin_evenly(cloud.xyz)
    rows = np.concatenate([even, near_rows(cloud.xyz, near)])
    picked = cloud[rows]
    moved = correction.apply(picked).xyz
    origin = np.round(np.median(picked.xyz, axis=0))
    return {
        "origin": origin.tolist(),
        "even": len(even),
        "spacing": spacing,
        "before": packed(picked.xyz - origin),
        "after": packed(moved - origin),
        "intensity": scaled(picked.intensity),
        "height": scaled(moved[:, 2]),
        "colours": {name: packed(colour_table(name), "u1") for name in ("intensity", "height")},
        "trajectory": [packed(line - origin) for line in _lines(correction)],
        "targets": _targets(correction, targets, origin),
    }


def thin_evenly(xyz, most=EVEN):
    """Rows of at most so many points, one in each occupied cell of a grid, and the cells' edge.

    Units: m. No random numbers: the first point of a cell stands for it.
    """
    sample = np.arange(0, len(xyz), max(1, len(xyz) // MANY))
    local = xyz[sample] - xyz[sample].min(axis=0)
    edge = 0.05
    while len(rows := _one_each(local, edge)) > most and edge < LARGEST:
        edge *= max(1.05, np.sqrt(len(rows) / most))  # surfaces: four times fewer at twice the edge
    return sample[rows[:most]], float(edge)


def _one_each(local, edge):
    cell = (local / edge).astype(np.int64)
    size = cell.max(axis=0) + 1
    number = (cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]
    return np.sort(np.unique(number, return_index=True)[1])


def near_rows(xyz, targets, most=CLOSE):
    """Rows of points on and about targets, at most so many over all."""
    found = [np.empty(0, int)]
    for row in targets:
        half = most // len(targets) // 2
        centre = np.array(row["observed"])
        rows = np.flatnonzero(np.abs(xyz[:, 0] - centre[0]) <= NEAR)
        away = np.linalg.norm(xyz[rows] - centre, axis=1)
        on_it, about = rows[away <= ON_IT], rows[(away > ON_IT) & (away <= NEAR)]
        found.append(on_it[:: max(1, -(-len(on_it) // max(half, 1)))])
        if len(about):
            found.append(about[thin_evenly(xyz[about], half)[0]])
    return np.concatenate(found)


def _lines(correction):
    """The recorded and the corrected trajectory, broken at its gaps."""
    old, new = correction.recorded, correction.corrected
    rows = thin(new.position, new.gps_time, new.gaps, EPOCHS)
    return break_at_gaps(new.gps_time[rows], new.gaps, old.position[rows], new.position[rows])[1:]


def _targets(correction, targets, origin):
    """Name, role and places of each target; no scanned place where it was not seen."""
    seen = [row for row in targets if row["observed"] is not None]
    observed = np.array([row["observed"] for row in seen], float).reshape(-1, 3)
    times = np.array([row["gps_time"] for row in seen], float)
    moved = correction.apply(PointCloud(observed, times, np.zeros(len(seen)))).xyz
    rows = [
        {
            "name": row["name"],
            "role": group(row),
            "surveyed": _local(row["surveyed"], origin),
            "scanned": [_local(observed[k], origin), _local(moved[k], origin)],
        }
        for k, row in enumerate(seen)
    ]
    rows += [
        {"name": r["name"], "role": "unused", "surveyed": _local(r["surveyed"], origin)}
        for r in targets
        if r["observed"] is None
    ]
    return rows


def _local(place, origin):
    return np.round(np.asarray(place) - origin, 4).tolist()


def scaled(values):
    """Values (n,) between their percentiles as base64 of uint8."""
    low, high = np.percentile(values, PERCENTILES)
    share = np.clip((values - low) / max(high - low, 1e-9), 0, 1)
    return packed(np.round(255 * share), "u1")


def packed(values, kind="<f4"):
    """An array as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
