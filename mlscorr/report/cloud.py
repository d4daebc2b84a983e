"""What the report shows of the cloud: pictures before and after, and a scene to be turned."""

import warnings
from dataclasses import dataclass
from itertools import chain

import numpy as np

from mlscorr.io.las import read_chunks
from mlscorr.report import tables
from mlscorr.report.render import Look, Picture, draw
from mlscorr.report.sample import gather
from mlscorr.report.scene import turnable

CLOSE_UPS = 24  # most targets that are drawn close up
WORST = 3  # one in so many of them is one of the worst, where there are more targets
PANEL = (640, 480)  # pixels, of the overview and the cross-section
WIDE = (960, 480)  # pixels, of the overview of a long street
SMALL = (440, 330)  # pixels, of a close-up: as large as the page shows it, so its letters are, too


@dataclass(frozen=True)
class CloudViews:
    """Pictures of a cloud, the scene of the 3D view as JSON content, and what was left out.

    ``step``: every step-th point was drawn, near the targets more.
    """

    pictures: tuple[Picture, ...]
    scene: dict
    step: int


def view_cloud(survey, correction, targets, progress):
    """Look at a cloud before and after its correction, in one pass and flat memory.

    Parameters
    ----------
    survey : Survey
    correction : Correction
    targets : list of dict
        Rows of report.json.
    progress : function
        ``progress(title, total)`` returns a function of the number of points just done.
    """
    rows = sorted((r for r in targets if r["observed"] is not None), key=lambda r: r["gps_time"])
    names = close_ups(rows)
    near = [row for row in rows if row["name"] in names]
    done = progress("Looking at the cloud", sum(file.points for file in survey.clouds))
    sample = gather(_watched(chain.from_iterable(map(read_chunks, survey.clouds)), done), near)
    done = progress("Drawing the cloud", 4 * len(sample.cloud))  # looked at and drawn, twice

    def chunks():
        return _watched(sample.pieces(), done)

    def drawn(rows, look, *views):
        return draw(survey, correction, rows, look, views, chunks=chunks)

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "There is no cross-section", UserWarning)
        pictures = [*drawn(rows, Look(PANEL, WIDE), "overview", "section")]
    pictures += drawn(near, Look(SMALL), "targets")
    scene = turnable(correction, sample.cloud, targets, near)
    return CloudViews(tuple(pictures), scene, sample.step)


def _watched(chunks, done):
    for chunk in chunks:
        yield chunk
        done(len(chunk))


def close_ups(rows, most=CLOSE_UPS):
    """Names of the targets to draw close up: all, or the worst and others evenly over time.

    Parameters
    ----------
    rows : list of dict
        Of the observed targets, in time.
    most : int
    """
    names = list(dict.fromkeys(row["name"] for row in rows))
    if len(names) <= most:
        return names
    left = dict.fromkeys(names, 0.0)  # m, what remains without the point's own help
    for row in rows:
        left[row["name"]] = max(left[row["name"]], tables.norm(row["left_out"] or row["after"]))
    worst = sorted(names, key=lambda name: -left[name])[: most // WORST]
    others = [name for name in names if name not in worst]
    even = np.linspace(0, len(others) - 1, most - len(worst)).round().astype(int)
    chosen = {*worst, *(others[k] for k in even)}
    return [name for name in names if name in chosen]
