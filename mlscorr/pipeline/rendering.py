"""From a survey to pictures of it before and after its correction."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.georeference import Correction
from mlscorr.io.output import check_output, document, output_folder
from mlscorr.io.survey_file import input_files
from mlscorr.io.trajectory import read_trajectory
from mlscorr.pipeline.correction import correct

PAGE = (1920, 1080)  # pixels
TIME_DIGITS = 1e-6  # s, to which a corrected trajectory is written


def render(
    survey,
    out,
    corrected=None,
    size=PAGE,
    overwrite=False,
    progress=None,
    **options,
):
    """Write before/after PNGs of a survey into a folder.

    Parameters
    ----------
    survey : Survey
    out : path
        Folder for the pictures; it appears whole or not at all.
    corrected : path, optional
        Results of ``correct`` for this survey, whose correction is taken; else it is estimated.
    size : (int, int)
        Width and height of each PNG in pixels.
    overwrite : bool
        Whether files of the same name are replaced.
    progress : function, optional
        As in ``correct``.
    options
        ``views`` and ``engine`` as in mlscorr.report.render.draw; ``colour``, ``azimuth``,
        ``elevation`` and ``view_angle`` as in its Look.

    Returns the document of the JSON output. Raises ValueError for bad input, OSError when
    reading or writing fails.
    """
    from mlscorr.report.render import Look, draw, panel_size

    check_output(out, input_files(survey.path), overwrite)
    how = {k: options.pop(k) for k in ("views", "engine") if k in options}
    look = Look(panel_size(size), panel_size(size, stacked=True), **options)
    if corrected is None:
        result = correct(survey, progress=progress)
        correction, targets = result.estimate.correction, result.targets
    else:
        correction, targets = read_correction(survey, corrected)
    pictures = []
    with output_folder(out) as folder:
        for picture in draw(survey, correction, targets, look, progress=progress, **how):
            name = f"{picture.name}.png"
            (Path(folder) / name).write_bytes(picture.page(size))
            view = picture.view
            row = {"file": name, "title": view.title, "colour": view.colour}
            pictures.append({**row, "scale": list(picture.limits)})
    return document("render", {"name": survey.name, "pictures": pictures})


def read_correction(survey, folder):
    """The Correction and the targets' rows from a folder that ``correct`` wrote.

    Raises ValueError when it holds no results, or those of another survey.
    """
    folder = Path(folder)
    files = folder / "trajectory.csv", folder / "report.json"
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        raise ValueError(
            f"{folder} holds no {' and no '.join(missing)}. Give a folder that mlscorr correct "
            "wrote, or leave it out, and the correction is estimated anew."
        )
    trajectory = read_trajectory(files[0])
    time = survey.trajectory.gps_time
    if len(time) != len(trajectory) or np.abs(time - trajectory.gps_time).max() > TIME_DIGITS:
        raise ValueError(
            f"{files[0]} has {len(trajectory)} epochs from {trajectory.gps_time[0]:.3f} s on, the "
            f"survey {len(time)} from {time[0]:.3f} s on: it is the correction of another survey."
        )
    rows = json.loads(files[1].read_text(encoding="utf-8"))["targets"]
    points = survey.control + survey.check
    if strange := [row["name"] for row in rows if row["name"] not in points.name]:
        raise ValueError(
            f"{files[1]} names {len(strange)} targets that {survey.path} does not know (first: "
            f"{strange[0]}): it is the report on another survey."
        )
    return Correction(survey.trajectory, replace(trajectory, gps_time=time)), rows
