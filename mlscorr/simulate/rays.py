"""Where each pulse starts and points, and where each measurement lies on the map: Eq. 1, fast.

The same as georeference(), which a test compares, in compiled loops: poses by walking along the
epochs instead of searching, rotations by Rodrigues' formula instead of Slerp objects.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import cos, sin

import numpy as np
from numba import njit

from mlscorr.survey import Mounting, Trajectory

WORKERS = min(os.cpu_count() or 1, 8)  # threads; beyond, memory is what they wait for
FEW = 20_000  # rows that are not worth a thread
SMALL = 0.02  # rad, up to which three terms of the series are sine and cosine to the last bit


@dataclass(frozen=True)
class Platform:
    """A mounting on a trajectory without gaps, ready for compiled loops.

    Parameters
    ----------
    epochs : (n,) array
        Units: s.
    table : (n, 16) array
        Per epoch: position about the origin (m), rotation matrix row by row, unit axis and angle
        (rad) of the turn to the next epoch.
    boresight : (3, 3) array
    lever_arm : (3,) array
        Units: m.
    """

    epochs: np.ndarray
    table: np.ndarray
    boresight: np.ndarray
    lever_arm: np.ndarray

    @classmethod
    def of(cls, trajectory: Trajectory, mounting: Mounting, origin):
        """Platform with positions about an origin (3,) in m."""
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

    def outside(self, gps_time):
        """Which times (n,) lie before the first or after the last epoch."""
        return (gps_time < self.epochs[0]) | (gps_time > self.epochs[-1])

    def beams(self, angle, elevation):
        """Unit direction and direction of sweep (m, 6) of beams in the body frame."""
        flat, zero = np.cos(elevation), np.zeros_like(angle)
        beam = [flat * np.cos(angle), flat * np.sin(angle), np.sin(elevation)]
        sweep = [-np.sin(angle), np.cos(angle), zero]
        turned = [np.column_stack(v) @ self.boresight.T for v in (beam, sweep)]
        return np.hstack(turned)

    def aim(self, gps_time, slot, beams):
        """Rays of n pulses: (n, 9) start (m), direction, and the direction in which they sweep.

        slot (n,) tells which of the beams (m, 6) each pulse is; gps_time (n,) is in s.
        """
        rays = np.empty((len(gps_time), 9))
        constants = beams, self.epochs, self.table, self.lever_arm
        in_slices(len(rays), _aim, (gps_time, slot, rays), constants)
        return rays

    def place(self, gps_time, angle, elevation, distance, origin):
        """Map coordinates (n, 3) of measurements, Eq. 1; all times must lie within the epochs."""
        xyz = np.empty((len(gps_time), 3))
        rows = (gps_time, angle, elevation, distance, xyz)
        parts = self.epochs, self.table, self.boresight, self.lever_arm
        in_slices(len(xyz), _place, rows, (np.asarray(origin, dtype=float), *parts))
        return xyz


def in_slices(n, kernel, rows, constants):
    """Call a compiled kernel(*rows, *constants) for slices of n rows, on all cores at once.

    What it returns is listed in the order of the slices, with the first row of each. Every row
    must be computed by itself, so that the number of slices leaves no trace.
    """
    bounds = np.linspace(0, n, min(WORKERS, 1 + n // FEW) + 1).astype(int)
    slices = [slice(*pair) for pair in pairwise(bounds)]

    def work(part):
        return part.start, kernel(*(row[part] for row in rows), *constants)

    return list(_pool().map(work, slices)) if len(slices) > 1 else [work(slices[0])]


@cache
def _pool():
    """Threads that stay, as starting them for every block costs more than the work."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="mlscorr")


@njit(cache=True, nogil=True, inline="always")
def _times(m, x, y, z):
    """Matrix (3, 3) times vector."""
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True, nogil=True, inline="always")
def _sine(angle):
    """Sine, and 1 - cosine, of an angle that is mostly small."""
    if abs(angle) > SMALL:
        return sin(angle), 1.0 - cos(angle)
    square = angle * angle
    return (
        angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))),
        square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0))),
    )


@njit(cache=True, nogil=True, inline="always")
def _turn(row, s, c, x, y, z):
    """R Exp(angle axis) times a vector, with s, c the angle's sine and 1 - cosine (Rodrigues)."""
    kx, ky, kz = row[12], row[13], row[14]
    ax, ay, az = ky * z - kz * y, kz * x - kx * z, kx * y - ky * x
    bx, by, bz = ky * az - kz * ay, kz * ax - kx * az, kx * ay - ky * ax
    x, y, z = x + s * ax + c * bx, y + s * ay + c * by, z + s * az + c * bz
    return (
        row[3] * x + row[4] * y + row[5] * z,
        row[6] * x + row[7] * y + row[8] * z,
        row[9] * x + row[10] * y + row[11] * z,
    )


@njit(cache=True, nogil=True, inline="always")
def _walk(epochs, time, i):
    """Index of the step that holds a time, from that of the time before."""
    while i < epochs.size - 2 and time > epochs[i + 1]:
        i += 1
    while i > 0 and time < epochs[i]:
        i -= 1
    return i


@njit(cache=True, nogil=True)
def _aim(gps_time, slot, rays, beams, epochs, table, lever):
    if gps_time.size == 0:
        return
    i = min(max(np.searchsorted(epochs, gps_time[0]) - 1, 0), epochs.size - 2)
    for p in range(gps_time.size):
        i = _walk(epochs, gps_time[p], i)
        row, after = table[i], table[i + 1]
        weight = (gps_time[p] - epochs[i]) / (epochs[i + 1] - epochs[i])
        s, c = _sine(weight * row[15])
        ray, beam = rays[p], beams[slot[p]]
        x, y, z = _turn(row, s, c, lever[0], lever[1], lever[2])
        ray[0] = row[0] + weight * (after[0] - row[0]) + x
        ray[1] = row[1] + weight * (after[1] - row[1]) + y
        ray[2] = row[2] + weight * (after[2] - row[2]) + z
        ray[3], ray[4], ray[5] = _turn(row, s, c, beam[0], beam[1], beam[2])
        ray[6], ray[7], ray[8] = _turn(row, s, c, beam[3], beam[4], beam[5])


@njit(cache=True, nogil=True)
def _place(gps_time, angle, elevation, distance, xyz, origin, epochs, table, boresight, lever):
    if gps_time.size == 0:
        return
    i = min(max(np.searchsorted(epochs, gps_time[0]) - 1, 0), epochs.size - 2)
    for p in range(gps_time.size):
        i = _walk(epochs, gps_time[p], i)
        row, after = table[i], table[i + 1]
        weight = (gps_time[p] - epochs[i]) / (epochs[i + 1] - epochs[i])
        s, c = _sine(weight * row[15])
        r = distance[p]
        z = 0.0
        if elevation[p] != 0.0:
            z = r * sin(elevation[p])
            r *= cos(elevation[p])
        x, y, z = _times(boresight, r * cos(angle[p]), r * sin(angle[p]), z)
        x, y, z = _turn(row, s, c, x + lever[0], y + lever[1], z + lever[2])
        xyz[p, 0] = origin[0] + (row[0] + weight * (after[0] - row[0]) + x)
        xyz[p, 1] = origin[1] + (row[1] + weight * (after[1] - row[1]) + y)
        xyz[p, 2] = origin[2] + (row[2] + weight * (after[2] - row[2]) + z)
