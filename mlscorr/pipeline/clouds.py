"""Clouds as a correction puts them."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.evaluate.scores import Correcting
from mlscorr.io.conversion import written_name
from mlscorr.io.las_copy import CorrectedPart, write_parts
from mlscorr.survey import Survey


def write_clouds(
    survey: Survey,
    folder: Path,
    correction: Correcting | Mapping[str, Correcting],
    watch: Callable[[np.ndarray], object],
    sigma: Callable[[Survey], PointSigma] | None = None,
) -> list[tuple[Path, int, int]]:
    """Write a survey's clouds into a folder, under their names, as LAZ what was no LAS.

    Parameters
    ----------
    survey : Survey
    folder : Path
    correction : anything with ``apply(cloud) -> cloud``, or that of each scanner by its name
    watch : function of gps_time (n,)
        Is told the times of the points that were just written.
    sigma : function, optional
        ``sigma(survey)`` of a scanner gives PointSigma; each point gets three fields more.

    Returns
    -------
    list of (path, points, points outside the trajectory)
        Scanner by scanner, but a file of several once; the last stay as they were.
    """
    parts: dict[Path, list[CorrectedPart]] = {}
    for name, part in survey.by_scanner.items():
        sigmas = sigma and sigma(part)
        moved = correction[name] if isinstance(correction, Mapping) else correction
        for file in part.clouds:
            parts.setdefault(file.path, []).append(CorrectedPart(file, moved, sigmas))
    written = []
    for source, some in parts.items():
        path = folder / written_name(source)
        outside = write_parts(some, path, watch)
        written.append((path, sum(part.file.points for part in some), sum(outside)))
    return written
