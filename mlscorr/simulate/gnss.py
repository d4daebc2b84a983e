"""GNSS fixes from satellites: noise, reflections, and a sky that walls hide.

Position errors are not drawn but solved for: every satellite's range has an error, and the least
squares of those in view turns them into a fix, with its dilution of precision.
"""

from dataclasses import dataclass, replace

import numpy as np

SATELLITES = 13  # above the horizon, so that more than 9 are used, as in Mao et al. 2015, 3.1
MASK = np.radians(10.0)  # elevation below which satellites are not used, usual in surveying
CANYON = np.radians(55.0)  # elevation of the walls on both sides, Mao et al. 2015, 3.1
MOTION = np.radians(0.5) / 60  # rad/s that a satellite moves: half a turn in 6 h
# m, carrier phase, times hypot(1, 1 / sin(elevation)): RTKLIB's model has 0.003 for a receiver at
# rest; on the road the errors of real_pos_error between its outages (1.4, 1.4, 2.0 cm) show more.
PHASE_NOISE = 0.005
DIFFERENCED = np.sqrt(2.0)  # against the noise of a base station as good
WAVELENGTH = 0.1903  # m, L1
# m, of carrier phases in open sky, by roof and ground: the errors of the same series hang together
# by no more than a quarter after 5 s.
REFLECTED = 0.004
REFLECTION_PERIODS = 40.0, 400.0  # s: WAVELENGTH / (2 d cos(elevation) MOTION), d = 16 to 2 m
WORST_DILUTION = 20.0  # of position, beyond which software gives no fix
SUSPECT = 1.4  # ratio of residuals to expected noise that a test at 1 % of 6 redundancies rejects
CAUTION = 1.5  # software multiplies its sigmas, as errors of successive fixes are not independent
# With few satellites ambiguities stay unsure, and software states sigmas this much larger:
# GrafNav's quality 2 against quality 1 is 0.05-0.40 m against 0-0.15 m.
FEW, DOUBT = 7, 3.0


@dataclass(frozen=True)
class Fixes:
    """GNSS positions at n epochs.

    Parameters
    ----------
    error : (n, 3) array
        Fix minus truth, E, N, H; zero where there is none. Units: m.
    covariance : (n, 3, 3) array
        As the software states it. Units: m^2.
    satellites : (n,) int array
        Satellites in view.
    found : (n,) bool array
        Whether there is a fix.
    """

    error: np.ndarray
    covariance: np.ndarray
    satellites: np.ndarray
    found: np.ndarray

    def without(self, lost):
        """The same fixes, but none at the epochs lost (n,)."""
        return replace(self, found=self.found & ~lost)


def gnss_fixes(gps_time, heading, walls, rng, white_only=False):
    """Fixes at the times (n,) of a vehicle, in s.

    Parameters
    ----------
    gps_time, heading : (n,) array
        Units: s, rad.
    walls : (n, 2) array
        Elevation below which the sky is hidden square to the left and right. Units: rad.
    rng : Generator
    white_only : bool
        Without reflections, and with sigmas that state exactly the noise.
    """
    sky_rng, noise_rng, path_rng = rng.spawn(3)
    azimuth, elevation = _constellation(gps_time, sky_rng)
    hidden = wall_elevation(azimuth, heading, walls)
    visible = elevation > np.maximum(hidden, MASK)
    sigma = DIFFERENCED * PHASE_NOISE * np.hypot(1.0, 1 / np.sin(np.maximum(elevation, MASK)))
    error = sigma * noise_rng.standard_normal(sigma.shape)
    if not white_only:
        error += _reflections(gps_time, walls, path_rng)
    return _solve(azimuth, elevation, visible, sigma, error, white_only)


def wall_elevation(azimuth, heading, walls):
    """Elevation (n, m) of endless walls along the way towards azimuths (n, m). Units: rad.

    tan(elevation) = tan(elevation square to the way) |sin(azimuth - heading)|.

    >>> walls = np.radians([[20.0, 55.0]])
    >>> east = np.radians([[90.0, 120.0]])
    >>> np.degrees(wall_elevation(east, np.zeros(1), walls)).round(1)
    array([[55., 51.]])
    """
    across = np.sin(azimuth - heading[:, None])
    side = np.where(across < 0, walls[:, :1], walls[:, 1:])
    return np.arctan(np.tan(side) * np.abs(across))


def _constellation(gps_time, rng):
    """Azimuths and elevations (n, m) of satellites, even over the sky and moving. Units: rad."""
    azimuth = rng.uniform(0, 2 * np.pi, SATELLITES)
    elevation = np.arcsin(rng.uniform(0, 1, SATELLITES))
    course = rng.uniform(0, 2 * np.pi, SATELLITES)
    moved = MOTION * (gps_time - gps_time.mean())[:, None]
    return (
        azimuth + moved * np.sin(course) / np.maximum(np.cos(elevation), 0.2),
        np.clip(elevation + moved * np.cos(course), -np.pi / 2, np.pi / 2),
    )


def _reflections(gps_time, walls, rng):
    """Error (n, m) of carrier phases by reflected signals, slow as satellites move. Units: m.

    At most a quarter of the wave, where a reflection is as strong as the direct signal; by the
    share of the sky that the walls hide.
    """
    shape = 2, SATELLITES
    logarithm = np.log(REFLECTION_PERIODS)
    period, phase = np.exp(rng.uniform(*logarithm, shape)), rng.uniform(0, 2 * np.pi, shape)
    elapsed = (gps_time - gps_time[0])[:, None]
    ground, wall = (np.sin(2 * np.pi * elapsed / p + q) for p, q in zip(period, phase, strict=True))
    hidden = np.sin(walls).mean(axis=1, keepdims=True)
    return np.sqrt(2) * REFLECTED * ground + WAVELENGTH / 4 * hidden * wall


def _solve(azimuth, elevation, visible, sigma, error, exact):
    """Fixes by weighted least squares for position and clock at every epoch."""
    flat = np.cos(elevation)
    design = np.stack(
        [flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation), np.ones_like(flat)],
        axis=-1,
    )
    weight = visible / sigma**2
    count = visible.sum(axis=1)
    dilution = np.full(len(count), np.inf)
    seen = count >= 4
    plain = np.einsum("kmi,km,kmj->kij", design, visible.astype(float), design)
    dilution[seen] = np.sqrt(np.trace(_inverse(plain[seen])[:, :3, :3], axis1=1, axis2=2))
    found = dilution < WORST_DILUTION

    normal = np.einsum("kmi,km,kmj->kij", design[found], weight[found], design[found])
    cofactor = np.linalg.inv(normal)
    right = np.einsum("kmi,km,km->ki", design[found], weight[found], error[found])
    solution = np.einsum("kij,kj->ki", cofactor, right)
    factor = np.ones(found.sum())
    if not exact:
        residual = error[found] - np.einsum("kmi,ki->km", design[found], solution)
        redundancy = np.maximum(count[found] - 4, 1)
        ratio = np.sqrt(np.einsum("km,km->k", weight[found], residual**2) / redundancy)
        factor = CAUTION * np.where(ratio > SUSPECT, ratio, 1.0)
        factor *= np.where(count[found] < FEW, DOUBT, 1.0)

    fixes = np.zeros((len(count), 3))
    covariance = np.zeros((len(count), 3, 3))
    fixes[found] = solution[:, :3]
    covariance[found] = factor[:, None, None] ** 2 * cofactor[:, :3, :3]
    return Fixes(fixes, covariance, count, found)


def _inverse(matrices):
    """Inverses of normal matrices (n, 4, 4), huge where the geometry leaves a direction open."""
    return np.linalg.inv(matrices + 1e-9 * np.eye(4))
