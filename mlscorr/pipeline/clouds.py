"""Clouds as a correction puts them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.estimate import Support
from mlscorr.evaluate.scores import Correcting
from mlscorr.io.conversion import written_name
from mlscorr.io.las import sha256
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


@dataclass(frozen=True)
class WrittenClouds:
    """Corrected clouds, and how many of their points nothing holds.

    Parameters
    ----------
    files : tuple of (name, SHA-256, points)
    outside : int
        Points outside the trajectory, which stayed as they were.
    uncontrolled : int
        Before the first or past the last control point.
    extrapolated : int
        In weak stretches.
    """

    files: tuple[tuple[str, str, int], ...] = ()
    outside: int = 0
    uncontrolled: int = 0
    extrapolated: int = 0

    @classmethod
    def join(cls, parts: Iterable[WrittenClouds]) -> WrittenClouds:
        """Those of some files together.

        Parameters
        ----------
        parts : iterable of WrittenClouds
        """
        parts = list(parts)
        return cls(
            tuple(file for part in parts for file in part.files),
            sum(part.outside for part in parts),
            sum(part.uncontrolled for part in parts),
            sum(part.extrapolated for part in parts),
        )


def write_counted(
    survey: Survey,
    folder: Path,
    correction: Correcting,
    held: tuple[tuple[float, float], Support],
    done: Callable[[int], object],
    sigma: Callable[[Survey], PointSigma] | None = None,
) -> WrittenClouds:
    """Write a survey's clouds, and count the points that nothing holds.

    Parameters
    ----------
    survey, folder, correction, sigma
        As of write_clouds.
    held : pair of (float, float) and Support
        First and last control epoch (s), and what holds the correction along the drive.
    done : function of a number of points
    """
    (first, last), support = held
    counts = np.zeros(2, int)

    def watch(times):
        is_outside = (times < first) | (times > last)
        is_weak = support.contains(times)
        counts[:] += np.count_nonzero([is_outside, is_weak], axis=1)
        done(len(times))

    written = write_clouds(survey, folder, correction, watch, sigma)
    files = tuple((path.name, sha256(path), points) for path, points, _ in written)
    return WrittenClouds(files, sum(outside for _, _, outside in written), *counts.tolist())
