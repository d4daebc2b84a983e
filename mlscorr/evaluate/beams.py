"""Detection of beams that no scanner on this vehicle measured: foreign points, wrong times."""

from collections.abc import Callable, Iterator

import numpy as np

from mlscorr.evaluate._settings import SETTINGS
from mlscorr.evaluate.wording import BEAMS
from mlscorr.frames import to_scanner
from mlscorr.io import SETTINGS as IO
from mlscorr.io.trajectories import lacks_time, listed_times, utc_lag
from mlscorr.survey import CloudFile, PointCloud, Statement, Survey


class BeamCheck:
    """Sample of each cloud file's beams, collected while the files are read.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self.survey = survey
        self.samples: dict[CloudFile, list[np.ndarray]] = {}
        self.times: dict[CloudFile, list[np.ndarray]] = {}

    def watched(self, read: Callable) -> Callable:
        """Wrap a reader so that its points are sampled.

        Parameters
        ----------
        read : function of a CloudFile
            Returns an iterator of PointCloud.
        """

        def watch(file: CloudFile) -> Iterator[PointCloud]:
            rows, times = self.samples[file], self.times[file] = [], []
            step = 0
            for chunk in read(file):
                step = step or max(1, len(chunk) // IO.sampled_points)  # also of the short last one
                some = chunk[::step]
                times.append(some.gps_time.copy())  # a view would keep the times of all points
                some = some[self.survey.trajectory.segment(some.gps_time) >= 0]
                rows.append(self._sample(some, self.survey.of(file).mounting))
                yield chunk

        return watch

    def _sample(self, some, mounting):
        """Time (s), horizontal vector (m) and angle off the scan plane (rad) of beams: (n, 4)."""
        trajectory = self.survey.trajectory
        beam = (some.xyz - trajectory.at(some.gps_time).position)[:, :2]
        off = np.zeros(len(some))
        if mounting is not None:
            x, y, across = to_scanner(trajectory, mounting, some.xyz, some.gps_time).T
            off = np.arctan2(np.abs(across), np.hypot(x, y))
        return np.column_stack([some.gps_time, beam, off])

    def outside(self) -> list[str]:
        """Return a sentence on each file with points outside the trajectory."""
        return [statement.sentence(BEAMS) for statement in self.uncovered()]

    def uncovered(self) -> Iterator[Statement]:
        """Yield files with points without a time, or outside the trajectory."""
        for file, parts in self.times.items():
            times = np.concatenate([[], *parts])
            is_missing = lacks_time(times - file.time_constant)
            if is_missing.any():
                values = {
                    "file": file.name,
                    "count": is_missing.sum(),
                    "samples": len(times),
                    "values": listed_times((times - file.time_constant)[is_missing]),
                }
                yield Statement("no time", "fault", values)
            yield from _outside(self.survey, file, times[~is_missing])

    def warnings(self) -> list[str]:
        """Return a sentence on each file with impossible beams."""
        return [statement.sentence(BEAMS) for statement in self.doubts()]

    def doubts(self) -> Iterator[Statement]:
        """Yield files with impossible beams, and the reason."""
        for file, rows in self.samples.items():
            sample = np.concatenate(rows) if rows else np.empty((0, 4))
            if len(sample) < 10:
                continue
            other_clock = self._other_clock(file, sample[:, 0], sample[:, 1:3])
            if other_clock is not None:
                yield other_clock
                continue
            steps = np.diff(sample[:, 0])
            length = np.median(np.hypot(*sample[:, 1:3].T))
            off = np.degrees(np.median(sample[:, 3]))
            if (steps < 0).any() and not (steps > 0).any():
                values = {"file": file.name, "steps": len(steps)}
                yield Statement("backwards", "warning", values)
            if length > IO.near or off > SETTINGS.off_plane:
                values = {
                    "file": file.name,
                    "beside": length,
                    "off": off,
                    "samples": len(sample),
                    "near": IO.near,
                    "off_plane": SETTINGS.off_plane,
                }
                yield Statement("other survey", "warning", values)

    def _other_clock(self, file, times, beam):
        """Doubt if points are where the vehicle was leap seconds before or after their times.

        This holds if three of four points are closer to that position than half the distance to it,
        and thus farther from the vehicle. A forward-looking scanner has beams of many lengths, and
        a slow vehicle allows no decision.
        """
        trajectory = self.survey.trajectory
        lag = utc_lag(trajectory.gps_time, times - file.time_constant)
        for later in (-lag, lag):
            motion = _place(trajectory, times + later) - _place(trajectory, times)
            driven = np.linalg.norm(motion, axis=1)
            rows = (trajectory.segment(times + later) >= 0) & (driven > IO.moving * lag)
            length, shifted = (np.linalg.norm(x[rows], axis=1) for x in (beam, beam - motion))
            if len(length) < 10 or np.quantile(shifted / driven[rows], 0.75) > 0.5:
                continue
            values = {
                "file": file.name,
                "lag": lag,
                "later": later,
                "beside": np.median(length),
                "shifted": np.median(shifted),
                "samples": len(length),
            }
            return Statement("other clock", "warning", values)
        return None


def outside_warnings(survey: Survey, file: CloudFile, times: np.ndarray) -> list[str]:
    """Sentence on points of a file outside the trajectory or in its gaps.

    Parameters
    ----------
    survey : Survey
    file : CloudFile
    times : (n,) array
        Times spread over the file, in the trajectory's system. Units: s.
    """
    return [statement.sentence(BEAMS) for statement in _outside(survey, file, times)]


def _outside(survey, file, times) -> Iterator[Statement]:
    trajectory = survey.trajectory
    outside = times[trajectory.segment(times) < 0]
    if len(outside):
        away = np.fmax.reduce(np.abs(outside[:, None] - trajectory.passes.ravel()).min(axis=1))
        start, end = trajectory.gps_time[[0, -1]]
        values = {
            "file": file.name,
            "count": len(outside),
            "samples": len(times),
            "start": start,
            "end": end,
            "gaps": len(trajectory.gaps),
            "away": away,
        }
        yield Statement("outside", "fault", values)


def _place(trajectory, times):
    """Easting and northing (n, 2) at times; beyond the ends, those of the ends. Units: m."""
    return np.column_stack(
        [np.interp(times, trajectory.gps_time, x) for x in trajectory.position.T[:2]]
    )
