"""Clouds as a correction puts them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.evaluate.scores import Correcting
from mlscorr.io.conversion import written_name
from mlscorr.io.las_copy import write_corrected
from mlscorr.survey import Survey


def write_clouds(
    survey: Survey,
    folder: Path,
    correction: Correcting,
    watch: Callable[[np.ndarray], object],
    sigma: Callable[[Survey], PointSigma] | None = None,
) -> list[tuple[Path, int, int]]:
    """Write a survey's clouds into a folder, under their names, as LAZ what was no LAS.

    Parameters
    ----------
    survey : Survey
    folder : Path
    correction : anything with ``apply(cloud) -> cloud``
    watch : function of gps_time (n,)
        Is told the times of the points that were just written.
    sigma : function, optional
        ``sigma(survey)`` of a scanner gives PointSigma; each point gets three fields more.

    Returns
    -------
    list of (path, points, points outside the trajectory)
        Scanner by scanner; the latter stay as they were.
    """
    written = []
    for part in survey.by_scanner.values():
        sigmas = sigma and sigma(part)
        for file in part.clouds:
            path = folder / written_name(file.path)
            outside = write_corrected(file, path, correction, watch, sigmas)
            written.append((path, file.points, outside))
    return written
