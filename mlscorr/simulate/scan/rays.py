"""Start and direction of each pulse, and map position of each measurement: Eq. 1, fast.

Same result as georeference(), which a test compares, but in compiled loops: poses are found by
advancing along the epochs instead of searching, rotations use Rodrigues' formula instead of Slerp
objects. The loops name every element, because reference counts of array rows would serialize the
threads.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.simulate.scan.threads import Workspace, in_slices
from mlscorr.survey import Columns, Mounting, Trajectory


@dataclass(frozen=True, repr=False)
class Turn(Columns):
    """Pulses fired in one turn of a scanner.

    Parameters
    ----------
    turned : (m,) array
        Fraction of the turn, from 0 to 1.
    angle, elevation : (m,) array
        From the zero beam, and out of the scan plane. Units: rad.
    rate : float
        Turns a second. Units: 1/s.
    """

    turned: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    rate: float

    @cached_property
    def beams(self) -> np.ndarray:
        """Unit directions, and the directions in which they sweep, (m, 2, 3) in its frame."""
        flat = np.cos(self.elevation)
        zero = np.zeros(len(self))
        x = np.cos(self.angle)
        y = np.sin(self.angle)
        beam = np.column_stack([flat * x, flat * y, np.sin(self.elevation)])
        return np.stack([beam, np.column_stack([-y, x, zero])], axis=1)


@dataclass(frozen=True, repr=False)
class Rays(Columns):
    """Pulses as fired.

    Parameters
    ----------
    gps_time, angle, elevation : (n,) array
        Units: s, rad, rad.
    ray : (n, 9) array
        Start relative to the local origin (m), unit direction, and sweep direction.
    single : (n, 6) float32 array
        Start and direction.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    ray: np.ndarray
    single: np.ndarray


@dataclass(frozen=True)
class Platform:
    """Mounting on a gap-free trajectory, prepared for compiled loops.

    Parameters
    ----------
    epochs : (n,) array
        Units: s.
    table : (n, 16) array
        For each epoch: position relative to the origin (m), rotation matrix row by row, unit axis
        and angle (rad) of the turn to the next epoch.
    boresight : (3, 3) array
    lever_arm : (3,) array
        Units: m.
    """

    epochs: np.ndarray
    table: np.ndarray
    boresight: np.ndarray
    lever_arm: np.ndarray

    @classmethod
    def of(cls, trajectory: Trajectory, mounting: Mounting, origin: np.ndarray) -> "Platform":
        """Make the Platform with positions relative to an origin (3,) in m.

        Parameters
        ----------
        trajectory : Trajectory
        mounting : Mounting
        origin : (3,) array
            Map coordinates of the local origin. Units: m.
        """
        attitude = trajectory.attitude
        turn = np.vstack([(attitude[:-1].inv() * attitude[1:]).as_rotvec(), np.zeros(3)])
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        axis = turn / np.where(angle > 0, angle, 1.0)
        matrix = attitude.as_matrix().reshape(-1, 9)
        return cls(
            np.ascontiguousarray(trajectory.gps_time, dtype=float),
            np.hstack([trajectory.position - origin, matrix, axis, angle]),
            np.ascontiguousarray(mounting.boresight.as_matrix()),
            np.array(mounting.lever_arm, dtype=float),
        )

    def outside(self, gps_time: np.ndarray) -> np.ndarray:
        """Flag (n,) of times before the first or after the last epoch.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        return (gps_time < self.epochs[0]) | (gps_time > self.epochs[-1])

    def aim(
        self, number: np.ndarray, turn: Turn, start: float, room: Workspace, wide: bool = True
    ) -> Rays:
        """Compute the Rays of pulses (n,) since a start (s), by the scanner's Turn.

        The sweep direction is not computed for thin beams.

        Parameters
        ----------
        number : (n,) int array
            Index of each pulse since the start.
        turn : Turn
            Turn of the scanner.
        start : float
            Units: s.
        room : Workspace
            Memory of the Rays until the next ones.
        wide : bool
            True if beams need their sweep direction.
        """
        n = len(number)
        rays = Rays(
            **{name: room.array(name, n) for name in ("gps_time", "angle", "elevation")},
            ray=room.array("ray", n, 9),
            single=room.array("single", n, 6, dtype=np.float32),
        )
        rows = number, rays.gps_time, rays.angle, rays.elevation, rays.ray, rays.single
        timing = turn.turned, turn.angle, turn.elevation, turn.rate, float(start)
        beams = turn.beams @ self.boresight.T
        constants = *timing, beams, self.epochs, self.table, self.lever_arm, wide
        in_slices(n, _aim, rows, constants)
        return rays

    def scanner(self, gps_time: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) of the scanner, relative to the origin. Units: m.

        Parameters
        ----------
        gps_time : (n,) array
            Within the epochs. Units: s.
        """
        return self.place(gps_time, *np.zeros((3, len(gps_time))), np.zeros(3))

    def place(
        self,
        gps_time: np.ndarray,
        angle: np.ndarray,
        elevation: np.ndarray,
        distance: np.ndarray,
        origin: np.ndarray,
    ) -> np.ndarray:
        """Return map coordinates (n, 3) of measurements, Eq. 1; times must be within the epochs.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        angle : (n,) array
            From the zero beam. Units: rad.
        elevation : (n,) array
            Out of the scan plane. Units: rad.
        distance : (n,) array
            Range. Units: m.
        origin : (3,) array
            Map coordinates of the local origin. Units: m.
        """
        xyz = np.empty((len(gps_time), 3))
        rows = (gps_time, angle, elevation, distance, xyz)
        parts = self.epochs, self.table, self.boresight, self.lever_arm
        in_slices(len(xyz), _place, rows, (np.asarray(origin, dtype=float), *parts))
        return xyz


@loop(inline="always")
def _times(m, x, y, z):
    """Matrix (3, 3) times vector."""
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@loop(inline="always")
def _sine(angle):
    """Sine, and 1 - cosine, by their series for the small rotations between epochs."""
    if abs(angle) > 0.02:  # rad, where the first neglected term is 1e-16 of the result
        return sin(angle), 1.0 - cos(angle)
    square = angle * angle
    return (
        angle * (1.0 - square * (1 / 6 - square * (1 / 120 - square / 5040))),
        square * (1 / 2 - square * (1 / 24 - square * (1 / 720 - square / 40320))),
    )


@loop(inline="always")
def _turn(table, i, s, c, x, y, z):
    """Product R Exp(angle axis) with a vector, given the angle's sine s and 1 - cosine c
    (Rodrigues).
    """
    kx = table[i, 12]
    ky = table[i, 13]
    kz = table[i, 14]
    ax = ky * z - kz * y
    ay = kz * x - kx * z
    az = kx * y - ky * x
    bx = ky * az - kz * ay
    by = kz * ax - kx * az
    bz = kx * ay - ky * ax
    x = x + s * ax + c * bx
    y = y + s * ay + c * by
    z = z + s * az + c * bz
    return (
        table[i, 3] * x + table[i, 4] * y + table[i, 5] * z,
        table[i, 6] * x + table[i, 7] * y + table[i, 8] * z,
        table[i, 9] * x + table[i, 10] * y + table[i, 11] * z,
    )


@loop(inline="always")
def _position(table, i, weight, axis):
    """Position on one axis between two epochs."""
    return table[i, axis] + weight * (table[i + 1, axis] - table[i, axis])


@loop(inline="always")
def _walk(epochs, time, i):
    """Index of the step that contains a time, starting from that of the previous time."""
    while i < epochs.size - 2 and time > epochs[i + 1]:
        i += 1
    while i > 0 and time < epochs[i]:
        i -= 1
    return i


@loop
def _aim(
    number,
    gps_time,
    angle,
    elevation,
    rays,
    single,
    turned,
    angles,
    elevations,
    rate,
    start,
    beams,
    epochs,
    table,
    lever,
    wide,
):
    if number.size == 0:
        return
    turn, slot = divmod(number[0], turned.size)
    i = np.searchsorted(epochs, start + turn / rate) - 1
    i = min(max(i, 0), epochs.size - 2)
    for p in range(number.size):
        time = start + (turn + turned[slot]) / rate
        gps_time[p] = time
        angle[p] = angles[slot]
        elevation[p] = elevations[slot]
        i = _walk(epochs, time, i)
        weight = (time - epochs[i]) / (epochs[i + 1] - epochs[i])
        s, c = _sine(weight * table[i, 15])
        x, y, z = _turn(table, i, s, c, lever[0], lever[1], lever[2])
        rays[p, 0] = _position(table, i, weight, 0) + x
        rays[p, 1] = _position(table, i, weight, 1) + y
        rays[p, 2] = _position(table, i, weight, 2) + z
        x, y, z = _turn(table, i, s, c, beams[slot, 0, 0], beams[slot, 0, 1], beams[slot, 0, 2])
        rays[p, 3] = x
        rays[p, 4] = y
        rays[p, 5] = z
        if wide:
            x, y, z = _turn(table, i, s, c, beams[slot, 1, 0], beams[slot, 1, 1], beams[slot, 1, 2])
            rays[p, 6] = x
            rays[p, 7] = y
            rays[p, 8] = z
        for column in range(6):
            single[p, column] = rays[p, column]
        slot += 1
        if slot == turned.size:
            turn = turn + 1
            slot = 0


@loop
def _place(gps_time, angle, elevation, distance, xyz, origin, epochs, table, boresight, lever):
    if gps_time.size == 0:
        return
    i = min(max(np.searchsorted(epochs, gps_time[0]) - 1, 0), epochs.size - 2)
    for p in range(gps_time.size):
        i = _walk(epochs, gps_time[p], i)
        weight = (gps_time[p] - epochs[i]) / (epochs[i + 1] - epochs[i])
        s, c = _sine(weight * table[i, 15])
        r = distance[p]
        z = 0.0
        if elevation[p] != 0.0:
            z = r * sin(elevation[p])
            r *= cos(elevation[p])
        x, y, z = _times(boresight, r * cos(angle[p]), r * sin(angle[p]), z)
        x, y, z = _turn(table, i, s, c, x + lever[0], y + lever[1], z + lever[2])
        xyz[p, 0] = origin[0] + (_position(table, i, weight, 0) + x)
        xyz[p, 1] = origin[1] + (_position(table, i, weight, 1) + y)
        xyz[p, 2] = origin[2] + (_position(table, i, weight, 2) + z)
