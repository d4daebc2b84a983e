"""Correction of points by the pair recorded -> corrected of trajectory and mounting."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from mlscorr.correction._kernel import fill_increments, move_integers, require_times
from mlscorr.frames import angle_sigma, angles_from_attitude
from mlscorr.survey import (
    Mounting,
    PointCloud,
    Summary,
    Trajectory,
    as_cloud,
    box_distance,
    copied_las,
    geometry_pair,
    is_las,
)
from mlscorr.wording import counted

FARTHEST = 10_000.0  # m; largest distance of a point from the trajectory


@dataclass(frozen=True, repr=False)
class Correction(Summary):
    """Pair recorded -> corrected of trajectory and mounting, applied to points by their time.

    With T, R the recorded pose, T', R' the corrected one, and a mounting that turns by
    C = R_L^P' (R_L^P)^T, Eq. 1 backward and forward again gives

        x' = x + shift(t) + turn(t) (x - T(t))
        turn = R' C R^T - I,  shift = T' - T + R' (T_L^P' - C T_L^P)

    Both are small and smooth, so they are interpolated between epochs instead of the poses.

    Parameters
    ----------
    recorded, corrected : Trajectory
        Both with the same n epochs.
    recorded_mounting, corrected_mounting : Mounting, optional
        Without both, the mounting does not change and cancels.
    covariance : (n, 6, 6) array, optional
        Of the corrected position (m) and of a small rotation about the map axes (rad).
    datum : (3,) array, optional
        Time-independent part, which also moves points outside the trajectory. Units: m.

    Raises
    ------
    ValueError
        If the two trajectories have different epochs.
    """

    recorded: Trajectory
    corrected: Trajectory
    recorded_mounting: Mounting | None = None
    corrected_mounting: Mounting | None = None
    covariance: np.ndarray | None = None
    datum: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self):
        if not np.array_equal(self.recorded.gps_time, self.corrected.gps_time):
            raise ValueError("The recorded and the corrected trajectory must have the same epochs.")

    @classmethod
    def by_pose_error(
        cls,
        trajectory: Trajectory,
        pose: np.ndarray,
        covariance: np.ndarray | None = None,
        recorded_mounting: Mounting | None = None,
        corrected_mounting: Mounting | None = None,
    ) -> Correction:
        """Make the correction that removes a POS error, and a mounting error if both are given.

        Parameters
        ----------
        trajectory : Trajectory
            As recorded.
        pose : (n, 6) array
            Values to add: position in m, rotation about the map axes in rad.
        covariance : (n, 6, 6) array, optional
            Of the pose; gives the sigmas of the corrected trajectory, which otherwise has none.
        recorded_mounting, corrected_mounting : Mounting, optional
        """
        position_sigma = attitude_sigma = None
        if covariance is not None:
            variance = np.maximum(np.einsum("qii->qi", covariance), 0.0)
            position_sigma = np.sqrt(variance[:, :3])
            attitude_sigma = angle_sigma(trajectory.attitude, covariance[:, 3:, 3:])
        corrected = replace(
            trajectory,
            position=trajectory.position + pose[:, :3],
            attitude=Rotation.from_rotvec(pose[:, 3:]) * trajectory.attitude,
            position_sigma=position_sigma,
            attitude_sigma=attitude_sigma,
        )
        return cls(trajectory, corrected, recorded_mounting, corrected_mounting, covariance)

    @cached_property
    def table(self) -> np.ndarray:
        """T - origin, shift and turn (row by row) of each epoch, (n, 15) float64."""
        old = self.recorded
        new = self.corrected
        turned = new.attitude
        shift = new.position - old.position
        if self.recorded_mounting is not None and self.corrected_mounting is not None:
            before = self.recorded_mounting
            after = self.corrected_mounting
            change = after.boresight * before.boresight.inv()
            turned = turned * change
            shift += new.attitude.apply(after.lever_arm - change.apply(before.lever_arm))
        turn = (turned * old.attitude.inv()).as_matrix() - np.eye(3)
        return np.hstack([old.position - self.origin, shift, turn.reshape(-1, 9)])

    @property
    def attitude_change(self) -> np.ndarray:
        """Corrected - recorded roll, pitch and heading (n, 3), in rad."""
        recorded = np.column_stack(angles_from_attitude(self.recorded.attitude))
        corrected = np.column_stack(angles_from_attitude(self.corrected.attitude))
        return (corrected - recorded + np.pi) % (2 * np.pi) - np.pi

    @property
    def origin(self) -> np.ndarray:
        """Local origin (3,) in m, which keeps products of coordinates small."""
        return np.round(self.recorded.position[0])

    def increments(self, xyz: np.ndarray, gps_time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the increments to add to points.

        Parameters
        ----------
        xyz, gps_time : (n, 3), (n,) array
            Units: m, s.

        Returns
        -------
        increments : (n, 3) array
            Only the datum outside the trajectory. Units: m.
        inside : (n,) bool array

        Raises
        ------
        ValueError
            If the numbers of points and times differ.
        """
        require_times(len(xyz), len(gps_time))
        increments = np.tile(self.datum, (len(gps_time), 1))
        inside = np.zeros(len(gps_time), dtype=bool)
        fill_increments(
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

    def apply(self, cloud: Any) -> Any:
        """Correct points by their times; those outside the trajectory move by the datum only.

        Parameters
        ----------
        cloud : PointCloud, open3d.t.geometry.PointCloud, (xyz, gps_time) or points of laspy
            With times in the trajectory's system and map coordinates. Positions of an Open3D cloud
            refer to its attribute ``origin``, if it has one.

        Returns
        -------
        as given
            A new cloud in the same form; the input does not change. Coordinates of laspy keep their
            scale. Warns if points are outside the trajectory.

        Raises
        ------
        ValueError
            If values are not finite; and, except for a PointCloud, if no point has a time within
            the trajectory or all are far from it, as with a local origin.
        TypeError
            If the points have another form.

        >>> import numpy as np
        >>> from mlscorr.frames import attitude_from_angles
        >>> from mlscorr.survey import Trajectory
        >>> time, zero = np.arange(413200.0, 413204.0), np.zeros(4)
        >>> path = np.tile([532_000.0, 3_374_000.0, 42.0], (4, 1))
        >>> recorded = Trajectory(time, path, attitude_from_angles(zero, zero, zero))
        >>> corrected = replace(recorded, position=path + [0.0, 0.0, 0.5])
        >>> xyz, gps_time = Correction(recorded, corrected).apply((path[:1], time[:1]))
        >>> xyz.tolist()
        [[532000.0, 3374000.0, 42.5]]
        """
        if isinstance(cloud, PointCloud):
            return self._moved(cloud)[0]
        if is_las(cloud):
            return self._moved_las(cloud)
        points, back = as_cloud(cloud)
        return back(self._moved_if_here(points))

    def before_after(self, cloud: Any, origin: ArrayLike | None = None) -> dict[str, Any]:
        """Return a cloud before and after the correction, as two Open3D geometries with one origin.

        Both share all memory except their positions. Both are gray by intensity, unless the cloud
        has the attribute ``colors``.

        Parameters
        ----------
        cloud : PointCloud, open3d.t.geometry.PointCloud or (xyz, gps_time)
            See ``apply``.
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``. Units: m.

        Returns
        -------
        dict
            ``before`` and ``after``, each an open3d.t.geometry.PointCloud.

        Raises
        ------
        ValueError, TypeError
            See ``apply``.

        >>> import numpy as np
        >>> from mlscorr.frames import attitude_from_angles
        >>> from mlscorr.survey import PointCloud, Trajectory
        >>> time, zero = np.arange(413200.0, 413204.0), np.zeros(4)
        >>> path = np.tile([532_000.0, 3_374_000.0, 42.0], (4, 1))
        >>> recorded = Trajectory(time, path, attitude_from_angles(zero, zero, zero))
        >>> corrected = replace(recorded, position=path + [0.0, 0.0, 0.5])
        >>> pair = Correction(recorded, corrected).before_after(PointCloud.from_arrays(path, time))
        >>> (pair["after"].point.positions - pair["before"].point.positions)[0].numpy().tolist()
        [0.0, 0.0, 0.5]
        """
        points, _ = as_cloud(cloud)
        return geometry_pair(points, self._moved_if_here(points), origin)

    def _moved(self, cloud):
        """Return the corrected PointCloud, and the mask of points within the trajectory."""
        moved, inside = self.increments(cloud.xyz, cloud.gps_time)
        return replace(cloud, xyz=np.add(cloud.xyz, moved, out=moved)), inside

    def _moved_if_here(self, cloud):
        """Return the corrected PointCloud; refuse one from another place or time."""
        self._require_near(cloud.xyz)
        moved, inside = self._moved(cloud)
        self._require_inside(np.count_nonzero(~inside), cloud.gps_time)
        return moved

    def _moved_las(self, points):
        """Correct a copy of laspy points by whole steps of their scale."""
        copied, record = copied_las(points)
        if len(record) == 0:
            return copied
        time = np.asarray(record["gps_time"], float)
        integers = [np.array(record[name]) for name in "XYZ"]
        scale = np.asarray(record.scales)
        offset = np.asarray(record.offsets)
        ends = [[values.min() for values in integers], [values.max() for values in integers]]
        self._require_near(np.array(ends) * scale + offset)
        outside = self.shift_integers(integers, scale, offset, time)
        self._require_inside(outside, time)
        for name, values in zip("XYZ", integers, strict=True):
            record[name] = values
        return copied

    def _require_near(self, xyz):
        """Refuse points that no scanner on the trajectory can have measured."""
        distance = box_distance(xyz, self.recorded.position)
        if distance > FARTHEST:
            raise ValueError(
                f"The points lie {distance / 1000:.0f} km from the trajectory: they are in "
                "another CRS or relative to a local origin. Give map coordinates; for an Open3D "
                "cloud, give its origin: PointCloud.from_open3d(cloud, origin=...)."
            )

    def _require_inside(self, outside, gps_time):
        """Refuse points if none was measured within the trajectory; warn if some were not."""
        if outside == 0 or len(gps_time) == 0:
            return
        first, last = self.recorded.gps_time[[0, -1]]
        sentence = (
            f"{outside} of {counted(len(gps_time), 'point')} have a gps_time outside the "
            f"trajectory [{first:.3f}, {last:.3f}] s or in its gaps (first point: "
            f"{gps_time[0]:.3f} s)."
        )
        if outside == len(gps_time):
            raise ValueError(
                f"{sentence} Cloud and trajectory may use different time systems: add the "
                "constant difference to the times of the cloud."
            )
        warnings.warn(f"{sentence} No time-dependent correction applies to them.", stacklevel=3)

    def shift_integers(
        self,
        xyz: np.ndarray | Sequence[np.ndarray],
        scale: np.ndarray,
        offset: np.ndarray,
        gps_time: np.ndarray,
        time_constant: float = 0.0,
    ) -> int:
        """Correct the scaled integers of a LAS record in place, as x' = scale * X' + offset.

        Only integer increments are added, so that a zero correction changes no bit.

        Parameters
        ----------
        xyz : three (n,) int32 arrays
            Changed in place.
        scale, offset : (3,) array
            Units: m.
        gps_time : (n,) array
            In the file's own time system. Units: s.
        time_constant : float
            Added to gps_time to get the trajectory's time. Units: s.

        Returns
        -------
        int
            Number of points outside the trajectory, moved by the datum only.

        Raises
        ------
        ValueError
            If a corrected coordinate does not fit the file's 32-bit integers, or a point has no
            time.
        """
        require_times(len(xyz[0]), len(gps_time))
        outside, overflow = move_integers(
            *xyz,
            np.asarray(scale, dtype=float),
            np.asarray(offset, dtype=float) - self.origin,
            gps_time,
            float(time_constant),
            self.recorded.gps_time,
            self._step,
            self.is_gap,
            self.table,
            self.datum,
        )
        require_fit(overflow, scale, offset)
        return outside

    @cached_property
    def _step(self):
        """Median step of the epochs. Units: s."""
        return float(np.median(np.diff(self.recorded.gps_time)))

    @cached_property
    def is_gap(self) -> np.ndarray:
        """Flag (n,) of epochs that are followed by a gap."""
        gap = np.isin(self.recorded.gps_time, self.recorded.gaps[:, 0])
        gap[-1] = True
        return gap


def require_fit(overflow: int, scale: np.ndarray, offset: np.ndarray) -> None:
    """Refuse corrected points that do not fit a file's integers.

    Parameters
    ----------
    overflow : int
        Number of such points.
    scale, offset : (3,) array
        Of the file. Units: m.

    Raises
    ------
    ValueError
    """
    if overflow:
        raise ValueError(
            f"{counted(overflow, 'corrected point')} can't be stored in 32 bits with the file's "
            f"scale {scale} m and offset {offset} m. Either the offset is far from the points "
            "(export the file with a nearer one), or the correction is wrong by kilometers."
        )


def increments_by_scanner(
    corrections: Sequence[Correction], xyz: np.ndarray, gps_time: np.ndarray, scanner: np.ndarray
) -> np.ndarray:
    """Increments for points of several scanners, each by its own correction. Units: m.

    Parameters
    ----------
    corrections : sequence of Correction
        One for each scanner.
    xyz : (..., 3) array
        Units: m.
    gps_time, scanner : (...) array
        Of each point, and the index of its scanner. Units: s.
    """
    increments = np.empty_like(xyz)
    for number, correction in enumerate(corrections):
        rows = scanner == number
        increments[rows] = correction.increments(xyz[rows], gps_time[rows])[0]
    return increments
