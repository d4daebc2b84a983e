"""From the cloud to pictures: all views are drawn together while the cloud is streamed."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import TargetRow
from mlscorr.io.clouds import read_chunks
from mlscorr.report.correction_report import recomputed
from mlscorr.report.render._scout import scout
from mlscorr.report.render._sheet import Sheet
from mlscorr.report.render._views import VIEWS, overview, section, target_view
from mlscorr.report.render.picture import Picture
from mlscorr.report.render.quantities import COLOURS, CloudPair, point_sigma
from mlscorr.report.render.view import PictureOptions
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import PointCloud, Survey

ENGINES = ("zbuffer", "open3d")


def draw(
    survey: Survey,
    correction: Correction,
    targets: list[TargetRow],
    options: PictureOptions,
    views: Sequence[str] = VIEWS,
    engine: str = "zbuffer",
    chunks: Callable[[], Iterable[PointCloud]] | None = None,
    progress: Callable | None = None,
    ties: TieResiduals | None = None,
) -> Iterator[Picture]:
    """Draw a recorded survey before and after a correction, with the same cameras and colors.

    The cloud is streamed twice in flat memory: to choose the views, and to draw.

    Parameters
    ----------
    survey : Survey
    correction : anything with ``apply(cloud) -> cloud``
        The sigma after it is known if it has a ``corrected`` trajectory with sigmas.
    targets : list of TargetRow
    options : PictureOptions
        Size, color and camera.
    views : sequence of str
        Of VIEWS: overview, targets, section.
    engine : str
        ``zbuffer``, or ``open3d``: in a child process through Vulkan, slower, with the survey's
        reference surface behind the points of the overview. If that fails, the z-buffer is used,
        with a warning.
    chunks : function, optional
        Returns an iterator of PointCloud; by default the survey's files are read.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : TieResiduals, optional
        Their facades have priority for the section.

    Yields
    ------
    Picture

    Raises
    ------
    ValueError
        If a view, color, engine or size is invalid, or the cloud has no points.
    """
    check_pictures(options, views, engine)
    stream = _stream(survey, chunks, progress)
    rows = recomputed([row for row in targets if row.is_observed], correction)
    to_draw = _views(survey, correction, rows, views, options, stream("Sampling the cloud"), ties)
    sigmas = point_sigma(survey.trajectory), point_sigma(getattr(correction, "corrected", None))
    largest = max((np.prod(view.camera.size) for view in to_draw), default=1)
    bytes_of_view = 2 * largest * np.dtype(np.uint64).itemsize  # before and after
    at_once = max(1, int(SETTINGS.canvas_bytes / bytes_of_view))
    for first in range(0, len(to_draw), at_once):
        sheets = [Sheet.blank(view) for view in to_draw[first : first + at_once]]
        for cloud in stream("Drawing the cloud"):
            _add(sheets, CloudPair(cloud, correction.apply(cloud), sigmas))
        for sheet in sheets:
            if engine == "open3d":
                try:
                    yield sheet.finished(True, survey.reference)
                    continue
                except RuntimeError as error:
                    engine = "zbuffer"  # also for the following views
                    warnings.warn(
                        f"{error}: the pictures are drawn with the z-buffer.", stacklevel=2
                    )
            yield sheet.finished()


def check_pictures(
    options: PictureOptions, views: Sequence[str] = VIEWS, engine: str = "zbuffer"
) -> None:
    """Refuse options that cannot be drawn.

    Parameters
    ----------
    options, views, engine
        See draw.

    Raises
    ------
    ValueError
        If a view, color, engine or size is invalid.
    """
    choices = (
        ("view", views, VIEWS),
        ("engine", [engine], ENGINES),
        ("colour", filter(None, [options.colour]), COLOURS),
    )
    for what, names, known in choices:
        for name in names:
            if name not in known:
                raise ValueError(f"There is no {what} '{name}'; available are {', '.join(known)}.")
    least, largest = SETTINGS.picture_sizes
    if not all(least <= pixels <= largest for pixels in options.size):
        raise ValueError(
            f"Each picture would have {options.size[0]} x {options.size[1]} pixels; each side "
            f"must have {least} to {largest}."
        )


def _stream(survey, chunks, progress):
    """Function of a title that returns an iterator of the cloud's chunks, with progress."""
    total = sum(file.points for file in survey.clouds)

    def stream(title):
        clouds = chain.from_iterable(map(read_chunks, survey.clouds))
        if chunks:
            clouds = chunks()
        if progress is None:
            yield from clouds
            return
        done = progress(title, total)
        for cloud in clouds:
            yield cloud
            done(len(cloud))

    return stream


def _views(survey, correction, rows, views, options, stream, ties):
    """Views to draw, after a first pass over the cloud."""
    points = survey.surveyed
    close = rows if "targets" in views else []  # other views do not need orientations
    sizes = points.size[[points.name.index(row.name) for row in close]]
    scouted = scout(stream, correction, close, sizes)
    to_draw = []
    if "overview" in views:
        to_draw.append(overview(scouted, rows, options))
    if "targets" in views:
        for name in dict.fromkeys(row.name for row in rows):
            of_name = [k for k, row in enumerate(rows) if row.name == name]
            normal = scouted.normals[of_name[0]]
            passes = [rows[k] for k in of_name]
            to_draw.append(target_view(passes, normal, points, survey.trajectory, options))
    if "section" in views:
        cut = section(scouted, options, ties)
        if cut is None:
            warnings.warn("There is no cross-section: the cloud has no wall.", stacklevel=3)
        else:
            to_draw.append(cut)
    return to_draw


def _add(sheets, chunk):
    """Draw a chunk on all sheets; values shared by several are computed once."""
    values = {}
    for sheet in sheets:
        key = (sheet.view.colour, sheet.view.splits)
        if key not in values:
            values[key] = chunk.values(*key)
        sheet.add(chunk, values[key])
