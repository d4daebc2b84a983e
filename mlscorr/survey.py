"""The nouns: what a survey recorded, as frozen values.

float64, SI units, radians inside; map axes E, N, H; body axes X right, Y forward, Z up.
"""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

GAP_FACTOR = 10.0  # a step longer than ten median steps is a gap
KINDS = ("circle", "square", "hole", "checkerboard", "board")  # of targets, see ControlPoints


def attitude_from_angles(roll, pitch, heading):
    """Rotation R_P^G from body to map: Rz(-heading) Rx(pitch) Ry(roll), angles (n,) in rad.

    Heading is clockwise from grid north, pitch nose up, roll right side down.

    >>> attitude_from_angles(0.0, 0.0, np.pi / 2).apply([0.0, 1.0, 0.0]).round(12) + 0.0
    array([1., 0., 0.])
    """
    angles = np.stack(np.broadcast_arrays(-np.asarray(heading), pitch, roll), axis=-1)
    return Rotation.from_euler("ZXY", angles)


def angles_from_attitude(attitude):
    """Roll, pitch and heading (each (n,), rad, heading in [0, 2 pi)) of a rotation R_P^G."""
    minus_heading, pitch, roll = np.moveaxis(attitude.as_euler("ZXY"), -1, 0)
    return roll, pitch, np.mod(-minus_heading, 2 * np.pi)


@dataclass(frozen=True)
class Trajectory:
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

    Raises ValueError for fewer than two epochs, times that do not increase, or values that are
    not finite.
    """

    gps_time: np.ndarray
    position: np.ndarray
    attitude: Rotation
    position_sigma: np.ndarray | None = None
    attitude_sigma: np.ndarray | None = None

    def __post_init__(self):
        if len(self.gps_time) < 2:
            raise ValueError(f"A trajectory needs at least 2 epochs, this one has {len(self)}.")
        for name in ("gps_time", "position", "position_sigma", "attitude_sigma"):
            values = getattr(self, name)
            if values is not None and not np.isfinite(values).all():
                bad = int((~np.isfinite(values)).reshape(len(self), -1).any(axis=1).sum())
                raise ValueError(
                    f"{bad} of {len(self)} trajectory epochs have a {name} that is not a number."
                )
        steps = np.diff(self.gps_time)
        if (steps <= 0).any():
            first = int(np.argmax(steps <= 0))
            raise ValueError(
                f"The trajectory's gps_time must increase: {int((steps == 0).sum())} epochs are "
                f"duplicates and {int((steps < 0).sum())} go back in time (first after "
                f"{self.gps_time[first]:.3f} s). Sort the file and remove repeated epochs."
            )

    def __len__(self):
        return len(self.gps_time)

    @cached_property
    def gaps(self):
        """Start and end (k, 2) of the steps longer than ten times the median step. Units: s."""
        steps = np.diff(self.gps_time)
        last = np.flatnonzero(steps > GAP_FACTOR * np.median(steps))
        return np.column_stack([self.gps_time[last], self.gps_time[last + 1]])

    def segment(self, gps_time):
        """Number of the gap-free segment that holds each time (n,), from 0; -1 where none does."""
        gps_time = np.asarray(gps_time, dtype=float)
        number = np.searchsorted(self.gaps[:, 1], gps_time, side="right")
        starts = np.append(self.gps_time[0], self.gaps[:, 1])
        ends = np.append(self.gaps[:, 0], self.gps_time[-1])
        inside = (gps_time >= starts[number]) & (gps_time <= ends[number])
        return np.where(inside, number, -1)

    def at(self, gps_time):
        """Trajectory at other times (m,), positions and sigmas linear, attitudes by slerp.

        Raises ValueError where a time lies outside the trajectory or in one of its gaps.
        """
        gps_time = np.atleast_1d(np.asarray(gps_time, dtype=float))
        outside = self.segment(gps_time) < 0
        if outside.any():
            raise ValueError(
                f"{outside.sum()} of {len(gps_time)} times lie outside the trajectory "
                f"[{self.gps_time[0]:.3f}, {self.gps_time[-1]:.3f}] s or in one of its "
                f"{len(self.gaps)} gaps (first: {gps_time[np.argmax(outside)]:.3f} s)."
            )

        def linear(values):
            if values is None:
                return None
            return np.column_stack([np.interp(gps_time, self.gps_time, v) for v in values.T])

        return _Epochs(
            gps_time,
            linear(self.position),
            Slerp(self.gps_time, self.attitude)(gps_time),
            linear(self.position_sigma),
            linear(self.attitude_sigma),
        )


class _Epochs(Trajectory):
    """A trajectory asked at arbitrary times: any order and number of epochs."""

    def __post_init__(self):
        pass


@dataclass(frozen=True)
class Mounting:
    """Scanner frame to body frame: lever_arm (3,) in m and boresight R_L^P.

    covariance (6, 6), if known, is that of the lever arm (m) and of a small rotation of the
    boresight about the body axes (rad).
    """

    lever_arm: np.ndarray
    boresight: Rotation
    covariance: np.ndarray | None = None


@dataclass(frozen=True)
class PointCloud:
    """One chunk of points: xyz (n, 3) in m, gps_time (n,) in s, intensity (n,).

    gps_time is in the trajectory's time system.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    def __getitem__(self, selection):
        return PointCloud(self.xyz[selection], self.gps_time[selection], self.intensity[selection])

    @classmethod
    def concatenate(cls, clouds):
        """All points of some clouds, in their order."""
        names = ("xyz", "gps_time", "intensity")
        return cls(*(np.concatenate([getattr(cloud, name) for cloud in clouds]) for name in names))


@dataclass(frozen=True)
class CloudFile:
    """A LAS or LAZ file and the constant (s) that turns its gps_time into the trajectory's."""

    path: Path
    points: int
    time_constant: float
    time_system: str


@dataclass(frozen=True)
class ControlPoints:
    """Surveyed targets: control points, or check points as another instance.

    Parameters
    ----------
    name : tuple of n str
    position : (n, 3) array
        Units: m.
    sigma : (n, 3) array
        One sigma of E, N, H. Units: m.
    kind : tuple of n str
        ``circle`` (bright disc or ring; size is its diameter), ``square`` (bright plate; its edge),
        ``hole`` (circular, in a board; its diameter), ``checkerboard`` (two white and two black
        quadrants; the edge of all four) or ``board`` (plain plate, told by its edges; its edge).
    size : (n,) array
        Units: m.
    normal : (n, 3) array
        Unit normal of the target's plane; NaN where it was not surveyed.
    """

    name: tuple[str, ...]
    position: np.ndarray
    sigma: np.ndarray
    kind: tuple[str, ...]
    size: np.ndarray
    normal: np.ndarray

    def __len__(self):
        return len(self.name)

    def __add__(self, other):
        return ControlPoints(
            self.name + other.name,
            np.vstack([self.position, other.position]),
            np.vstack([self.sigma, other.sigma]),
            self.kind + other.kind,
            np.append(self.size, other.size),
            np.vstack([self.normal, other.normal]),
        )


@dataclass(frozen=True)
class TargetObservations:
    """Targets found in the cloud, one row per target and pass.

    Parameters
    ----------
    name : tuple of n (str or None)
        The control point that it was matched to.
    pass_number : (n,) int array
        Passes count from 1 in time.
    gps_time : (n,) array
        Units: s.
    position : (n, 3) array
        Observed centre. Units: m.
    covariance : (n, 3, 3) array
        Units: m^2.
    normal : (n, 3) array
    kind : tuple of n str
    size : (n,) array
        Units: m.
    points : (n,) int array
        Number of points on the target.
    """

    name: tuple[str | None, ...]
    pass_number: np.ndarray
    gps_time: np.ndarray
    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    kind: tuple[str, ...]
    size: np.ndarray
    points: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    def __getitem__(self, rows):
        rows = np.flatnonzero(rows) if np.asarray(rows).dtype == bool else np.asarray(rows, int)
        return TargetObservations(
            tuple(self.name[i] for i in rows),
            self.pass_number[rows],
            self.gps_time[rows],
            self.position[rows],
            self.covariance[rows],
            self.normal[rows],
            tuple(self.kind[i] for i in rows),
            self.size[rows],
            self.points[rows],
        )


@dataclass(frozen=True)
class Scanner:
    """What is believed of the scanner: sigmas of range (m) and angle (rad), lines a second."""

    range_noise: float = 0.005  # m, typical of mobile line scanners (RIEGL VQ-250 data sheet)
    angle_noise: float = np.radians(0.002)  # the paper's class of scanner
    lines_per_second: float = 100.0


@dataclass(frozen=True)
class Pos:
    """What is believed of the POS where the trajectory has no sigma columns."""

    position_sigma: float = 0.02  # m, nominal for the paper's SPAN-FSAS in good GNSS
    attitude_sigma: np.ndarray = field(  # rad: roll, pitch, heading; the paper's section 3
        default_factory=lambda: np.array([1.1e-4, 1.1e-4, 2.45e-4])
    )
    correlation_time: float = 30.0  # s, the paper's section 3.1.1
    # (start, length, factor, shape): times in which the position has a further error, as without
    # GNSS, of at most factor sigmas; shape "rise" grows to the end, "hump" to the middle
    windows: tuple[tuple[float, float, float, str], ...] = ()


@dataclass(frozen=True)
class Survey:
    """One mobile survey as it was recorded: cloud files, trajectory, mounting, control, beliefs."""

    name: str
    path: Path
    crs: str | None
    clouds: tuple[CloudFile, ...]
    trajectory: Trajectory
    mounting: Mounting | None
    control: ControlPoints
    check: ControlPoints
    scanner: Scanner = Scanner()
    pos: Pos = field(default_factory=Pos)
    reference: Path | None = None  # a reference surface in the cloud's coordinates
    notes: tuple[str, ...] = ()  # what the readers worked out, for the report
