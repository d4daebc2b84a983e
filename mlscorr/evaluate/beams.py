"""Beams that no scanner on this vehicle measured: points of another survey, times that run back."""

from collections.abc import Callable, Iterator

import numpy as np

from mlscorr.evaluate.settings import SETTINGS
from mlscorr.frames import to_scanner
from mlscorr.io.settings import SETTINGS as IO
from mlscorr.survey import CloudFile, PointCloud, Survey


class BeamCheck:
    """What a sample of each cloud file says of its beams, taken while the files are read.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self.survey = survey
        self.samples: dict[CloudFile, list[np.ndarray]] = {}

    def watched(self, read: Callable) -> Callable:
        """A function that reads as another one does, and samples what it gives.

        Parameters
        ----------
        read : function of a CloudFile
            Gives an iterator of PointCloud.
        """

        def watch(file: CloudFile) -> Iterator[PointCloud]:
            rows = self.samples[file] = []
            for chunk in read(file):
                rows.append(self._sample(chunk, self.survey.of(file).mounting))
                yield chunk

        return watch

    def _sample(self, chunk, mounting):
        """Time (s), horizontal length (m) and angle off the scan plane (rad) of beams: (n, 3)."""
        trajectory = self.survey.trajectory
        some = chunk[:: max(1, len(chunk) // IO.sampled_points)]
        some = some[trajectory.segment(some.gps_time) >= 0]
        if not len(some):
            return np.empty((0, 3))
        beam = (some.xyz - trajectory.at(some.gps_time).position)[:, :2]
        off = np.zeros(len(some))
        if mounting is not None:
            x, y, across = to_scanner(trajectory, mounting, some.xyz, some.gps_time).T
            off = np.arctan2(np.abs(across), np.hypot(x, y))
        return np.column_stack([some.gps_time, np.linalg.norm(beam, axis=1), off])

    def warnings(self) -> Iterator[str]:
        """A sentence on each file whose beams can't have been measured so."""
        for file, rows in self.samples.items():
            sample = np.concatenate(rows) if rows else np.empty((0, 3))
            if len(sample) < 10:
                continue
            steps = np.diff(sample[:, 0])
            length, off = np.median(sample[:, 1]), np.degrees(np.median(sample[:, 2]))
            if (steps < 0).any() and not (steps > 0).any():
                yield (
                    f"The times of {file.name} run backwards: none of {len(steps)} sampled points "
                    "is later than the one before. Unless the file was sorted so, its gps_time is "
                    "wrong, and points get the correction of another time."
                )
            if length > IO.near or off > SETTINGS.off_plane:
                yield (
                    f"The points of {file.name} lie {length:.0f} m beside the trajectory and "
                    f"{off:.0f} deg off the scan plane (median of {len(sample)} samples; limits "
                    f"{IO.near:.0f} m and {SETTINGS.off_plane:.0f} deg): the file may be of "
                    "another survey with the same times, its gps_time wrong (UTC is 18 s late), or "
                    "[mounting] another scanner's or not in m and deg. Take out what doesn't fit."
                )
