"""Number of points flagged as noise, counted while clouds are read for a measurement."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from mlscorr.survey import CloudFile


@dataclass
class NoiseCount:
    """Points that were left out as noise.

    Parameters
    ----------
    parts : dict
        Numbers of points flagged and read, by file and the part of it that was read (None for all).
    """

    parts: dict[CloudFile, dict[tuple[int, int] | None, tuple[int, int]]] = field(
        default_factory=dict
    )

    def add(self, file: CloudFile, part: tuple[int, int] | None, flagged: int, read: int) -> None:
        """Count what was read once, however often it is read again.

        Parameters
        ----------
        file : CloudFile
        part : (int, int) or None
            First point, and the one behind the last; None for all of the file.
        flagged, read : int
            Number of points.
        """
        self.parts.setdefault(file, {})[part] = flagged, read

    @property
    def totals(self) -> tuple[int, int]:
        """Number of points flagged as noise, and of all that were read."""
        flagged = read = 0
        for own in self.parts.values():
            for counts in [own[None]] if None in own else own.values():
                flagged += counts[0]
                read += counts[1]
        return flagged, read

    @property
    def sentence(self) -> str:
        """Sentence on them; empty where there are none."""
        flagged, read = self.totals
        if not flagged:
            return ""
        classes = sorted({number for file in self.parts for number in file.noise_classes})
        return noise_sentence(flagged, read, classes)


def noise_sentence(flagged: int, points: int, classes: list[int]) -> str:
    """Sentence on points that are flagged as noise.

    Parameters
    ----------
    flagged, points : int
        Number of points flagged, and of all.
    classes : list of int
        That count as noise.
    """
    if classes:
        kinds = f"withheld or of class {' or '.join(map(str, classes))}"
    else:
        kinds = "withheld"
    return (
        f"{flagged} of {points} points read are flagged as noise ({kinds}). They take no part in "
        "any measurement, and are corrected like all others; cloud.noise_classes in survey.toml "
        "names other classes."
    )


_count: ContextVar[NoiseCount | None] = ContextVar("count", default=None)


@contextmanager
def counted_noise() -> Iterator[NoiseCount]:
    """Count the points that reading leaves out as noise until the block ends.

    Yields
    ------
    NoiseCount
    """
    count = NoiseCount()
    token = _count.set(count)
    try:
        yield count
    finally:
        _count.reset(token)


def count_noise(file: CloudFile, part: tuple[int, int] | None, flagged: int, read: int) -> None:
    """Add to the count, where one is kept; as NoiseCount.add.

    Parameters
    ----------
    file : CloudFile
    part : (int, int) or None
    flagged, read : int
    """
    count = _count.get()
    if count is not None:
        count.add(file, part, flagged, read)
