"""Pictures of the cloud, and an interactive 3D view for a page or a viewer.

The view contains a thinned cloud, with trajectory and targets.
"""

import base64
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import TargetRow
from mlscorr.io.clouds import read_chunks
from mlscorr.report import tables
from mlscorr.report.correction_report import ordered, recomputed
from mlscorr.report.first_look import independent_residual, worst_target
from mlscorr.report.pages import data_uri
from mlscorr.report.render import (
    LABELS,
    MARK,
    Picture,
    PictureOptions,
    colour_scale,
    colour_table,
    draw,
    swatches,
    worst_facades,
)
from mlscorr.report.sample import CloudSample, CloudSampler, gather, near_rows
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import break_at_gaps, thin
from mlscorr.survey import PointCloud, Survey
from mlscorr.wording import thousands

Progress = Callable[[str, int], Callable[[int], None]]


@dataclass(frozen=True)
class CloudViews:
    """Pictures of a cloud, data of the 3D view as JSON content, and thinning.

    Parameters
    ----------
    pictures : tuple of Picture
    scene : dict
        Result of viewer_data.
    step : int
        Every step-th point was drawn, and more near the targets.
    walls_whole : bool
        True if all points were drawn near walls with large misclosures of ties.
    """

    pictures: tuple[Picture, ...]
    scene: dict
    step: int
    walls_whole: bool = False


def view_cloud(
    survey: Survey,
    correction: Correction,
    targets: list[TargetRow],
    progress: Progress,
    ties: TieResiduals | None = None,
    sample: CloudSample | None = None,
) -> CloudViews:
    """Draw a cloud before and after its correction, in one pass over it and flat memory.

    Parameters
    ----------
    survey : Survey
    correction : Correction
    targets : list of TargetRow
    progress : function
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : TieResiduals, optional
        All points are drawn near the facades with the largest misclosures.
    sample : CloudSample, optional
        Sample from the ``cloud_sampler``, if the cloud has already been read.
    """
    rows = _in_time(targets)
    near = _close_up_rows(rows)
    facades = _facades(ties)
    if sample is None:
        done = progress("Sampling the cloud", sum(file.points for file in survey.clouds))
        stream = chain.from_iterable(map(read_chunks, survey.clouds))
        sample = gather(_watched(stream, done), near, facades)
    rows_near = near_rows(sample.cloud.xyz, near)
    about = CloudSample(sample.cloud[rows_near], sample.step)
    total = 2 * (len(sample.cloud) + len(about.cloud))  # scouted and drawn
    done = progress("Drawing the cloud", total)

    def pictures(sample, rows, size, *views):
        wide = size[0] * 3 // 2, size[1]
        chunks = lambda: _watched(sample.chunks(), done)  # noqa: E731
        return draw(
            survey, correction, rows, PictureOptions(size, wide), views, chunks=chunks, ties=ties
        )

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "There is no cross-section", UserWarning)
        drawn = [*pictures(sample, rows, SETTINGS.panel, "overview", "section")]
    if len(about.cloud):
        drawn += pictures(about, near, SETTINGS.close_up, "targets")
    scene = viewer_data(correction, sample.cloud, targets, near, rows_near)
    return CloudViews(tuple(drawn), scene, sample.step, len(facades) > 0)


def cloud_sampler(targets: list[TargetRow], ties: TieResiduals | None = None) -> CloudSampler:
    """Make a collector of the data for ``view_cloud``, for use while the cloud is read.

    Parameters
    ----------
    targets : list of TargetRow
    ties : TieResiduals, optional
    """
    return CloudSampler(_close_up_rows(_in_time(targets)), _facades(ties))


def _in_time(targets):
    """Observed rows of targets, sorted by time."""
    return sorted((row for row in targets if row.is_observed), key=lambda row: row.gps_time)


def _close_up_rows(rows):
    """Rows of the targets with close-ups."""
    names = close_ups(rows)
    return [row for row in rows if row.name in names]


def _facades(ties):
    """Positions (k, 3) of the facades with the largest misclosures between passes. Units: m."""
    if ties is None:
        return np.empty((0, 3))
    return worst_facades(ties).place.reshape(-1, 3)


def _watched(chunks, done):
    for chunk in chunks:
        yield chunk
        done(len(chunk))


def close_ups(rows: list[TargetRow], limit: int = SETTINGS.close_ups) -> list[str]:
    """Names of targets for close-ups: all, or the worst third and others evenly over time.

    Parameters
    ----------
    rows : list of TargetRow
        Rows of the observed targets, sorted by time.
    limit : int
    """
    names = list(dict.fromkeys(row.name for row in rows))
    if len(names) <= limit:
        return names
    left = dict.fromkeys(names, 0.0)  # m, leave-one-out residual
    for row in rows:
        left[row.name] = max(left[row.name], tables.norm(independent_residual(row)))
    first = worst_target(rows)
    if first is not None:  # of the first screen
        left[first.name] = np.inf
    worst = sorted(names, key=lambda name: -left[name])[: limit // 3]
    others = [name for name in names if name not in worst]
    spread = np.linspace(0, len(others) - 1, limit - len(worst)).round().astype(int)
    chosen = {*worst, *(others[k] for k in spread)}
    return [name for name in names if name in chosen]


def cloud_content(views: CloudViews, targets: list[TargetRow]) -> dict:
    """Content of CloudViews for the templates."""
    pictures = [_pair(picture) for picture in views.pictures]
    kinds = {pair["kind"]: pair for pair in pictures}
    close = [pair for pair in pictures if pair["kind"] == "target"]
    return {
        "overview": kinds["overview"],
        "section": kinds.get("section"),
        "close_ups": close,
        "close_up_of": {pair["name"]: number for number, pair in enumerate(close, start=1)},
        "close_up_legend": _legend("intensity"),
        "observed_targets": len({row.name for row in ordered(targets) if row.is_observed}),
        "mark": MARK,
        "step": views.step,
        "walls_whole": views.walls_whole,
        "scene": views.scene,
        "scene_points": thousands(len(base64.b64decode(views.scene["intensity"]))),
    }


def _pair(picture):
    """One pair of pictures in words and as addresses of images."""
    view = picture.view
    before, after = (data_uri(panel, "png") for panel in picture.panels())
    times = {mark.text for side in view.marks for mark in side if mark.kind == "residual"}
    return {
        "kind": view.name.partition("-")[0],
        "name": view.name.partition("-")[2],
        "title": view.title,
        "note": view.note,
        "size": view.camera.size,
        "before": before,
        "after": after,
        "times": times.pop() if len(times) == 1 else None,
        "legend": _legend(view.colour, picture.scale, view.visits),
    }


def _legend(colour, scale=None, visits=()):
    """Scale of a color (words, low, high, gradient) or its swatches (color, words)."""
    if pairs := swatches(colour, visits):
        return {"swatches": pairs}
    words, unit = LABELS[colour]
    stops = colour_table(colour)[np.linspace(0, 255, 9).round().astype(int)]
    gradient = ", ".join(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in stops)
    ends = {"low": "low", "high": "high", "middle": ""}
    if unit:
        ends |= {"low": f"{scale.low:.2f} {unit}", "high": f"{scale.high:.2f} {unit}"}
        if scale.exponent < 1:
            ends["middle"] = f"(middle of the scale {scale.middle:.3f} {unit})"
    return {"words": words, "gradient": gradient, **ends}


def viewer_data(
    correction: Correction,
    cloud: PointCloud,
    targets: list[TargetRow],
    near: list[TargetRow],
    rows_near: np.ndarray | None = None,
) -> dict:
    """Data of the 3D view before and after a correction, as content of a JSON document.

    Arrays are base64 of little-endian float32 (x, y, z in m about origin) or uint8.

    Parameters
    ----------
    correction : Correction
    cloud : PointCloud
        Sample of the recorded cloud.
    targets : list of TargetRow
        Targets, all of which are drawn.
    near : list of TargetRow
        Those near which the cloud is shown more densely.
    rows_near : (k,) array, optional
        ``near_rows`` of them, where they are known.
    """
    if rows_near is None:
        rows_near = near_rows(cloud.xyz, near)
    spread, spacing = thin_evenly(cloud.xyz)
    picked = cloud[np.concatenate([spread, _dense_rows(cloud.xyz, near, rows_near)])]
    moved = correction.apply(picked).xyz
    origin = np.round(np.median(picked.xyz, axis=0))
    return {
        "origin": origin.tolist(),
        "even": len(spread),
        "spacing": spacing,
        "before": packed(picked.xyz - origin),
        "after": packed(moved - origin),
        "intensity": _shares("intensity", picked.intensity),
        "height": _shares("height", moved[:, 2]),
        "colours": {name: packed(colour_table(name), "u1") for name in ("intensity", "height")},
        "trajectory": [packed(line - origin) for line in _lines(correction)],
        "targets": [_target(row, origin) for row in recomputed(targets, correction)],
    }


def thin_evenly(
    xyz: np.ndarray, limit: int = SETTINGS.viewer_points[0]
) -> tuple[np.ndarray, float]:
    """Thin points (n, 3) to one per occupied grid cell, up to a limit; return rows and spacing.

    Without random numbers: the first point of each cell is used.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    limit : int
    """
    sample = np.arange(0, len(xyz), max(1, len(xyz) // (30 * limit)))
    local = xyz[sample] - xyz[sample].min(axis=0)
    edge = 0.05
    rows = _first_in_cells(local, edge)
    while len(rows) > limit:
        edge *= max(1.05, np.sqrt(len(rows) / limit))  # surfaces: a quarter at twice the edge
        rows = rows[_first_in_cells(local[rows], edge)]
    return sample[rows], float(edge)


def _first_in_cells(local, edge):
    cell = (local / edge).astype(np.int64)
    number = np.ravel_multi_index(cell.T, cell.max(axis=0) + 1)
    return np.sort(np.unique(number, return_index=True)[1])


def _dense_rows(xyz, targets, candidates):
    """Rows of points on and about targets, at most so many over all, of the candidates."""
    dense = [np.empty(0, int)]
    half = max(SETTINGS.viewer_points[1] // max(len(targets), 1) // 2, 1)
    radius = 1.5 * SETTINGS.plan_cell
    candidates = candidates[np.argsort(xyz[candidates, 0])]
    easting = xyz[candidates, 0]
    for row in targets:
        edges = np.searchsorted(easting, row.observed[0] + np.array([-radius, radius]))
        rows = np.sort(candidates[slice(*edges)])
        away = np.linalg.norm(xyz[rows] - row.observed, axis=1)
        on_it = rows[away <= radius / 4]
        about = rows[(away > radius / 4) & (away <= radius)]
        dense.append(on_it[:: max(1, -(-len(on_it) // half))])
        if len(about):
            dense.append(about[thin_evenly(xyz[about], half)[0]])
    return np.concatenate(dense)


def _lines(correction):
    """Recorded and corrected trajectory, broken at gaps."""
    old = correction.recorded
    new = correction.corrected
    rows = thin(new.position, new.gps_time, new.gaps)
    return break_at_gaps(new.gps_time[rows], new.gaps, old.position[rows], new.position[rows])[1:]


def _target(row, origin):
    """Name, role and positions of a target; no scanned position if it was not observed."""
    surveyed = row.surveyed - origin
    target = {"name": row.name, "role": row.group, "surveyed": np.round(surveyed, 4).tolist()}
    if row.is_observed:
        places = [surveyed - row.before, surveyed - row.after]
        target["scanned"] = [np.round(place, 4).tolist() for place in places]
    return target


def _shares(colour, values):
    """Positions of values (n,) on the scale of a color, as base64 of uint8."""
    return packed(np.round(255 * colour_scale(colour, values).share(values)), "u1")


def packed(values: np.ndarray, kind: str = "<f4") -> str:
    """Encode an array as base64.

    Parameters
    ----------
    values : array
    kind : str
        Type of its little-endian numbers.
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
