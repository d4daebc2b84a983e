"""Where the POS was, and how the scanner stands on it."""

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
SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS


@dataclass(frozen=True, repr=False)
class Trajectory(Summary):
    """Positions and attitudes of the POS navigation centre over time.

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
        Number of the session of the POS of each epoch, where steps alone don't part sessions.
    scanned : (n,) bool array, optional
        Which epochs have points of the clouds about them, where somebody looked.
    weeks : (n,) int array, optional
        Weeks that were added to the times of the file, whose seconds of week start again.

    Raises
    ------
    ValueError
        For fewer than two epochs, columns of unlike lengths, times that do not increase, or values
        that are not finite.
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
        """Make a trajectory of arrays, angles in degrees as in trajectory.csv.

        Parameters
        ----------
        gps_time : (n,) array
            Strictly increasing. Units: s.
        position : (n, 3) array
            Easting, northing, height of the navigation centre. Units: m.
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
            As the class itself does.

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
        """The path from above, with a mark at its start."""
        from mlscorr.survey._figure import path_figure

        return path_figure(self.position, self.line_pairs)

    def to_open3d(self, origin: ArrayLike | None = None) -> Any:
        """The path as lines between epochs, broken at its gaps.

        Parameters
        ----------
        origin : (3,) array, optional
            As of ``PointCloud.to_open3d``.

        Returns
        -------
        open3d.t.geometry.LineSet
        """
        place = None if origin is None else np.asarray(origin, float)
        return line_geometry(self.position, self.line_pairs, place, {})

    def to_frame(self) -> pandas.DataFrame:
        """A row for each epoch, angles in degrees, as trajectory.csv; pandas is needed for it."""
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
        """Numbers (k, 2) of the epochs between which no gap lies."""
        first = np.arange(len(self) - 1)
        first = first[~np.isin(self.gps_time[:-1], self.gaps[:, 0])]
        return np.column_stack([first, first + 1])

    def __len__(self) -> int:
        return len(self.gps_time)

    @property
    def file_time(self) -> np.ndarray:
        """Times (n,) in s as a file has them, whose seconds of week start again."""
        if self.weeks is None:
            return self.gps_time
        return self.gps_time - WEEK * self.weeks

    def derived(self, function: Callable[[Trajectory], Result]) -> Result:
        """Result of a function of this trajectory, worked out once: a trajectory never changes.

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
        """Its fields alone: whoever unpickles it works out anew what follows from them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def gaps(self) -> np.ndarray:
        """Start and end (k, 2) in s of the steps longer than ten times the median step.

        With sessions it is the median of each, and from one to the next is a gap, however short.
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
        """Number of the gap-free segment that holds each time, from 0; -1 where none does.

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
        """Numbers (k,) of the epochs with points of the clouds; of all where none is known."""
        known = self.scanned is not None and self.scanned.any()
        if known:
            return np.flatnonzero(self.scanned)
        return np.arange(len(self))

    @property
    def scanned_passes(self) -> np.ndarray:
        """Start and end (k, 2) in s of what was scanned in the parts without a gap."""
        time = self.gps_time[self.scanned_rows]
        first = np.flatnonzero(np.diff(self.segment(time), prepend=-1))
        return np.column_stack([time[first], time[np.append(first[1:], len(time)) - 1]])

    def scanned_at(self, seconds: np.ndarray) -> Trajectory:
        """The same, which knows that points of the clouds lie in some seconds alone.

        Parameters
        ----------
        seconds : (k,) int array
            Whole seconds of gps_time.
        """
        inside = np.isin(np.floor(self.gps_time), seconds)
        segment = self.segment(self.gps_time)
        scanned = inside.copy()
        is_step = np.diff(segment) == 0
        scanned[1:] |= inside[:-1] & is_step  # points lie up to the next epoch
        scanned[:-1] |= inside[1:] & is_step
        return replace(self, scanned=scanned)

    @property
    def duration(self) -> float:
        """Time that was recorded, in s, without the gaps."""
        return self.recorded_time(*self.gps_time[[0, -1]])

    @property
    def length(self) -> float:
        """Length of the recorded path, in m, without what lies across the gaps."""
        steps = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return float(steps[np.diff(self.segment(self.gps_time)) == 0].sum())

    def count_passes(self, times: Iterable[np.ndarray], pause: float) -> int:
        """Number of passes in which several files were scanned.

        A pass ends at a gap of the trajectory, and where no file goes on within a pause. So tiles
        of one drive are one pass, and so are the files of two scanners.

        Parameters
        ----------
        times : iterable of (n,) array
            Times of some points of each file, in any order. Units: s.
        pause : float
            Files go on if they do within this and their own widest step. Units: s.
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
        """Time from start to end without the gaps that lie whole between them. Units: s."""
        starts, ends = self.gaps.T
        return float(end - start - (ends - starts)[(starts >= start) & (ends <= end)].sum())

    def control_interval(self, gps_time: np.ndarray) -> float:
        """Mean interval of control epochs without the gaps between them. Units: s.

        The whole of what was recorded where they are one, or as good as one: less than a second was
        recorded from one to the next, as from the end of a pass to the start of another.

        Parameters
        ----------
        gps_time : (n,) array
            Times of observed targets, one at least. Units: s.
        """
        epochs = control_epochs(gps_time)
        interval = self.recorded_time(epochs[0], epochs[-1]) / max(len(epochs) - 1, 1)
        if interval >= SAME_EPOCH:
            return interval
        return self.recorded_time(*self.gps_time[[0, -1]])

    def select(self, rows: slice | ArrayLike) -> Trajectory:
        """Some of its epochs, in any order.

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
        """The epochs of several in the order of time, with the columns that all of them have.

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
        """Trajectory at other times, positions and sigmas linear, attitudes by slerp.

        Parameters
        ----------
        gps_time : (m,) array
            Units: s.

        Raises
        ------
        ValueError
            Where a time lies outside the trajectory or in one of its gaps.
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
        near[-2:] = True  # the last epoch ends an interval, and no time is asked of none
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
    """A trajectory asked at arbitrary times: any order and number of epochs."""

    def __post_init__(self):
        pass


@dataclass(frozen=True)
class Mounting:
    """Scanner frame to body frame.

    Parameters
    ----------
    lever_arm : (3,) array
        Units: m.
    boresight : Rotation
        R_L^P.
    covariance : (6, 6) array, optional
        Of the lever arm (m) and of a small rotation of the boresight about the body axes (rad), as
        a calibration left it, or by both sigmas that were measured.
    measured : (6,) array, optional
        One sigma of both where either was measured without a calibration; NaN for what was not.
        Units: m, rad.
    """

    lever_arm: np.ndarray
    boresight: Rotation
    covariance: np.ndarray | None = None
    measured: np.ndarray | None = None

    @classmethod
    def from_angles(cls, lever_arm: ArrayLike, boresight: ArrayLike) -> Mounting:
        """Make a mounting of the numbers that survey.toml has.

        Parameters
        ----------
        lever_arm : (3,) array
            Right, forward, up from the navigation centre to the scanner's origin. Units: m.
        boresight : (3,) array
            [a, b, c] of R_L^P = Rz(c) Ry(b) Rx(a). Units: deg.

        Raises
        ------
        ValueError
            Unless both are three finite numbers.

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
    """Control epochs (k,): times in order, without those within a second of the last one kept.

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
