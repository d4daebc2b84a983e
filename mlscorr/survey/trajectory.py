"""Trajectory of the POS, and mounting of the scanner on it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from mlscorr.survey._angles import angles_from_attitude, attitude_from_angles
from mlscorr.survey._open3d import line_geometry
from mlscorr.survey.clouds import WEEK
from mlscorr.survey.columns import AXES, check_lengths, columns_frame
from mlscorr.survey.summary import Summary

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

Result = TypeVar("Result")
ANGLES = ("roll", "pitch", "heading")
GAP_FACTOR = 10.0  # a step longer than ten median steps is a gap
SAME_EPOCH = 1.0  # s; control points closer in time give the same information on the POS


@dataclass(frozen=True, repr=False)
class Trajectory(Summary):
    """Positions and attitudes of the POS navigation center over time.

    Parameters
    ----------
    gps_time : (n,) array
        Strictly increasing. Units: s.
    position : (n, 3) array
        Easting, northing, height. Units: m.
    attitude : Rotation
        n rotations R_P^G from body to map axes.
    position_sigma, attitude_sigma : (n, 3) array, optional
        One sigma of E, N, H (m) and of roll, pitch, heading (rad).
    session : (n,) int array, optional
        Session number of each epoch, if time steps alone do not separate sessions.
    scanned : (n,) bool array, optional
        True for epochs near points of the clouds, if this was determined.
    weeks : (n,) int array, optional
        Weeks that were added to the times of the file, where seconds of week restart.

    Raises
    ------
    ValueError
        If there are fewer than two epochs, lengths differ, times do not increase or values are not
        finite.
    """

    gps_time: np.ndarray
    position: np.ndarray
    attitude: Rotation
    position_sigma: np.ndarray | None = None
    attitude_sigma: np.ndarray | None = None
    session: np.ndarray | None = None
    scanned: np.ndarray | None = None
    weeks: np.ndarray | None = None

    def __post_init__(self):
        check_lengths(self)
        if len(self.gps_time) < 2:
            raise ValueError(f"A trajectory needs at least 2 epochs; this one has {len(self)}.")
        for name in ("gps_time", "position", "position_sigma", "attitude_sigma"):
            values = getattr(self, name)
            if values is not None and not np.isfinite(values).all():
                bad = int((~np.isfinite(values)).reshape(len(self), -1).any(axis=1).sum())
                raise ValueError(
                    f"{bad} of {len(self)} trajectory epochs have a {name} that is not a number."
                )
        steps = np.diff(self.gps_time)
        if (steps <= 0).any():
            raise ValueError(
                f"The trajectory's gps_time must increase: {int((steps == 0).sum())} epochs are "
                f"duplicates and {int((steps < 0).sum())} go back in time (first after "
                f"{self.gps_time[np.argmax(steps <= 0)]:.3f} s). Sort the file and remove "
                "repeated epochs."
            )

    @classmethod
    def from_arrays(
        cls,
        gps_time: ArrayLike,
        position: ArrayLike,
        attitude: ArrayLike,
        position_sigma: ArrayLike | None = None,
        attitude_sigma: ArrayLike | None = None,
    ) -> Trajectory:
        """Make a trajectory from arrays, with angles in degrees as in trajectory.csv.

        Parameters
        ----------
        gps_time : (n,) array
            Strictly increasing. Units: s.
        position : (n, 3) array
            Easting, northing, height of the navigation center. Units: m.
        attitude : (n, 3) array
            Roll (right side down), pitch (nose up), heading (clockwise from grid north). Units:
            deg.
        position_sigma : (n, 3) or (3,) array, optional
            One sigma of E, N, H. Units: m.
        attitude_sigma : (n, 3) or (3,) array, optional
            One sigma of roll, pitch, heading. Units: deg.

        Raises
        ------
        ValueError
            See the class.

        >>> from mlscorr.survey import Trajectory
        >>> path = [[532_000.0, 3_374_000.0, 42.0], [532_001.0, 3_374_000.0, 42.0]]
        >>> len(Trajectory.from_arrays([357_700.0, 357_700.1], path, [[0.0, 0.0, 90.0]] * 2))
        2
        """
        time = np.asarray(gps_time, float)
        angles = np.radians(np.asarray(attitude, float))
        if angles.shape != (len(time), 3):
            raise ValueError(
                f"attitude has the shape {angles.shape}: give ({len(time)}, 3), roll, pitch and "
                "heading of each epoch in degrees."
            )
        if not np.isfinite(angles).all():
            bad = int((~np.isfinite(angles)).any(axis=1).sum())
            raise ValueError(
                f"{bad} of {len(time)} trajectory epochs have an attitude that is not a number."
            )
        sigmas = []
        for sigma, unit in ((position_sigma, 1.0), (attitude_sigma, np.radians(1.0))):
            rows = None
            if sigma is not None:
                of_epoch = np.broadcast_to(np.asarray(sigma, float), (len(time), 3))
                rows = of_epoch * unit
            sigmas.append(rows)
        place = np.asarray(position, float)
        return cls(time, place, attitude_from_angles(*angles.T), *sigmas)

    def plot(self) -> Figure:
        """Plot the path from above, with a mark at its start."""
        from mlscorr.survey._figure import path_figure

        return path_figure(self.position, self.line_pairs)

    def to_open3d(self, origin: ArrayLike | None = None) -> Any:
        """Convert the path to lines between epochs, broken at its gaps.

        Parameters
        ----------
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``.

        Returns
        -------
        open3d.t.geometry.LineSet
        """
        place = None if origin is None else np.asarray(origin, float)
        return line_geometry(self.position, self.line_pairs, place, {})

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row for each epoch, as in trajectory.csv; requires pandas."""
        angles = np.degrees(angles_from_attitude(self.attitude))
        columns = {"gps_time": self.gps_time}
        columns |= dict(zip(AXES, self.position.T, strict=True))
        columns |= dict(zip(ANGLES, angles, strict=True))
        for names, sigma, unit in (
            (AXES, self.position_sigma, 1.0),
            (ANGLES, self.attitude_sigma, np.degrees(1.0)),
        ):
            if sigma is not None:
                parts = zip(names, (sigma * unit).T, strict=True)
                columns |= {f"sigma_{name}": values for name, values in parts}
        return columns_frame(columns)

    @property
    def line_pairs(self) -> np.ndarray:
        """Pairs of indices (k, 2) of consecutive epochs without a gap between them."""
        first = np.arange(len(self) - 1)
        first = first[~np.isin(self.gps_time[:-1], self.gaps[:, 0])]
        return np.column_stack([first, first + 1])

    def __len__(self) -> int:
        return len(self.gps_time)

    @property
    def file_time(self) -> np.ndarray:
        """Times (n,) in s as in the file, where seconds of week restart."""
        if self.weeks is None:
            return self.gps_time
        return self.gps_time - WEEK * self.weeks

    def derived(self, function: Callable[[Trajectory], Result]) -> Result:
        """Return a function's result for this trajectory, which is computed only once.

        Parameters
        ----------
        function : function of a Trajectory
        """
        if function not in self._derived:
            self._derived[function] = function(self)
        return self._derived[function]

    @cached_property
    def _derived(self):
        return {}

    def __getstate__(self):
        """Return the fields only; derived values are computed again after unpickling."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def gaps(self) -> np.ndarray:
        """Start and end (k, 2) in s of the steps longer than ten times the median step.

        With sessions, the median is that of each, and every change of session is a gap.
        """
        steps = np.diff(self.gps_time)
        if self.session is None:
            session = np.zeros(len(self), int)
        else:
            session = self.session
        is_gap = np.diff(session) != 0
        for number in np.unique(session[:-1][~is_gap]):
            inside = (session[:-1] == number) & ~is_gap
            is_gap[inside] = steps[inside] > GAP_FACTOR * np.median(steps[inside])
        last = np.flatnonzero(is_gap)
        return np.column_stack([self.gps_time[last], self.gps_time[last + 1]])

    @cached_property
    def passes(self) -> np.ndarray:
        """Start and end (k, 2) in s of the parts without a gap."""
        starts = np.append(self.gps_time[0], self.gaps[:, 1])
        return np.column_stack([starts, np.append(self.gaps[:, 0], self.gps_time[-1])])

    def segment(self, gps_time: ArrayLike) -> np.ndarray:
        """Index of the gap-free segment that contains each time, from 0; -1 if none does.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        gps_time = np.asarray(gps_time, dtype=float)
        starts, ends = self.passes.T
        number = np.searchsorted(starts, gps_time, side="right") - 1
        return np.where(gps_time <= ends[number], number, -1)

    @property
    def scanned_rows(self) -> np.ndarray:
        """Indices (k,) of the epochs with points of the clouds, or of all if this is unknown."""
        known = self.scanned is not None and self.scanned.any()
        if known:
            return np.flatnonzero(self.scanned)
        return np.arange(len(self))

    @property
    def scanned_passes(self) -> np.ndarray:
        """Start and end (k, 2) in s of the scanned time within each gap-free segment."""
        time = self.gps_time[self.scanned_rows]
        first = np.flatnonzero(np.diff(self.segment(time), prepend=-1))
        return np.column_stack([time[first], time[np.append(first[1:], len(time)) - 1]])

    def scanned_at(self, seconds: np.ndarray) -> Trajectory:
        """Return the trajectory with the seconds that contain points of the clouds marked.

        Parameters
        ----------
        seconds : (k,) int array
            Whole seconds of gps_time.
        """
        inside = np.isin(np.floor(self.gps_time), seconds)
        segment = self.segment(self.gps_time)
        scanned = inside.copy()
        is_step = np.diff(segment) == 0
        scanned[1:] |= inside[:-1] & is_step  # points exist up to the next epoch
        scanned[:-1] |= inside[1:] & is_step
        return replace(self, scanned=scanned)

    @property
    def duration(self) -> float:
        """Recorded time in s, without the gaps."""
        return self.recorded_time(*self.gps_time[[0, -1]])

    @property
    def length(self) -> float:
        """Length of the recorded path in m, without the gaps."""
        steps = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return float(steps[np.diff(self.segment(self.gps_time)) == 0].sum())

    def count_passes(self, times: Iterable[np.ndarray], pause: float) -> int:
        """Count the passes in which several files were scanned.

        A pass ends at a gap of the trajectory, and where no file continues within the pause. The
        tiles of one drive, or the files of two scanners, thus form one pass.

        Parameters
        ----------
        times : iterable of (n,) array
            Times of some points of each file, in any order. Units: s.
        pause : float
            Files continue if they do within this and their own longest step. Units: s.
        """
        spans = []
        for of_file in times:
            segment = self.segment(of_file)
            for number in np.unique(segment[segment >= 0]):
                own = np.sort(of_file[segment == number])
                widest = np.diff(own).max(initial=0.0)
                spans.append((own[0], own[-1] + widest, number))
        if not spans:
            return 0
        starts, ends, segments = np.array(sorted(spans)).T
        goes_on = starts[1:] <= np.maximum.accumulate(ends)[:-1] + pause
        goes_on &= segments[1:] == segments[:-1]
        return 1 + int(np.count_nonzero(~goes_on))

    def recorded_time(self, start: float, end: float) -> float:
        """Time from start to end, without the gaps that are entirely between them. Units: s."""
        starts, ends = self.gaps.T
        return float(end - start - (ends - starts)[(starts >= start) & (ends <= end)].sum())

    def control_interval(self, gps_time: np.ndarray) -> float:
        """Mean interval between control epochs, without the gaps. Units: s.

        It is the whole recorded time if there is one control epoch, or if less than a second was
        recorded between them, as from the end of a pass to the start of the next.

        Parameters
        ----------
        gps_time : (n,) array
            Times of observed targets, at least one. Units: s.
        """
        epochs = control_epochs(gps_time)
        interval = self.recorded_time(epochs[0], epochs[-1]) / max(len(epochs) - 1, 1)
        if interval >= SAME_EPOCH:
            return interval
        return self.recorded_time(*self.gps_time[[0, -1]])

    def select(self, rows: slice | ArrayLike) -> Trajectory:
        """Select some of the epochs, in any order.

        Parameters
        ----------
        rows : slice, or (n,) bool or (m,) int array
        """
        columns = [getattr(self, field.name) for field in fields(self)]
        for i, column in enumerate(columns):
            if column is not None:
                columns[i] = column[rows]
        return _Epochs(*columns)

    @classmethod
    def concatenate(cls, parts: Iterable[Trajectory]) -> Trajectory:
        """Merge the epochs of several trajectories by time, with the columns common to all.

        Parameters
        ----------
        parts : iterable of Trajectory
        """
        table = [[getattr(part, field.name) for field in fields(cls)] for part in parts]
        order = np.argsort(np.concatenate([row[0] for row in table]))

        def joined(columns):
            if any(column is None for column in columns):
                return None
            if isinstance(columns[0], Rotation):
                return Rotation.concatenate(columns)[order]
            return np.concatenate(columns)[order]

        return cls(*map(joined, zip(*table, strict=True)))

    def at(self, gps_time: ArrayLike) -> Trajectory:
        """Interpolate the trajectory: positions and sigmas linearly, attitudes by slerp.

        Parameters
        ----------
        gps_time : (m,) array
            Units: s.

        Raises
        ------
        ValueError
            If a time is outside the trajectory or in one of its gaps.
        """
        gps_time = np.atleast_1d(np.asarray(gps_time, dtype=float))
        outside = self.segment(gps_time) < 0
        if outside.any():
            raise ValueError(
                f"{outside.sum()} of {len(gps_time)} times are outside the trajectory "
                f"[{self.gps_time[0]:.3f}, {self.gps_time[-1]:.3f}] s or in one of its "
                f"{len(self.gaps)} gaps (first: {gps_time[np.argmax(outside)]:.3f} s)."
            )

        def linear(values):
            if values is None:
                return None
            return np.column_stack([np.interp(gps_time, self.gps_time, v) for v in values.T])

        before = np.searchsorted(self.gps_time, gps_time, side="right") - 1
        session = None if self.session is None else self.session[before]
        weeks = None if self.weeks is None else self.weeks[before]
        near = np.zeros(len(self), dtype=bool)
        near[before] = True
        near[1:] |= near[:-1]
        near[-2:] = True  # keep the last interval, also if no time is queried
        return _Epochs(
            gps_time,
            linear(self.position),
            Slerp(self.gps_time[near], self.attitude[near])(gps_time),
            linear(self.position_sigma),
            linear(self.attitude_sigma),
            session,
            weeks=weeks,
        )


class _Epochs(Trajectory):
    """Trajectory interpolated at arbitrary times, in any order and number."""

    def __post_init__(self):
        pass


@dataclass(frozen=True)
class Mounting:
    """Transformation from the scanner frame to the body frame.

    Parameters
    ----------
    lever_arm : (3,) array
        Units: m.
    boresight : Rotation
        R_L^P.
    covariance : (6, 6) array, optional
        Of the lever arm (m) and of a small rotation of the boresight about the body axes (rad),
        from a calibration, or from both measured sigmas.
    measured : (6,) array, optional
        One sigma of each component measured without a calibration; NaN for the others. Units: m,
        rad.
    """

    lever_arm: np.ndarray
    boresight: Rotation
    covariance: np.ndarray | None = None
    measured: np.ndarray | None = None

    @classmethod
    def from_angles(cls, lever_arm: ArrayLike, boresight: ArrayLike) -> Mounting:
        """Make a mounting from the numbers in survey.toml.

        Parameters
        ----------
        lever_arm : (3,) array
            Right, forward, up from the navigation center to the scanner's origin. Units: m.
        boresight : (3,) array
            [a, b, c] of R_L^P = Rz(c) Ry(b) Rx(a). Units: deg.

        Raises
        ------
        ValueError
            If either is not three finite numbers.

        >>> from mlscorr.survey import Mounting
        >>> Mounting.from_angles([0.1, -0.6, 0.4], [90.0, 0.0, 35.0]).lever_arm.tolist()
        [0.1, -0.6, 0.4]
        """
        arm = np.asarray(lever_arm, float)
        angles = np.asarray(boresight, float)
        for name, values, unit in (("lever_arm", arm, "m"), ("boresight", angles, "deg")):
            if values.shape != (3,) or not np.isfinite(values).all():
                raise ValueError(f"{name} must be three finite numbers in {unit}, not {values}.")
        return cls(arm, Rotation.from_euler("xyz", angles, degrees=True))


def control_epochs(gps_time: np.ndarray) -> np.ndarray:
    """Control epochs (k,): sorted times, without those within a second of the last one kept.

    Parameters
    ----------
    gps_time : (n,) array
        Times of observed targets. Units: s.
    """
    epochs: list[float] = []
    for time in np.sort(gps_time):
        if not epochs or time - epochs[-1] > SAME_EPOCH:
            epochs.append(time)
    return np.array(epochs)
