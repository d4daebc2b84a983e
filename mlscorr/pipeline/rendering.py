"""Pictures of a survey before and after its correction."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.io.store import check_output, document, output_folder
from mlscorr.io.trajectories import read_trajectory
from mlscorr.pipeline.correction import correct
from mlscorr.pipeline.logs import write_log
from mlscorr.survey import Survey, check_survey

PAGE = (1920, 1080)  # pixels, a common screen
TIME_DIGITS = 1e-6  # s, rounding of a written trajectory


def render(
    survey: Survey,
    out: str | Path,
    corrected: str | Path | None = None,
    size: tuple[int, int] = PAGE,
    overwrite: bool = False,
    progress: Callable | None = None,
    **options: Any,
) -> dict:
    """Write before/after PNGs of a survey into a folder.

    Parameters
    ----------
    survey : Survey
    out : path
        Folder for the pictures, written atomically.
    corrected : path, optional
        Results of ``correct`` for this survey, whose correction is used; by default it is
        estimated.
    size : (int, int)
        Width and height of each PNG in pixels.
    overwrite : bool
        True to replace files of the same name.
    progress : function, optional
        See ``correct``.
    **options
        ``views`` and ``engine`` as in mlscorr.report.render.draw; ``colour``, ``azimuth``,
        ``elevation`` and ``view_angle`` as in its PictureOptions.

    Returns
    -------
    dict
        Document of the JSON output.

    Raises
    ------
    ValueError
        For invalid input.
    OSError
        If reading or writing fails.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey, out = mlscorr.read_survey(folder), tempfile.mkdtemp()
    >>> drawn = mlscorr.render(survey, out, size=(640, 360), views=["overview"])
    >>> [picture["file"] for picture in drawn["pictures"]]
    ['overview.png']
    """
    from mlscorr.report.render import PictureOptions, check_pictures, draw, panel_size

    check_survey(survey)
    check_output(out, [file.path for file in survey.inputs], overwrite)
    drawn = {name: options.pop(name) for name in ("views", "engine") if name in options}
    asked = PictureOptions(panel_size(size), panel_size(size, stacked=True), **options)
    check_pictures(asked, **drawn)
    if corrected is None:
        result = correct(survey, progress=progress)
        correction = result.estimate.correction
        targets = result.targets
    else:
        correction, targets = read_correction(survey, corrected)
    pictures = []
    with output_folder(out, survey.inputs, overwrite) as folder:
        for picture in draw(survey, correction, targets, asked, progress=progress, **drawn):
            name = f"{picture.name}.png"
            (Path(folder) / name).write_bytes(picture.page(size))
            view = picture.view
            row = {"file": name, "title": view.title, "colour": view.colour}
            pictures.append({**row, "scale": [picture.scale.low, picture.scale.high]})
        write_log(Path(folder))
    return document("render", {"name": survey.name, "pictures": pictures})


def read_correction(survey: Survey, folder: str | Path) -> tuple[Correction, list[TargetRow]]:
    """Read the Correction and the targets' rows from a folder written by ``correct``.

    Raises
    ------
    ValueError
        If it contains no results, or those of another survey.
    """
    folder = Path(folder)
    files = folder / "trajectory.csv", folder / "report.json"
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        raise ValueError(
            f"{folder} has no {' and no '.join(missing)}. Give a folder written by mlscorr "
            "correct, or omit it to estimate the correction."
        )
    trajectory = read_trajectory(files[0])
    time = survey.trajectory.gps_time
    if len(time) != len(trajectory) or np.abs(time - trajectory.gps_time).max() > TIME_DIGITS:
        raise ValueError(
            f"{files[0]} has {len(trajectory)} epochs from {trajectory.gps_time[0]:.3f} s, the "
            f"survey {len(time)} from {time[0]:.3f} s: it is the correction of another survey."
        )
    rows = json.loads(files[1].read_text(encoding="utf-8"))["targets"]
    rows = [TargetRow.read(row) for row in rows]
    points = survey.surveyed
    if strange := [row.name for row in rows if row.name not in points.name]:
        raise ValueError(
            f"{files[1]} has {len(strange)} targets that are not in {survey.path} (first: "
            f"{strange[0]}): it is the report of another survey."
        )
    return Correction(survey.trajectory, replace(trajectory, gps_time=time)), rows
