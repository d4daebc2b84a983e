"""Uncertainty of points: propagation of pose, mounting and beam sigmas to E, N and H (Eq. 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.correction._kernel import locate, require_times
from mlscorr.correction.pair import Correction
from mlscorr.frames import map_root, skew
from mlscorr.survey import Mounting, Scanner

ELEMENTS = (  # elements of the pose's covariance that enter the variances of E, N and H
    (0, 0),
    (1, 1),
    (2, 2),
    (3, 3),
    (4, 4),
    (5, 5),
    (0, 4),
    (0, 5),
    (1, 3),
    (1, 5),
    (2, 3),
    (2, 4),
    (3, 4),
    (3, 5),
    (4, 5),
)


@dataclass(frozen=True)
class PointSigma:
    """One sigma of the corrected points' E, N and H.

    It follows from the covariance of the corrected pose (full 6 x 6 if the correction has it,
    otherwise from its sigmas), the covariance of the mounting, and the noise of range and angle.
    Angle noise acts in both directions across the beam.

    Parameters
    ----------
    epochs, is_gap : (n,) array
        Epochs of the trajectory; True if a gap follows.
    origin : (3,) array
        Local origin. Units: m.
    table : (n, 21) array
        Positions of POS and scanner relative to the origin, and the elements ``ELEMENTS`` of the
        pose's covariance.
    range_noise, angle_noise : float
        Units: m, rad.
    """

    epochs: np.ndarray
    is_gap: np.ndarray
    origin: np.ndarray
    table: np.ndarray
    range_noise: float
    angle_noise: float

    @classmethod
    def of(
        cls, correction: Correction, scanner: Scanner, mounting: Mounting | None = None
    ) -> PointSigma:
        """Make the sigmas of the points that a correction moves.

        Parameters
        ----------
        correction : Correction
            With a covariance, or with sigmas in its corrected trajectory.
        scanner : Scanner
        mounting : Mounting, optional
            Without one, beams are assumed to start at the navigation center.

        Raises
        ------
        ValueError
            If the corrected trajectory has no sigmas.
        """
        corrected = correction.corrected
        covariance = _pose_covariance(correction)
        arm = np.zeros((len(corrected), 3))
        if mounting is not None:
            arm = corrected.attitude.apply(mounting.lever_arm)
            if mounting.covariance is not None:
                covariance = covariance + _mounting_covariance(corrected, mounting, arm)
        place = corrected.position - correction.origin
        elements = np.stack([covariance[:, i, j] for i, j in ELEMENTS], axis=1)
        table = np.hstack([place, place + arm, elements])
        return cls(
            corrected.gps_time,
            correction.is_gap,
            correction.origin,
            table.astype(np.float32),
            float(scanner.range_noise),
            float(scanner.angle_noise),
        )

    def at(self, xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
        """Return one sigma (n, 3) of corrected points (n, 3), NaN outside the trajectory. Units: m.

        Raises
        ------
        ValueError
            If the numbers of points and times differ.
        """
        return self.of_integers(
            np.asarray(xyz, dtype=float).T, np.ones(3), np.zeros(3), np.asarray(gps_time, float)
        )

    def of_integers(
        self,
        xyz: np.ndarray | Sequence[np.ndarray],
        scale: np.ndarray,
        offset: np.ndarray,
        gps_time: np.ndarray,
        time_constant: float = 0.0,
    ) -> np.ndarray:
        """Return the same for the scaled integers of a LAS record, after their correction.

        Parameters
        ----------
        xyz, scale, offset, gps_time, time_constant
            See ``Correction.shift_integers``; coordinates after the correction.

        Raises
        ------
        ValueError
            If the numbers of points and times differ.
        """
        require_times(len(xyz[0]), len(gps_time))
        scale = np.asarray(scale, dtype=float)
        offset = np.asarray(offset, dtype=float) - self.origin
        step = float(np.median(np.diff(self.epochs)))
        index = locate(gps_time, float(time_constant), self.epochs, step, self.is_gap)
        out = np.full((len(gps_time), 3), np.nan)
        beam = np.square([self.range_noise, self.angle_noise])
        arrays = (gps_time, float(time_constant), self.epochs, index, self.table, beam, out)
        _variances(*xyz, scale, offset, *arrays)
        return np.sqrt(out)


def _pose_covariance(correction):
    """Covariance (n, 6, 6) of the corrected position and of a small rotation about the map axes."""
    if correction.covariance is not None:
        return correction.covariance
    corrected = correction.corrected
    if corrected.position_sigma is None or corrected.attitude_sigma is None:
        raise ValueError(
            "Point sigmas need a corrected trajectory with sigmas of position and attitude; "
            "this one has none. Estimate the correction from control points."
        )
    covariance = np.zeros((len(corrected), 6, 6))
    covariance[:, range(3), range(3)] = corrected.position_sigma**2
    root = map_root(corrected.attitude, corrected.attitude_sigma)
    covariance[:, 3:, 3:] = root @ root.swapaxes(1, 2)
    return covariance


def _mounting_covariance(corrected, mounting, arm):
    """Contribution of the mounting's covariance, expressed as one of the poses: (n, 6, 6).

    A rotation about the scanner equals one about the POS plus a shift through the lever arm.
    """
    rotation = corrected.attitude.as_matrix()
    partials = np.zeros((len(corrected), 6, 6))
    partials[:, :3, :3] = partials[:, 3:, 3:] = rotation
    partials[:, :3, 3:] = skew(arm) @ rotation
    return partials @ mounting.covariance @ partials.swapaxes(1, 2)


@loop
def _variances(xs, ys, zs, scale, offset, gps_time, constant, epochs, index, table, beam, out):
    row = np.empty(table.shape[1])
    for p in range(gps_time.size):
        i = index[p]
        if i < 0:
            continue
        w = (gps_time[p] + constant - epochs[i]) / (epochs[i + 1] - epochs[i])
        for k in range(row.size):
            row[k] = (1.0 - w) * table[i, k] + w * table[i + 1, k]
        x = xs[p] * scale[0] + offset[0]
        y = ys[p] * scale[1] + offset[1]
        z = zs[p] * scale[2] + offset[2]
        gx = x - row[0]
        gy = y - row[1]
        gz = z - row[2]
        ee = row[6]
        nn = row[7]
        hh = row[8]
        aa = row[9]
        bb = row[10]
        cc = row[11]
        eb = row[12]
        ec = row[13]
        na = row[14]
        nc = row[15]
        ha = row[16]
        hb = row[17]
        ab = row[18]
        ac = row[19]
        bc = row[20]
        # d(point) = d(position) + turn x G, turn = (a, b, c) about E, N, H  (Eq. 7-9)
        vx = ee + 2.0 * (eb * gz - ec * gy) + bb * gz * gz - 2.0 * bc * gy * gz + cc * gy * gy
        vy = nn + 2.0 * (nc * gx - na * gz) + aa * gz * gz - 2.0 * ac * gx * gz + cc * gx * gx
        vz = hh + 2.0 * (ha * gy - hb * gx) + aa * gy * gy - 2.0 * ab * gx * gy + bb * gx * gx
        dx = (x - row[3]) ** 2
        dy = (y - row[4]) ** 2
        dz = (z - row[5]) ** 2
        square = max(dx + dy + dz, 1e-12)
        along = beam[0] / square - beam[1]
        across = beam[1] * square
        out[p, 0] = max(vx + along * dx + across, 0.0)
        out[p, 1] = max(vy + along * dy + across, 0.0)
        out[p, 2] = max(vz + along * dz + across, 0.0)
