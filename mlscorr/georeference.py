"""From the scanner to the map and back (Mao et al. 2015, Eq. 1-9), and corrections of points."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from mlscorr.survey import Mounting, PointCloud, Trajectory


def georeference(trajectory, mounting, scanner_xyz, gps_time):
    """Map coordinates of scanner points: X_G = T_G + R_P^G (R_L^P X_L + T_L^P)  (Eq. 1).

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting
    scanner_xyz : (n, 3) array
        X_L, X along the zero beam, Y in the scan plane, Z across it. Units: m.
    gps_time : (n,) array
        Units: s.

    Returns (n, 3) in m. Raises ValueError where a time lies outside the trajectory.
    """
    pose = trajectory.at(gps_time)
    body = mounting.boresight.apply(scanner_xyz) + mounting.lever_arm
    return pose.position + pose.attitude.apply(body)


def to_scanner(trajectory, mounting, xyz, gps_time):
    """Scanner coordinates (n, 3) of map points (n, 3): the inverse of Eq. 1. Units: m."""
    pose = trajectory.at(gps_time)
    body = pose.attitude.inv().apply(xyz - pose.position)
    return mounting.boresight.inv().apply(body - mounting.lever_arm)


def skew(vector):
    """Cross-product matrices Phi (n, 3, 3) of vectors (n, 3)  (Eq. 4).

    >>> skew(np.array([[1.0, 2.0, 3.0]]))[0] @ [0.0, 0.0, 1.0]
    array([ 2., -1.,  0.])
    """
    x, y, z = np.asarray(vector, dtype=float).T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)


def pose_partials(trajectory, position, gps_time):
    """Partial derivatives (n, 3, 6) of map points by the pose: [I, -Phi(G)]  (Eq. 7-9).

    The pose is position (E, N, H; m) and a small rotation about the map axes (rad), not roll,
    pitch and heading. G = R_P^G (R_L^P X_L + T_L^P) = X_G - T_G (Eq. 8), so no mounting is
    needed. Eq. 10 prints +Phi(G); Eq. 9 has the right sign.
    """
    arm = position - trajectory.at(gps_time).position  # G, Eq. 8
    identity = np.broadcast_to(np.eye(3), (len(arm), 3, 3))
    return np.concatenate([identity, -skew(arm)], axis=2)


def mounting_partials(trajectory, mounting, position, gps_time):
    """Partial derivatives (n, 3, 6) of map points by the mounting: R_P^G [I, -Phi(P)]  (Eq. 16-18).

    The mounting is the lever arm (m) and a small rotation of the boresight about the body axes
    (rad). P = R_L^P X_L (Eq. 17) is the point as seen from the scanner, in body axes.
    """
    pose = trajectory.at(gps_time)
    rotation = pose.attitude.as_matrix()
    beam = pose.attitude.inv().apply(position - pose.position) - mounting.lever_arm
    return np.concatenate([rotation, -rotation @ skew(beam)], axis=2)


@dataclass(frozen=True)
class Correction:
    """The pair recorded -> corrected of trajectory and mounting, applied to points by their time.

    With T, R the recorded pose, T', R' the corrected one, and a mounting that turns by
    C = R_L^P' (R_L^P)^T, Eq. 1 backward and forward again gives

        x' = x + shift(t) + turn(t) (x - T(t))
        turn = R' C R^T - I,  shift = T' - T + R' (T_L^P' - C T_L^P)

    Both are small and smooth, so they, not the poses, are interpolated between epochs.
    ``covariance`` (n, 6, 6), if known, is that of the corrected position (m) and of a small
    rotation about the map axes (rad).
    Raises ValueError when the two trajectories have different epochs.
    """

    recorded: Trajectory
    corrected: Trajectory
    recorded_mounting: Mounting | None = None
    corrected_mounting: Mounting | None = None
    covariance: np.ndarray | None = None

    def __post_init__(self):
        if not np.array_equal(self.recorded.gps_time, self.corrected.gps_time):
            raise ValueError("Recorded and corrected trajectory must have the same epochs.")

    @cached_property
    def table(self):
        """Per epoch (n, 15): T - origin, shift, and turn row by row; float64."""
        old, new = self.recorded, self.corrected
        turned = new.attitude
        shift = new.position - old.position
        if self.recorded_mounting is not None and self.corrected_mounting is not None:
            before, after = self.recorded_mounting, self.corrected_mounting
            change = after.boresight * before.boresight.inv()
            turned = turned * change
            shift += new.attitude.apply(after.lever_arm - change.apply(before.lever_arm))
        turn = (turned * old.attitude.inv()).as_matrix() - np.eye(3)
        return np.hstack([old.position - self.origin, shift, turn.reshape(-1, 9)])

    @property
    def origin(self):
        """Local origin (3,) that keeps products of coordinates small. Units: m."""
        return np.round(self.recorded.position[0])

    def increments(self, xyz, gps_time):
        """What must be added to points: (n, 3) in m, zero outside the trajectory, and the mask
        (n,) of the points that lie inside it."""
        increments = np.zeros((len(gps_time), 3))
        inside = np.zeros(len(gps_time), dtype=bool)
        _increments(
            np.ascontiguousarray(gps_time, dtype=float),
            np.ascontiguousarray(xyz - self.origin),
            self.recorded.gps_time,
            self._step,
            self.is_gap,
            self.table,
            increments,
            inside,
        )
        return increments, inside

    def apply(self, cloud):
        """Corrected PointCloud; points outside the trajectory are left as they were."""
        increments, _ = self.increments(cloud.xyz, cloud.gps_time)
        return PointCloud(cloud.xyz + increments, cloud.gps_time, cloud.intensity)

    def shift_integers(self, xyz, scale, offset, gps_time, time_constant=0.0):
        """Correct the scaled integers of a LAS record in place, as x' = scale * X' + offset.

        Only whole increments are added, so that a correction of zero changes no bit.

        Parameters
        ----------
        xyz : three (n,) int32 arrays
            Changed in place.
        scale, offset : (3,) array
            Units: m.
        gps_time : (n,) array
            In the file's own time system. Units: s.
        time_constant : float
            Added to gps_time, it gives the trajectory's time. Units: s.

        Returns the number of points outside the trajectory (unchanged). Raises ValueError when
        a corrected coordinate does not fit the file's 32 bit integers.
        """
        outside, overflow = _shift_integers(
            *xyz,
            np.asarray(scale, dtype=float),
            np.asarray(offset, dtype=float) - self.origin,
            gps_time,
            float(time_constant),
            self.recorded.gps_time,
            self._step,
            self.is_gap,
            self.table,
        )
        if overflow:
            raise ValueError(
                f"{overflow} corrected points do not fit the file's scale {scale} m and offset "
                f"{offset} m: the correction or the file's header is wrong by kilometres."
            )
        return outside

    @cached_property
    def _step(self):
        """Median step of the epochs. Units: s."""
        return float(np.median(np.diff(self.recorded.gps_time)))

    @cached_property
    def is_gap(self):
        """Whether the step after each epoch is a gap: (n,) bool."""
        gap = np.isin(self.recorded.gps_time, self.recorded.gaps[:, 0])
        gap[-1] = True
        return gap


@njit(cache=True, nogil=True)
def locate(gps_time, constant, epochs, step, is_gap):
    """Index i with epochs[i] <= time <= epochs[i + 1] for each point (n,); -1 outside and in gaps.

    From the epoch before by one, then by leaps of the usual step, each from where the last one
    landed (a gap costs one more), then by bisection.
    """
    index = np.empty(gps_time.size, dtype=np.int32)
    last = epochs.size - 1
    i = 0
    for p in range(gps_time.size):
        time = gps_time[p] + constant
        if not (epochs[i] <= time <= epochs[i + 1]):
            if not (epochs[0] <= time <= epochs[last]):
                index[p] = -1
                continue
            for _ in range(4):
                i += int(np.floor((time - epochs[i]) / step))
                i = min(max(i, 0), last - 1)
                if epochs[i] <= time <= epochs[i + 1]:
                    break
            else:
                i = min(np.searchsorted(epochs, time, side="right") - 1, last - 1)
        in_gap = is_gap[i] and epochs[i] < time < epochs[i + 1]
        index[p] = -1 if in_gap else i
    return index


@njit(cache=True, nogil=True, inline="always")
def _increment(x, y, z, weight, a, b):
    """shift + turn (x - T), interpolated between the table rows a and b."""
    v = 1.0 - weight
    dx = x - (v * a[0] + weight * b[0])
    dy = y - (v * a[1] + weight * b[1])
    dz = z - (v * a[2] + weight * b[2])
    ex = v * a[3] + weight * b[3] + (v * a[6] + weight * b[6]) * dx
    ex += (v * a[7] + weight * b[7]) * dy + (v * a[8] + weight * b[8]) * dz
    ey = v * a[4] + weight * b[4] + (v * a[9] + weight * b[9]) * dx
    ey += (v * a[10] + weight * b[10]) * dy + (v * a[11] + weight * b[11]) * dz
    ez = v * a[5] + weight * b[5] + (v * a[12] + weight * b[12]) * dx
    ez += (v * a[13] + weight * b[13]) * dy + (v * a[14] + weight * b[14]) * dz
    return ex, ey, ez


@njit(cache=True, nogil=True)
def _increments(gps_time, xyz, epochs, step, is_gap, table, increments, inside):
    index = locate(gps_time, 0.0, epochs, step, is_gap)
    for p in range(gps_time.size):
        i = index[p]
        if i < 0:
            continue
        weight = (gps_time[p] - epochs[i]) / (epochs[i + 1] - epochs[i])
        inside[p] = True
        increments[p, 0], increments[p, 1], increments[p, 2] = _increment(
            xyz[p, 0], xyz[p, 1], xyz[p, 2], weight, table[i], table[i + 1]
        )


@njit(cache=True, nogil=True)
def _shift_integers(xs, ys, zs, scale, offset, gps_time, constant, epochs, step, is_gap, table):
    index = locate(gps_time, constant, epochs, step, is_gap)
    outside = 0
    overflow = 0
    limit = 2147483647.0
    for p in range(gps_time.size):
        i = index[p]
        if i < 0:
            outside += 1
            continue
        weight = (gps_time[p] + constant - epochs[i]) / (epochs[i + 1] - epochs[i])
        ex, ey, ez = _increment(
            xs[p] * scale[0] + offset[0],
            ys[p] * scale[1] + offset[1],
            zs[p] * scale[2] + offset[2],
            weight,
            table[i],
            table[i + 1],
        )
        x = xs[p] + np.rint(ex / scale[0])
        y = ys[p] + np.rint(ey / scale[1])
        z = zs[p] + np.rint(ez / scale[2])
        if max(abs(x), abs(y), abs(z)) > limit:
            overflow += 1
            continue
        xs[p], ys[p], zs[p] = np.int32(x), np.int32(y), np.int32(z)
    return outside, overflow
