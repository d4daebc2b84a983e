"""Centre of a target in space, by its outline and the points on it."""

from dataclasses import dataclass

import numpy as np

from mlscorr.targets._echoes import Echoes
from mlscorr.targets._outline import Outline
from mlscorr.targets._plane import Plane
from mlscorr.targets.settings import SETTINGS


@dataclass(frozen=True)
class Centre:
    """Where and when a beam meets the centre of an outline in a plane.

    Parameters
    ----------
    position : (3,) array
        Units: m.
    covariance : (3, 3) array
        Units: m^2.
    gps_time : float
        Units: s.
    duration : float
        Standard deviation of the points' times. Units: s.
    normal : (3,) array
        Towards the scanner.
    """

    position: np.ndarray
    covariance: np.ndarray
    gps_time: float
    duration: float
    normal: np.ndarray


def centre_of(echoes: Echoes, plane: Plane, outline: Outline, rows: np.ndarray) -> Centre:
    """Centre of an outline in space from the points on the target.

    Parameters
    ----------
    echoes : Echoes
    plane : Plane
    outline : Outline
    rows : (k,) int array
        Points on the target.

    Height and time there follow by regression, as the points may lie on one side of it. A plane
    too far moves the centre along the beam. Range noise may be correlated from point to point,
    which plain sigmas of a fit overlook: the residuals tell by how much.
    """
    crossing = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
    weights = np.linalg.pinv(np.column_stack([np.ones(len(rows)), crossing - outline.centre]))[0]
    height = plane.coordinates(echoes.xyz[rows])[:, 2]
    free = max(len(rows) - 3, 1)
    variance = plane.sigma**2 * (free + 2) / free * _correlation_factor(height)
    beam = plane.axes @ echoes.sight(rows).mean(axis=0)
    covariance = variance * (weights @ weights) * np.outer(beam, beam) / beam[2] ** 2
    covariance[:2, :2] += outline.covariance
    time = echoes.gps_time[rows] - echoes.gps_time[0]
    span = echoes.gps_time[[0, -1]] - echoes.gps_time[0]
    floor = (SETTINGS.rounding / 3) ** 2  # what rounding leaves in a mean of many points
    return Centre(
        position=plane.origin + outline.centre @ plane.axes[:2],
        covariance=plane.axes.T @ covariance @ plane.axes + floor * np.eye(3),
        gps_time=float(echoes.gps_time[0] + np.clip(weights @ time, *span)),
        duration=float(time.std()),
        normal=-plane.axes[2] if beam[2] > 0 else plane.axes[2],
    )


def _correlation_factor(residual):
    """By how much correlation from point to point raises the variance of a mean, at least 1.

    Source: 1 + 2 sum of the autocorrelation up to where it is lost in its own noise.
    """
    n = len(residual)
    centred = residual - residual.mean()
    total = centred @ centred
    factor = 1.0
    for lag in range(1, n // 4):
        correlation = centred[lag:] @ centred[:-lag] / max(total, 1e-30)
        if correlation < 2 / np.sqrt(n):
            break
        factor += 2 * correlation
    return factor
