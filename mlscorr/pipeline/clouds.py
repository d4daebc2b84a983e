"""Clouds as a correction puts them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.evaluate.scores import Correcting
from mlscorr.io.las_copy import write_corrected
from mlscorr.survey import Survey


def write_clouds(
    survey: Survey,
    folder: Path,
    correction: Correcting,
    watch: Callable[[np.ndarray], object],
    sigma: PointSigma | None = None,
) -> list[tuple[Path, int, int]]:
    """Write a survey's clouds into a folder, under their names.

    Parameters
    ----------
    survey : Survey
    folder : Path
    correction : anything with ``apply(cloud) -> cloud``
    watch : function of gps_time (n,)
        Is told the times of the points that were just written.
    sigma : PointSigma, optional
        Gives each point three fields more.

    Returns
    -------
    list of (path, points, points outside the trajectory)
        The latter stay as they were.
    """
    paths = [folder / file.path.name for file in survey.clouds]
    return [
        (path, file.points, write_corrected(file, path, correction, watch, sigma))
        for file, path in zip(survey.clouds, paths, strict=True)
    ]
