"""GNSS fixes from satellites: noise, reflections, and a sky hidden by walls.

Position errors are not drawn but computed: every satellite's range has an error, and least squares
with the visible satellites gives a fix with its dilution of precision.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

WAVELENGTH = 0.1903  # m, L1


@dataclass(frozen=True)
class Receiver:
    """Geodetic GNSS receiver on the road, its sky, and its processing software.

    Parameters
    ----------
    satellites : int
        Number above the horizon, so that more than 9 are used, as in Mao et al. 2015, 3.1.
    mask : float
        Elevation below which satellites are not used, usual in surveying. Units: rad.
    canyon : float
        Elevation of the walls on both sides of a canyon, Mao et al. 2015, 3.1. Units: rad.
    motion : float
        Of a satellite: half a turn in 6 h. Units: rad/s.
    phase_noise : float
        Carrier phase, times hypot(1, 1 / sin(elevation)): RTKLIB's model has 0.003 for a receiver
        at rest; on the road the errors of real_pos_error between its outages (1.4, 1.4, 2.0 cm)
        show more. Units: m.
    reflected : float
        Error of carrier phases in open sky, from roof and ground: errors of the same series
        correlate by at most a quarter after 5 s. Units: m.
    reflection_periods : tuple
        WAVELENGTH / (2 d cos(elevation) motion) for d = 16 to 2 m. Units: s.
    worst_dilution : float
        Dilution of position beyond which software gives no fix.
    suspect : float
        Ratio of residuals to expected noise that a test at 1 % of 6 redundancies rejects.
    caution : float
        Factor of the software's sigmas, because errors of successive fixes are not independent.
    fixing, doubt : int, float
        With fewer satellites than this, ambiguities are uncertain, and software states sigmas
        larger by this factor: GrafNav's quality 2 against quality 1 is 0.05-0.40 m against 0-0.15
        m.
    """

    satellites: int = 13
    mask: float = np.radians(10.0)
    canyon: float = np.radians(55.0)
    motion: float = np.radians(0.5) / 60
    phase_noise: float = 0.005
    reflected: float = 0.004
    reflection_periods: tuple[float, float] = (40.0, 400.0)
    worst_dilution: float = 20.0
    suspect: float = 1.4
    caution: float = 1.5
    fixing: int = 7
    doubt: float = 3.0


RECEIVER = Receiver()


@dataclass(frozen=True)
class Fixes:
    """GNSS positions at n epochs.

    Parameters
    ----------
    error : (n, 3) array
        Fix minus truth, E, N, H; zero where there is none. Units: m.
    covariance : (n, 3, 3) array
        Covariance stated by the software. Units: m^2.
    satellites : (n,) int array
        Satellites in view.
    valid : (n,) bool array
        True if there is a fix.
    """

    error: np.ndarray
    covariance: np.ndarray
    satellites: np.ndarray
    valid: np.ndarray


def gnss_fixes(
    gps_time: np.ndarray, heading: np.ndarray, walls: np.ndarray, rng: Generator
) -> Fixes:
    """Simulate fixes at the times (n,) of a vehicle, in s.

    Parameters
    ----------
    gps_time, heading : (n,) array
        Units: s, rad.
    walls : (n, 2) array
        Elevation below which the sky is hidden, perpendicular to the left and right. Units: rad.
    rng : Generator
    """
    sky_rng, noise_rng, path_rng = rng.spawn(3)
    azimuth, elevation = _constellation(gps_time, sky_rng)
    visible = elevation > np.maximum(wall_elevation(azimuth, heading, walls), RECEIVER.mask)
    oblique = np.hypot(1.0, 1 / np.sin(np.maximum(elevation, RECEIVER.mask)))
    sigma = np.sqrt(2) * RECEIVER.phase_noise * oblique  # against an equally good base station
    error = sigma * noise_rng.standard_normal(sigma.shape)
    error += _reflections(gps_time, walls, path_rng)
    return _solve(azimuth, elevation, visible, sigma, error)


def wall_elevation(azimuth: np.ndarray, heading: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Elevation (n, m) of endless walls along the path toward azimuths (n, m). Units: rad.

    tan(elevation) = tan(elevation perpendicular to the way) |sin(azimuth - heading)|.

    Parameters
    ----------
    azimuth : (n, m) array
        Units: rad.
    heading : (n,) array
        Of the way. Units: rad.
    walls : (n, 2) array
        Elevation perpendicular to the way, left and right. Units: rad.

    Examples
    --------
    >>> walls = np.radians([[20.0, 55.0]])
    >>> east = np.radians([[90.0, 120.0]])
    >>> np.degrees(wall_elevation(east, np.zeros(1), walls)).round(1)
    array([[55., 51.]])
    """
    across = np.sin(azimuth - heading[:, None])
    side = np.where(across < 0, walls[:, :1], walls[:, 1:])
    return np.arctan(np.tan(side) * np.abs(across))


def _constellation(gps_time, rng):
    """Azimuths and elevations (n, m) of satellites, evenly over the sky and moving. Units: rad."""
    azimuth = rng.uniform(0, 2 * np.pi, RECEIVER.satellites)
    elevation = np.arcsin(rng.uniform(0, 1, RECEIVER.satellites))
    course = rng.uniform(0, 2 * np.pi, RECEIVER.satellites)
    moved = RECEIVER.motion * (gps_time - gps_time.mean())[:, None]
    return (
        azimuth + moved * np.sin(course) / np.maximum(np.cos(elevation), 0.2),
        np.clip(elevation + moved * np.cos(course), -np.pi / 2, np.pi / 2),
    )


def _reflections(gps_time, walls, rng):
    """Error (n, m) of carrier phases by reflected signals, slow like satellites. Units: m.

    It is at most a quarter of the wavelength, for a reflection as strong as the direct signal,
    scaled by the share of the sky that walls hide.
    """
    shape = 2, RECEIVER.satellites
    logarithm = np.log(RECEIVER.reflection_periods)
    period = np.exp(rng.uniform(*logarithm, shape))
    phase = rng.uniform(0, 2 * np.pi, shape)
    elapsed = (gps_time - gps_time[0])[:, None]
    ground, wall = (np.sin(2 * np.pi * elapsed / p + q) for p, q in zip(period, phase, strict=True))
    hidden = np.sin(walls).mean(axis=1, keepdims=True)
    return np.sqrt(2) * RECEIVER.reflected * ground + WAVELENGTH / 4 * hidden * wall


def _solve(azimuth, elevation, visible, sigma, error):
    """Fixes by weighted least squares for position and clock at every epoch."""
    flat = np.cos(elevation)
    design = np.stack(
        [flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation), np.ones_like(flat)],
        axis=-1,
    )
    weight = visible / sigma**2
    count = visible.sum(axis=1)
    dilution = np.full(len(count), np.inf)
    solvable = count >= 4
    plain = np.einsum("kmi,km,kmj->kij", design, visible.astype(float), design)[solvable]
    inverse = np.linalg.inv(plain + 1e-9 * np.eye(4))  # huge along an undetermined direction
    dilution[solvable] = np.sqrt(np.trace(inverse[:, :3, :3], axis1=1, axis2=2))
    valid = dilution < RECEIVER.worst_dilution

    normal = np.einsum("kmi,km,kmj->kij", design[valid], weight[valid], design[valid])
    cofactor = np.linalg.inv(normal)
    right = np.einsum("kmi,km,km->ki", design[valid], weight[valid], error[valid])
    solution = np.einsum("kij,kj->ki", cofactor, right)
    residual = error[valid] - np.einsum("kmi,ki->km", design[valid], solution)
    redundancy = np.maximum(count[valid] - 4, 1)
    ratio = np.sqrt(np.einsum("km,km->k", weight[valid], residual**2) / redundancy)
    factor = RECEIVER.caution * np.where(ratio > RECEIVER.suspect, ratio, 1.0)
    factor *= np.where(count[valid] < RECEIVER.fixing, RECEIVER.doubt, 1.0)

    fixes = np.zeros((len(count), 3))
    covariance = np.zeros((len(count), 3, 3))
    fixes[valid] = solution[:, :3]
    covariance[valid] = factor[:, None, None] ** 2 * cofactor[:, :3, :3]
    return Fixes(fixes, covariance, count, valid)
