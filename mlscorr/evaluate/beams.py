"""Beams that no scanner on this vehicle measured: points of another survey, times that run back."""

from collections.abc import Callable, Iterator

import numpy as np

from mlscorr.evaluate._settings import SETTINGS
from mlscorr.frames import to_scanner
from mlscorr.io import SETTINGS as IO
from mlscorr.io.trajectories import lacks_time, listed_times, utc_lag
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
        self.times: dict[CloudFile, list[np.ndarray]] = {}

    def watched(self, read: Callable) -> Callable:
        """A function that reads as another one does, and samples what it gives.

        Parameters
        ----------
        read : function of a CloudFile
            Gives an iterator of PointCloud.
        """

        def watch(file: CloudFile) -> Iterator[PointCloud]:
            rows, times = self.samples[file], self.times[file] = [], []
            step = 0
            for chunk in read(file):
                step = step or max(1, len(chunk) // IO.sampled_points)  # of the last, short one too
                some = chunk[::step]
                times.append(some.gps_time.copy())  # a view would hold the times of all points
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

    def outside(self) -> Iterator[str]:
        """A sentence on each file with points outside the trajectory."""
        for file, parts in self.times.items():
            times = np.concatenate([[], *parts])
            is_missing = lacks_time(times - file.time_constant)
            if is_missing.any():
                values = listed_times((times - file.time_constant)[is_missing])
                yield (
                    f"{is_missing.sum()} of {len(times)} points sampled from {file.name} have "
                    f"gps_time {values}: they were written without times, and stay as they are "
                    "(exit code 4). Export them with gps_time, or remove them."
                )
            yield from outside_warnings(self.survey, file, times[~is_missing])

    def warnings(self) -> Iterator[str]:
        """A sentence on each file whose beams can't have been measured so."""
        for file, rows in self.samples.items():
            sample = np.concatenate(rows) if rows else np.empty((0, 4))
            if len(sample) < 10:
                continue
            if sentence := self._other_clock(file, *sample[:, :3].T):
                yield sentence
                continue
            steps = np.diff(sample[:, 0])
            length = np.median(np.hypot(*sample[:, 1:3].T))
            off = np.degrees(np.median(sample[:, 3]))
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

    def _other_clock(self, file, times, *beam):
        """A sentence where points lie about the vehicle leap seconds before or after their times.

        They do where three of four lie nearer to that place than half the way there, and so farther
        from the vehicle. A scanner that looks ahead has beams of many lengths, and a vehicle that
        hardly moves tells neither.
        """
        trajectory = self.survey.trajectory
        beam = np.column_stack(beam)
        lag = utc_lag(trajectory.gps_time, times - file.time_constant)
        for later in (-lag, lag):
            way = _place(trajectory, times + later) - _place(trajectory, times)
            driven = np.linalg.norm(way, axis=1)
            rows = (trajectory.segment(times + later) >= 0) & (driven > IO.moving * lag)
            length, shifted = (np.linalg.norm(x[rows], axis=1) for x in (beam, beam - way))
            if len(length) < 10 or np.quantile(shifted / driven[rows], 0.75) > 0.5:
                continue
            order, side = ("later", "before") if later < 0 else ("earlier", "after")
            behind, ahead = ("trajectory", "cloud") if later < 0 else ("cloud", "trajectory")
            return (
                f"The times of {file.name} are {lag} s {order} than the trajectory's: its points "
                f"lie {np.median(length):.0f} m beside the vehicle, and {np.median(shifted):.0f} m "
                f"beside where it is {lag} s {side} (horizontal medians of {len(length)} samples). "
                f"The {behind} seems to be in UTC, the {ahead} in GPS time: export both in GPS "
                f"time, or add {-later} to trajectory.time_constant (s) in survey.toml."
            )
        return ""


def outside_warnings(survey: Survey, file: CloudFile, times: np.ndarray) -> Iterator[str]:
    """A sentence where points of a file lie outside the trajectory or in its gaps.

    Parameters
    ----------
    survey : Survey
    file : CloudFile
    times : (n,) array
        Spread over the file, in the trajectory's system. Units: s.
    """
    trajectory = survey.trajectory
    outside = times[trajectory.segment(times) < 0]
    if len(outside):
        away = np.fmax.reduce(np.abs(outside[:, None] - trajectory.passes.ravel()).min(axis=1))
        start, end = trajectory.gps_time[[0, -1]]
        yield (
            f"{len(outside)} of {len(times)} points sampled from {file.name} lie outside the "
            f"trajectory [{start:.3f}, {end:.3f}] s or in its gaps ({len(trajectory.gaps)}), up to "
            f"{away:.3f} s from it: they stay as they are (exit code 4). Export the whole "
            "trajectory."
        )


def _place(trajectory, times):
    """Easting and northing (n, 2) at times, that of its ends beyond them. Units: m."""
    return np.column_stack(
        [np.interp(times, trajectory.gps_time, x) for x in trajectory.position.T[:2]]
    )
