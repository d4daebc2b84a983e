"""Surveys whose points are moved by what no effect describes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from mlscorr.simulate.survey import PulseBlock, SimulatedSurvey
from mlscorr.survey import Mounting, Trajectory


@dataclass(frozen=True)
class RecordedPoints:
    """Points as recorded, and what they were georeferenced with.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    xyz : (n, 3) array
        On the map. Units: m.
    scanner_xyz : (n, 3) array
        In the scanner's frame. Units: m.
    trajectory : Trajectory
        Of all passes.
    mounting : Mounting
    """

    gps_time: np.ndarray
    xyz: np.ndarray
    scanner_xyz: np.ndarray
    trajectory: Trajectory
    mounting: Mounting


@dataclass(frozen=True)
class DisplacedSurvey(SimulatedSurvey):
    """A SimulatedSurvey with one scanner whose points are recorded elsewhere.

    ``move`` is a function of RecordedPoints that returns by how much, (n, 3) in m on the map.
    """

    move: Any = None

    @classmethod
    def of(cls, survey: SimulatedSurvey, move: Callable) -> "DisplacedSurvey":
        """The same survey, moved.

        Parameters
        ----------
        survey : SimulatedSurvey
        move : function
            Of RecordedPoints: by how much they are moved, (n, 3) in m on the map.
        """
        known = {field.name: getattr(survey, field.name) for field in fields(survey)}
        return cls(**known, move=move)

    def blocks(self, **size: int) -> Iterator[PulseBlock]:
        """Blocks as of the survey, their points moved."""
        for block in super().blocks(**size):
            cloud = block.cloud
            poses = (self.trajectory, self.mounting)
            points = RecordedPoints(cloud.gps_time, cloud.xyz, block.pulses.scanner_xyz, *poses)
            yield replace(block, cloud=replace(cloud, xyz=cloud.xyz + self.move(points)))
