"""A survey as it was recorded."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from mlscorr.survey.beliefs import SEARCH_RADIUS, Pos, Scanner
from mlscorr.survey.clouds import CloudFile
from mlscorr.survey.targets import ControlPoints
from mlscorr.survey.trajectory import Mounting, Trajectory


@dataclass(frozen=True)
class InputFile:
    """A file that was read.

    Parameters
    ----------
    what : str
        What it is, in words.
    path : Path
    state : tuple of int
        Disk, number, size (bytes) and times of change (ns) when its reading began.
    """

    what: str
    path: Path
    state: tuple[int, ...]


@dataclass(frozen=True)
class Survey:
    """One mobile survey as it was recorded: cloud files, trajectory, mounting, control, beliefs.

    Parameters
    ----------
    name : str
    path : Path
        Of survey.toml.
    crs : str or None
    clouds : tuple of CloudFile
    trajectory : Trajectory
    mounting : Mounting or None
    control, check : ControlPoints
        Those that take part in an estimate, and those that never do.
    scanner : Scanner
    pos : Pos
    reference : Path, optional
        A reference surface in the cloud's coordinates.
    search_radius : float
        How far from its surveyed point a target may lie in the cloud. Units: m.
    use_ties : bool
        Whether a correction may use what two passes both saw.
    notes : tuple of str
        What the readers worked out, for the report.
    inputs : tuple of InputFile
        survey.toml and every file that it names.
    """

    name: str
    path: Path
    crs: str | None
    clouds: tuple[CloudFile, ...]
    trajectory: Trajectory
    mounting: Mounting | None
    control: ControlPoints
    check: ControlPoints
    scanner: Scanner = field(default_factory=Scanner)
    pos: Pos = field(default_factory=Pos)
    reference: Path | None = None
    search_radius: float = SEARCH_RADIUS
    use_ties: bool = True
    notes: tuple[str, ...] = ()
    inputs: tuple[InputFile, ...] = ()

    @cached_property
    def surveyed(self) -> ControlPoints:
        """Control and check points, in this order."""
        return self.control + self.check

    @property
    def points(self) -> int:
        """Number of points in all cloud files."""
        return sum(file.points for file in self.clouds)

    @property
    def lever_arm(self) -> np.ndarray:
        """The scanner (3,) in body axes; zero where no mounting is known. Units: m."""
        return np.zeros(3) if self.mounting is None else self.mounting.lever_arm
