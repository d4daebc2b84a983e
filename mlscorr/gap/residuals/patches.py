"""Flat pieces of the cloud: small in space and in time, each with the plane that fits it."""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import Columns


@dataclass(frozen=True, repr=False)
class Patches(Columns):
    """Flat pieces of the cloud, in no order.

    Parameters
    ----------
    pass_number : (p,) int array
    gps_time : (p,) array
        Mean of the points. Units: s.
    centre : (p, 3) array
        Mean of the points on the plane. Units: m.
    normal : (p, 3) array
        Towards the scanner.
    variance : (p,) array
        About the plane, with the plane's three parameters reckoned. Units: m^2.
    spread : (p,) array
        One sigma of the points along the plane's narrow direction. Units: m.
    ripple : (p,) array
        Variance about the plane over that between points which follow each other: about 1 for
        noise, more for what is curved.
    points : (p,) int array
        On the plane.
    fired, returned : (p,) int array
        Pulses between the first and the last return of each scan line on it; zeros where the time
        stamps have no regular step.
    block : (p,) array
        Random number from 0 to 1, the same for neighbours.
    xyz : (p, 12, 3), time, intensity : (p, 12) arrays
        Points of each patch, evenly taken in time.
    cloud : (p,) array of PointCloud
        Points on each plane in order of time, at most 400, for the simulator to fire again.
    """

    pass_number: np.ndarray
    gps_time: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    spread: np.ndarray
    ripple: np.ndarray
    points: np.ndarray
    fired: np.ndarray
    returned: np.ndarray
    block: np.ndarray
    xyz: np.ndarray
    time: np.ndarray
    intensity: np.ndarray
    cloud: np.ndarray
