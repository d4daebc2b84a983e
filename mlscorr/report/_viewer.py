"""A thinned cloud with trajectory and targets, as the data of the view that can be turned."""

import base64

import numpy as np

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.report.correction_report import recomputed
from mlscorr.report.render import colour_table, percentiles
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import break_at_gaps, thin
from mlscorr.survey import PointCloud


def viewer_data(
    correction: Correction, cloud: PointCloud, targets: list[TargetRow], near: list[TargetRow]
) -> dict:
    """What the 3D view shows before and after a correction: content of a JSON document.

    Arrays are base64 of little-endian float32 (x, y, z in m about origin) or uint8.

    Parameters
    ----------
    correction : Correction
    cloud : PointCloud
        A sample of the cloud as recorded.
    targets : list of TargetRow
        All of them are drawn.
    near : list of TargetRow
        Those near which the cloud is shown more densely.
    """
    spread, spacing = thin_evenly(cloud.xyz)
    picked = cloud[np.concatenate([spread, _near_rows(cloud.xyz, near)])]
    moved = correction.apply(picked).xyz
    origin = np.round(np.median(picked.xyz, axis=0))
    return {
        "origin": origin.tolist(),
        "even": len(spread),
        "spacing": spacing,
        "before": _packed(picked.xyz - origin),
        "after": _packed(moved - origin),
        "intensity": _scaled(picked.intensity),
        "height": _scaled(moved[:, 2]),
        "colours": {name: _packed(colour_table(name), "u1") for name in ("intensity", "height")},
        "trajectory": [_packed(line - origin) for line in _lines(correction)],
        "targets": [_target(row, origin) for row in recomputed(targets, correction)],
    }


def thin_evenly(
    xyz: np.ndarray, limit: int = SETTINGS.viewer_points[0]
) -> tuple[np.ndarray, float]:
    """Rows of at most so many points (n, 3), one in each occupied cell of a grid, and its spacing.

    No random numbers: the first point of a cell stands for it.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    limit : int
    """
    sample = np.arange(0, len(xyz), max(1, len(xyz) // (30 * limit)))
    local = xyz[sample] - xyz[sample].min(axis=0)
    edge = 0.05
    while len(rows := _first_in_cells(local, edge)) > limit:
        edge *= max(1.05, np.sqrt(len(rows) / limit))  # surfaces: a quarter at twice the edge
    return sample[rows], float(edge)


def _first_in_cells(local, edge):
    cell = (local / edge).astype(np.int64)
    number = np.ravel_multi_index(cell.T, cell.max(axis=0) + 1)
    return np.sort(np.unique(number, return_index=True)[1])


def _near_rows(xyz, targets):
    """Rows of points on and about targets, at most so many over all."""
    rows_near = [np.empty(0, int)]
    half = max(SETTINGS.viewer_points[1] // max(len(targets), 1) // 2, 1)
    radius = 1.5 * SETTINGS.plan_cell
    for row in targets:
        rows = np.flatnonzero(np.abs(xyz[:, 0] - row.observed[0]) <= radius)
        away = np.linalg.norm(xyz[rows] - row.observed, axis=1)
        on_it = rows[away <= radius / 4]
        about = rows[(away > radius / 4) & (away <= radius)]
        rows_near.append(on_it[:: max(1, -(-len(on_it) // half))])
        if len(about):
            rows_near.append(about[thin_evenly(xyz[about], half)[0]])
    return np.concatenate(rows_near)


def _lines(correction):
    """The recorded and the corrected trajectory, broken at its gaps."""
    old = correction.recorded
    new = correction.corrected
    rows = thin(new.position, new.gps_time, new.gaps)
    return break_at_gaps(new.gps_time[rows], new.gaps, old.position[rows], new.position[rows])[1:]


def _target(row, origin):
    """Name, role and places of a target; no scanned place where it was not seen."""
    surveyed = row.surveyed - origin
    target = {"name": row.name, "role": row.group, "surveyed": np.round(surveyed, 4).tolist()}
    if row.is_observed:
        places = [surveyed - row.before, surveyed - row.after]
        target["scanned"] = [np.round(place, 4).tolist() for place in places]
    return target


def _scaled(values):
    """Values (n,) between their percentiles as base64 of uint8."""
    low, high = percentiles(values)
    return _packed(np.round(255 * np.clip((values - low) / max(high - low, 1e-9), 0, 1)), "u1")


def _packed(values, kind="<f4"):
    """An array as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
