"""Clouds as a correction puts them."""

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
    """Write a survey's clouds into a folder, under their names, as LAZ what was no LAS.

    Parameters
    ----------
    survey : Survey
    folder : Path
    correction : anything with ``apply(cloud) -> cloud``, or that of each scanner by its name
    done : function of a number of points
        Is told how many were just written.

    Returns
    -------
    list of (path, points, points outside the trajectory)
        Scanner by scanner, but a file of several once; the last stay as they were.
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
    """Corrected clouds, and how many of their points nothing holds or are noise.

    Parameters
    ----------
    files : tuple of (name, SHA-256, points)
    outside : int
        Points outside the trajectory, which stayed as they were.
    uncontrolled : int
        Before the first or past the last control point.
    extrapolated : int
        In weak stretches.
    noise : int
        Flagged as noise, and not measured.
    """

    files: tuple[tuple[str, str, int], ...] = ()
    outside: int = 0
    uncontrolled: int = 0
    extrapolated: int = 0
    noise: int = 0

    def below(self, folder: str) -> WrittenClouds:
        """The same, with names of files in a folder.

        Parameters
        ----------
        folder : str
        """
        rows = tuple((f"{folder}/{name}", content, points) for name, content, points in self.files)
        return replace(self, files=rows)

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
            sum(part.noise for part in parts),
        )


@dataclass(frozen=True)
class MovedClouds:
    """Clouds of a survey, how they are corrected, and what holds that.

    Parameters
    ----------
    survey : Survey
    correction : Correction
    held : pair of (float, float) and Support
        First and last control epoch (s), and what holds the correction along the drive.
    sample : function, optional
        As of CorrectedPart.
    """

    survey: Survey
    correction: Correction
    held: tuple[tuple[float, float], Support]
    sample: Callable[[PointCloud], object] | None = None

    def parts(
        self, watch: Callable[[np.ndarray, np.ndarray], object], additions: Additions
    ) -> Iterator[CorrectedPart]:
        """The points of each file and scanner.

        Parameters
        ----------
        watch : function
            As of CorrectedPart.
        additions : Additions
            What the files get beside new places.
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
    """Write the clouds of drives, a file of several once, and count the points that nothing holds.

    Parameters
    ----------
    drives : sequence of MovedClouds
        One, or several that share files.
    folder : Path
    done : function of a number of points
    additions : Additions
        What the files get beside new places.

    Returns
    -------
    list of WrittenClouds
        Of each drive, with the numbers of its own points.
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
    """A function of gps_time and noise that counts, and tells how many there were."""
    (first, last), support = held

    def watch(times, is_noise):
        is_outside = (times < first) | (times > last)
        counts[:] += np.count_nonzero([is_outside, support.contains(times), is_noise], axis=1)
        done(len(times))

    return watch
