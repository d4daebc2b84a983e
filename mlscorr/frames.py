"""Angles, body and map axes; transformation scanner to map and back (Mao et al. 2015, Eq. 1-9)."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.survey import Mounting, Trajectory
from mlscorr.survey import angles_from_attitude as angles_from_attitude
from mlscorr.survey import attitude_from_angles as attitude_from_angles

# Roll turns about the body's Y (forward), pitch about X (right), heading about -Z
BODY_AXES = [1, 0, 2]  # indices of pitch, roll, heading among roll, pitch, heading; its own inverse


def map_root(attitude: Rotation, angle_sigma: np.ndarray) -> np.ndarray:
    """Square root R diag(s) R^T of an attitude's covariance about the map axes.

    Parameters
    ----------
    attitude : Rotation
        n rotations R_P^G.
    angle_sigma : (n, 3) array
        One sigma of roll, pitch, heading. Units: rad.

    Returns
    -------
    (n, 3, 3) array
        Units: rad.
    """
    rotation = attitude.as_matrix()
    return (rotation * angle_sigma[:, None, BODY_AXES]) @ rotation.swapaxes(1, 2)


def angle_sigma(attitude: Rotation, covariance: np.ndarray) -> np.ndarray:
    """One sigma of roll, pitch, heading from a covariance about the map axes; inverts map_root.

    Parameters
    ----------
    attitude : Rotation
        n rotations R_P^G.
    covariance : (n, 3, 3) array
        Of small rotations about the map axes. Units: rad^2.

    Returns
    -------
    (n, 3) array
        Units: rad.
    """
    to_body = attitude.inv().as_matrix()
    variance = np.einsum("nij,njk,nik->ni", to_body, covariance, to_body)
    return np.sqrt(np.maximum(variance[:, BODY_AXES], 0.0))


def from_polar(distance: np.ndarray, angle: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """X (n, 3) = distance (cos e cos a, cos e sin a, sin e). Units: m.

    Parameters
    ----------
    distance : (n,) array
        Units: m.
    angle, elevation : (n,) array
        From X toward Y, and from their plane toward Z. Units: rad.
    """
    horizontal = distance * np.cos(elevation)
    axes = horizontal * np.cos(angle), horizontal * np.sin(angle), distance * np.sin(elevation)
    return np.column_stack(axes)


def scanner_position(
    trajectory: Trajectory, mounting: Mounting | None, gps_time: np.ndarray
) -> np.ndarray:
    """Map coordinates (n, 3) of the scanner's origin, T_G + R_P^G T_L^P. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting or None
        If None, the navigation center is used.
    gps_time : (n,) array
        Units: s.

    Raises
    ------
    ValueError
        If a time is outside the trajectory.
    """
    pose = trajectory.at(gps_time)
    if mounting is None:
        return pose.position
    return pose.position + pose.attitude.apply(mounting.lever_arm)


def georeference(
    trajectory: Trajectory, mounting: Mounting, scanner_xyz: np.ndarray, gps_time: np.ndarray
) -> np.ndarray:
    """Map coordinates (n, 3) of scanner points: X_G = T_G + R_P^G (R_L^P X_L + T_L^P)  (Eq. 1).

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting
    scanner_xyz : (n, 3) array
        X_L, X along the zero beam, Y in the scan plane, Z across it. Units: m.
    gps_time : (n,) array
        Units: s.

    Raises
    ------
    ValueError
        If a time is outside the trajectory.
    """
    pose = trajectory.at(gps_time)
    body = mounting.boresight.apply(scanner_xyz) + mounting.lever_arm
    return pose.position + pose.attitude.apply(body)


def to_scanner(
    trajectory: Trajectory, mounting: Mounting, xyz: np.ndarray, gps_time: np.ndarray
) -> np.ndarray:
    """Scanner coordinates (n, 3) of map points: the inverse of Eq. 1. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.

    Raises
    ------
    ValueError
        If a time is outside the trajectory.
    """
    pose = trajectory.at(gps_time)
    body = pose.attitude.inv().apply(xyz - pose.position)
    return mounting.boresight.inv().apply(body - mounting.lever_arm)


def georeferenced_anew(
    trajectory: Trajectory,
    recorded: Sequence[Mounting],
    mountings: Sequence[Mounting],
    position: np.ndarray,
    gps_time: np.ndarray,
    scanner: np.ndarray,
) -> np.ndarray:
    """Recompute positions made with recorded mountings for other mountings  (Eq. 1). Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    recorded, mountings : sequence of Mounting
        Of each scanner: the mounting behind the positions, and the other one.
    position, gps_time, scanner : (..., 3), (...) array
        With the index of the scanner of each position. Units: m, s.
    """
    place = np.empty_like(position)
    for number, (before, after) in enumerate(zip(recorded, mountings, strict=True)):
        rows = scanner == number
        in_scanner = to_scanner(trajectory, before, position[rows], gps_time[rows])
        place[rows] = georeference(trajectory, after, in_scanner, gps_time[rows])
    return place


def skew(vector: np.ndarray) -> np.ndarray:
    """Cross-product matrices Phi (n, 3, 3) of vectors (n, 3)  (Eq. 4).

    >>> skew(np.array([[1.0, 2.0, 3.0]]))[0] @ [0.0, 0.0, 1.0]
    array([ 2., -1.,  0.])
    """
    x, y, z = np.asarray(vector, dtype=float).T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)


def pose_partials(trajectory: Trajectory, position: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """Partial derivatives (n, 3, 6) of map points by the pose: [I, -Phi(G)]  (Eq. 7-9).

    The pose is position (E, N, H; m) and a small rotation about the map axes (rad), not roll,
    pitch and heading. G = R_P^G (R_L^P X_L + T_L^P) = X_G - T_G (Eq. 8), so no mounting is
    needed. Eq. 10 prints +Phi(G); Eq. 9 has the right sign.

    Parameters
    ----------
    trajectory : Trajectory
    position : (n, 3) array
        Map points. Units: m.
    gps_time : (n,) array
        Units: s.
    """
    arm = position - trajectory.at(gps_time).position  # G, Eq. 8
    return np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), -skew(arm)], axis=2)


def mounting_partials(
    trajectory: Trajectory, mounting: Mounting, position: np.ndarray, gps_time: np.ndarray
) -> np.ndarray:
    """Partial derivatives (n, 3, 6) of map points by mounting: R_P^G [I, -Phi(P)]  (Eq. 16-18).

    The mounting is the lever arm (m) and a small rotation of the boresight about the body axes
    (rad). P = R_L^P X_L (Eq. 17) is the vector from scanner to point, in body axes.

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting
    position : (n, 3) array
        Map points. Units: m.
    gps_time : (n,) array
        Units: s.
    """
    pose = trajectory.at(gps_time)
    rotation = pose.attitude.as_matrix()
    beam = pose.attitude.inv().apply(position - pose.position) - mounting.lever_arm
    return np.concatenate([rotation, -rotation @ skew(beam)], axis=2)


def scanner_partials(
    trajectory: Trajectory, mounting: Mounting, position: np.ndarray, gps_time: np.ndarray
) -> np.ndarray:
    """Partial derivatives (n, 3, 2) of map points by range offset and encoder scale, from Eq. 1.

    The range offset is in m. The encoder scale (ratio) acts on the scan angle about Z_L, from -180
    to 180 deg with zero along X_L.

    Parameters
    ----------
    trajectory : Trajectory
    mounting : Mounting
    position : (n, 3) array
        Map points. Units: m.
    gps_time : (n,) array
        Units: s.
    """
    beam = to_scanner(trajectory, mounting, position, gps_time)
    angle = np.arctan2(beam[:, 1], beam[:, 0])
    along = beam / np.linalg.norm(beam, axis=1, keepdims=True)
    across = angle[:, None] * np.cross([0.0, 0.0, 1.0], beam)
    attitude = trajectory.at(gps_time).attitude
    turned = [attitude.apply(mounting.boresight.apply(part)) for part in (along, across)]
    return np.stack(turned, axis=2)


def partials_by_scanner(
    partials: Callable,
    trajectory: Trajectory,
    mountings: Mapping[int, Mounting],
    position: np.ndarray,
    gps_time: np.ndarray,
    scanner: np.ndarray,
) -> np.ndarray:
    """Partial derivatives (n, 3, q k) by q unknowns of each of k scanners; zero for other scanners.

    Parameters
    ----------
    partials : function
        mounting_partials or scanner_partials, called with the arguments that follow.
    mountings : dict
        By index of the scanner.
    scanner : (n,) int array
        Index of the scanner that measured each point.
    """
    columns = [
        partials(trajectory, mounting, position, gps_time) * (scanner == number)[:, None, None]
        for number, mounting in mountings.items()
    ]
    return np.concatenate(columns, axis=2)
