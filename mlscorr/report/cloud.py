"""What the report shows of the cloud: pictures before and after, and a view to be turned."""

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
from mlscorr.report._viewer import viewer_data
from mlscorr.report.correction_report import ordered
from mlscorr.report.pages import data_uri
from mlscorr.report.render import (
    LABELS,
    MARK,
    Picture,
    PictureOptions,
    colour_table,
    draw,
    swatches,
    worst_facades,
)
from mlscorr.report.sample import gather
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import Survey
from mlscorr.wording import thousands

Progress = Callable[[str, int], Callable[[int], None]]


@dataclass(frozen=True)
class CloudViews:
    """Pictures of a cloud, the data of the 3D view as JSON content, and what was left out.

    Parameters
    ----------
    pictures : tuple of Picture
    scene : dict
        As viewer_data has it.
    step : int
        Every step-th point was drawn, near the targets more.
    walls_whole : bool
        Whether all points were drawn near the walls that ties found far apart.
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
        Near the facades of which all points are drawn, where passes lay the farthest apart.
    """
    rows = sorted((row for row in targets if row.is_observed), key=lambda row: row.gps_time)
    names = close_ups(rows)
    near = [row for row in rows if row.name in names]
    done = progress("Looking at the cloud", sum(file.points for file in survey.clouds))
    if ties is None:
        facades = np.empty((0, 3))
    else:
        facades = worst_facades(ties).place.reshape(-1, 3)
    stream = chain.from_iterable(map(read_chunks, survey.clouds))
    sample = gather(_watched(stream, done), near, facades)
    done = progress("Drawing the cloud", 4 * len(sample.cloud))  # scouted and drawn, twice

    def pictures(rows, size, *views):
        wide = size[0] * 3 // 2, size[1]
        chunks = lambda: _watched(sample.chunks(), done)  # noqa: E731
        return draw(
            survey, correction, rows, PictureOptions(size, wide), views, chunks=chunks, ties=ties
        )

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "There is no cross-section", UserWarning)
        drawn = [*pictures(rows, SETTINGS.panel, "overview", "section")]
    drawn += pictures(near, SETTINGS.close_up, "targets")
    scene = viewer_data(correction, sample.cloud, targets, near)
    return CloudViews(tuple(drawn), scene, sample.step, len(facades) > 0)


def _watched(chunks, done):
    for chunk in chunks:
        yield chunk
        done(len(chunk))


def close_ups(rows: list[TargetRow], limit: int = SETTINGS.close_ups) -> list[str]:
    """Names of the targets to draw close up: all, or the worst third and others evenly over time.

    Parameters
    ----------
    rows : list of TargetRow
        Of the observed targets, in time.
    limit : int
    """
    names = list(dict.fromkeys(row.name for row in rows))
    if len(names) <= limit:
        return names
    left = dict.fromkeys(names, 0.0)  # m, what remains without the point's own help
    for row in rows:
        if np.isfinite(row.left_out).all():
            rest = row.left_out
        else:
            rest = row.after
        left[row.name] = max(left[row.name], tables.norm(rest))
    worst = sorted(names, key=lambda name: -left[name])[: limit // 3]
    others = [name for name in names if name not in worst]
    spread = np.linspace(0, len(others) - 1, limit - len(worst)).round().astype(int)
    chosen = {*worst, *(others[k] for k in spread)}
    return [name for name in names if name in chosen]


def cloud_content(views: CloudViews, targets: list[TargetRow]) -> dict:
    """What the templates show of CloudViews."""
    pictures = [_pair(picture) for picture in views.pictures]
    kinds = {pair["kind"]: pair for pair in pictures}
    return {
        "overview": kinds["overview"],
        "section": kinds.get("section"),
        "close_ups": [pair for pair in pictures if pair["kind"] == "target"],
        "close_up_legend": _legend("intensity", None),
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
        "title": view.title,
        "note": view.note,
        "size": view.camera.size,
        "before": before,
        "after": after,
        "times": times.pop() if len(times) == 1 else None,
        "legend": _legend(view.colour, picture.limits, view.visits),
    }


def _legend(colour, limits, visits=()):
    """A colour's scale (words, low, high, gradient) or its swatches (colour, words)."""
    if pairs := swatches(colour, visits):
        return {"swatches": pairs}
    words, unit = LABELS[colour]
    stops = colour_table(colour)[np.linspace(0, 255, 9).round().astype(int)]
    gradient = ", ".join(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in stops)
    low, high = ("low", "high") if not unit else (f"{v:.2f} {unit}" for v in limits)
    return {"words": words, "low": low, "high": high, "gradient": gradient}
