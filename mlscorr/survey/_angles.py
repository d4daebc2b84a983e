"""Roll, pitch and heading of the body axes: R_P^G = Rz(-heading) Rx(pitch) Ry(roll)."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation


def attitude_from_angles(roll: ArrayLike, pitch: ArrayLike, heading: ArrayLike) -> Rotation:
    """Rotation R_P^G from body to map: Rz(-heading) Rx(pitch) Ry(roll).

    Parameters
    ----------
    roll, pitch, heading : (n,) array or float
        Roll right side down, pitch nose up, heading clockwise from grid north. Units: rad.

    >>> from mlscorr.frames import attitude_from_angles
    >>> attitude_from_angles(0.0, 0.0, np.pi / 2).apply([0.0, 1.0, 0.0]).round(12) + 0.0
    array([1., 0., 0.])
    """
    angles = np.stack(np.broadcast_arrays(-np.asarray(heading), pitch, roll), axis=-1)
    return Rotation.from_euler("ZXY", angles)


def angles_from_attitude(attitude: Rotation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch and heading of rotations R_P^G.

    Parameters
    ----------
    attitude : Rotation
        n rotations.

    Returns
    -------
    roll, pitch, heading : (n,) array
        Heading in [0, 2 pi). Units: rad.
    """
    minus_heading, pitch, roll = np.moveaxis(attitude.as_euler("ZXY"), -1, 0)
    return roll, pitch, np.mod(-minus_heading, 2 * np.pi)
