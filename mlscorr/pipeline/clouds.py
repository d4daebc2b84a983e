"""Corrected clouds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.correction import Correction, PointSigma
from mlscorr.estimate import Support
from mlscorr.io.clouds import Additions, CorrectedPart, sha256, write_parts, written_name
from mlscorr.survey import Correcting, PointCloud, Survey


def write_clouds(
    survey: Survey,
    folder: Path,
    correction: Correcting | Mapping[str, Correcting],
    done: Callable[[int], object],
) -> list[tuple[Path, int, int]]:
    """Write a survey's clouds into a folder, with their names, foreign formats as LAZ.

    Parameters
    ----------
    survey : Survey
    folder : Path
    correction : anything with ``apply(cloud) -> cloud``, or that of each scanner by its name
    done : function of a number of points
        Called with the number of points just written.

    Returns
    -------
    list of (path, points, points outside the trajectory)
        Scanner by scanner, but a file of several only once; points outside are unchanged.
    """
    parts: dict[Path, list[CorrectedPart]] = {}
    for name, part in survey.by_scanner.items():
        if isinstance(correction, Mapping):
            moved = correction[name]
        else:
            moved = correction
        for file in part.clouds:
            corrected = CorrectedPart(file, moved, watch=lambda times, _: done(len(times)))
            parts.setdefault(file.path, []).append(corrected)
    written = []
    for source, some in parts.items():
        path = folder / written_name(source)
        outside = write_parts(some, path)
        written.append((path, sum(part.file.points for part in some), sum(outside)))
    return written


@dataclass(frozen=True)
class WrittenClouds:
    """Corrected clouds, and numbers of unconstrained and of noise points.

    Parameters
    ----------
    files : tuple of (name, SHA-256, points)
    outside : int
        Unchanged points outside the trajectory.
    uncontrolled : int
        Points before the first or past the last control point.
    extrapolated : int
        Points in poorly constrained intervals.
    noise : int
        Points flagged as noise, which are not used.
    """

    files: tuple[tuple[str, str, int], ...] = ()
    outside: int = 0
    uncontrolled: int = 0
    extrapolated: int = 0
    noise: int = 0

    def below(self, folder: str) -> WrittenClouds:
        """Return the clouds with file names in a subfolder.

        Parameters
        ----------
        folder : str
        """
        rows = tuple((f"{folder}/{name}", content, points) for name, content, points in self.files)
        return replace(self, files=rows)

    @classmethod
    def join(cls, parts: Iterable[WrittenClouds]) -> WrittenClouds:
        """Join the clouds of several files.

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
            sum(part.noise for part in parts),
        )


@dataclass(frozen=True)
class MovedClouds:
    """Clouds of a survey, their correction, and its constraints.

    Parameters
    ----------
    survey : Survey
    correction : Correction
    held : pair of (float, float) and Support
        First and last control epoch (s), and constraints of the correction along the drive.
    sample : function, optional
        See CorrectedPart.
    """

    survey: Survey
    correction: Correction
    held: tuple[tuple[float, float], Support]
    sample: Callable[[PointCloud], object] | None = None

    def parts(
        self, watch: Callable[[np.ndarray, np.ndarray], object], additions: Additions
    ) -> Iterator[CorrectedPart]:
        """Yield the points of each file and scanner.

        Parameters
        ----------
        watch : function
            See CorrectedPart.
        additions : Additions
            Additions to the files.
        """
        for part in self.survey.by_scanner.values():
            of_part = self.correction, part.scanner, part.mounting
            sigma = PointSigma.of(*of_part) if additions.sigma else None
            for file in part.clouds:
                yield CorrectedPart(file, self.correction, sigma, watch, additions, self.sample)


def write_counted(
    drives: Sequence[MovedClouds],
    folder: Path,
    done: Callable[[int], object],
    additions: Additions,
) -> list[WrittenClouds]:
    """Write the clouds of drives, each file once, and count unconstrained points.

    Parameters
    ----------
    drives : sequence of MovedClouds
        One drive, or several that share files.
    folder : Path
    done : function of a number of points
    additions : Additions
        Additions to the files.

    Returns
    -------
    list of WrittenClouds
        Clouds of each drive, with the numbers of its own points.
    """
    counts = [np.zeros(3, int) for _ in drives]
    parts: dict[Path, list[tuple[int, CorrectedPart]]] = {}
    for number, drive in enumerate(drives):
        for part in drive.parts(_counting(drive.held, counts[number], done), additions):
            parts.setdefault(part.file.path, []).append((number, part))
    rows: list[list] = [[] for _ in drives]
    for source, some in parts.items():
        path = folder / written_name(source)
        outside = write_parts([part for _, part in some], path)
        content = sha256(path)
        for number in dict.fromkeys(number for number, _ in some):
            own = [place for place, (owner, _) in enumerate(some) if owner == number]
            points = sum(some[place][1].file.points for place in own)
            rows[number].append((path.name, content, points, sum(outside[place] for place in own)))
    return [
        WrittenClouds(tuple(row[:3] for row in own), sum(row[3] for row in own), *count.tolist())
        for own, count in zip(rows, counts, strict=True)
    ]


def _counting(held, counts, done):
    """Function of gps_time and noise that counts points and reports progress."""
    (first, last), support = held

    def watch(times, is_noise):
        is_outside = (times < first) | (times > last)
        counts[:] += np.count_nonzero([is_outside, support.contains(times), is_noise], axis=1)
        done(len(times))

    return watch
