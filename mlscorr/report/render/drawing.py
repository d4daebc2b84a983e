"""From the cloud to pictures: the views are drawn together while the cloud goes by."""

import warnings
from itertools import chain

import numpy as np

from mlscorr.io.las import read_chunks
from mlscorr.report.render.quantities import COLOURS, Chunk, PointSigma
from mlscorr.report.render.scout import scout
from mlscorr.report.render.sheet import Sheet
from mlscorr.report.render.views import VIEWS, Look, overview, section, target
from mlscorr.survey import PointCloud

ENGINES = ("zbuffer", "open3d")
CANVASES = 400e6  # bytes: as many views as fit are drawn at once, the next ones after them
BYTES = 16  # of each pixel of a view, before and after
PANEL = (900, 675)  # pixels, of a picture in a report
SIZES = (64, 8192)  # pixels, the least and largest width and height


def draw(
    survey,
    correction,
    targets,
    look=None,
    views=VIEWS,
    engine="zbuffer",
    chunks=None,
    progress=None,
):
    """Draw a recorded survey before and after a correction, by the same cameras and colours.

    The cloud is streamed in flat memory: once to see where to look, and once to draw.

    Parameters
    ----------
    survey : Survey
    correction : anything with ``apply(cloud) -> cloud``
        The sigma that remains is known where it has a ``corrected`` trajectory with sigmas.
    targets : list of dict
        Rows ``targets`` of report.json.
    look : Look, optional
        Size, colour and camera.
    views : sequence of str
        Of VIEWS: overview, targets, section.
    engine : str
        ``zbuffer``, or ``open3d``: in a child process by way of Vulkan, slower, with the
        survey's reference surface behind the points of the overview. Where that fails the
        z-buffer draws, with a warning.
    chunks : function, optional
        Returns an iterator of PointCloud; by default the survey's files are read.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.

    Yields Picture. Raises ValueError for a view, colour, engine or size that there is not, and
    for a cloud without points.
    """
    look = Look(PANEL) if look is None else look
    _check(look, views, engine)
    stream = _stream(survey, chunks, progress)
    rows = _seen(targets, correction)
    wanted = _views(survey, correction, rows, views, look, stream("Looking at the cloud"))
    sigmas = [PointSigma.of(t) for t in (survey.trajectory, getattr(correction, "corrected", None))]
    most = max((np.prod(view.camera.size) for view in wanted), default=1)
    at_once = max(1, int(CANVASES / BYTES / most))
    for first in range(0, len(wanted), at_once):
        sheets = [Sheet.blank(view) for view in wanted[first : first + at_once]]
        for cloud in stream("Drawing the cloud"):
            _add(sheets, Chunk(cloud, correction.apply(cloud), sigmas))
        for sheet in sheets:
            if engine == "open3d":
                try:
                    yield sheet.finished(True, survey.reference)
                    continue
                except RuntimeError as error:
                    engine = "zbuffer"  # for the views that follow too
                    warnings.warn(f"{error}: the z-buffer draws the pictures.", stacklevel=2)
            yield sheet.finished()


def _check(look, views, engine):
    known = {"view": (views, VIEWS), "engine": ([engine], ENGINES)}
    known["colour"] = ([look.colour] if look.colour else [], COLOURS)
    for what, (asked, there) in known.items():
        for name in asked:
            if name not in there:
                raise ValueError(f"There is no {what} '{name}'; choose of {', '.join(there)}.")
    if not all(SIZES[0] <= pixels <= SIZES[1] for pixels in look.size):
        raise ValueError(
            f"Each picture would have {look.size[0]} x {look.size[1]} pixels; it needs "
            f"{SIZES[0]} to {SIZES[1]} each way."
        )


def _stream(survey, chunks, progress):
    """A function of a title that returns an iterator of the cloud's chunks, with progress."""
    total = sum(file.points for file in survey.clouds)

    def stream(title):
        done = progress(title, total) if progress else (lambda points: None)
        for cloud in chunks() if chunks else chain.from_iterable(map(read_chunks, survey.clouds)):
            yield cloud
            done(len(cloud))

    return stream


def _seen(targets, correction):
    """The rows of targets that were observed, with misclosures by this correction as arrays."""
    rows = [row for row in targets if row["observed"] is not None]
    observed = np.array([row["observed"] for row in rows], float).reshape(-1, 3)
    times = np.array([row["gps_time"] for row in rows], float)
    moved = correction.apply(PointCloud(observed, times, np.zeros(len(rows)))).xyz
    return [
        {**row, "before": row["surveyed"] - observed[k], "after": row["surveyed"] - moved[k]}
        for k, row in enumerate(rows)
    ]


def _views(survey, correction, rows, views, look, stream):
    """The views that are wanted, after a first look at the cloud."""
    points = survey.control + survey.check
    sizes = points.size[[points.name.index(row["name"]) for row in rows]]
    scouted = scout(stream, correction, rows, sizes)
    found = []
    if "overview" in views:
        found.append(overview(scouted, rows, look))
    if "targets" in views:
        for name in dict.fromkeys(row["name"] for row in rows):
            of = [k for k, row in enumerate(rows) if row["name"] == name]
            normal = scouted.normals[of[0]]
            found.append(target([rows[k] for k in of], normal, points, survey.trajectory, look))
    if "section" in views:
        cut = section(scouted, look)
        if cut is None:
            warnings.warn("There is no cross-section: the cloud has no wall.", stacklevel=3)
        else:
            found.append(cut)
    return found


def _add(sheets, chunk):
    """Draw a chunk on all sheets; what they colour alike is computed once."""
    values = {}
    for sheet in sheets:
        key = (sheet.view.colour, sheet.view.split)
        if key not in values:
            values[key] = chunk.values(*key)
        sheet.add(chunk, values[key])
