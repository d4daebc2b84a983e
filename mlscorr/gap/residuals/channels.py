"""Channels of single patches: roughness, and share of returning pulses.

Log intensity is not used: a reference surface has no reflectance, and survey.toml does not state
the decrease of strength with range, so there is no reference for it.
"""

from dataclasses import replace

import numpy as np

from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows, scanner_origin
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.surfaces import degrees_of_freedom
from mlscorr.survey import Survey


def rounding_sigma() -> float:
    """Sigma of a coordinate due to rounding in a file, with uniform errors. Units: m."""
    return SETTINGS.file_step / np.sqrt(12)


def _assumed_variance(survey, patches):
    """Variance (p,) about the plane expected from range and angle noise. Units: m^2."""
    p, samples = patches.time.shape
    time = patches.time.ravel()
    xyz = patches.xyz.reshape(-1, 3)
    normal = np.repeat(patches.normal, samples, axis=0)
    sight = xyz - scanner_origin(survey, time)
    slant = np.einsum("ni,ni->n", sight, normal) / np.linalg.norm(sight, axis=1)
    tilt = np.einsum("ni,ni->n", _sweep(survey, sight, time), normal)
    variance = (survey.scanner.range_noise * slant) ** 2 + rounding_sigma() ** 2
    variance += (survey.scanner.angle_noise * tilt) ** 2
    return variance.reshape(p, samples).mean(axis=1)


def _sweep(survey, sight, time):
    """Motion (n, 3) of a point with its scan angle, m per rad; as if the scanner turned about
    the driving direction if the mounting is unknown.
    """
    mounting = survey.mounting
    axis = np.array([0.0, 1.0, 0.0])
    if mounting is not None:
        axis = mounting.boresight.apply([0.0, 0.0, 1.0])
    return np.cross(survey.trajectory.at(time).attitude.apply(axis), sight)


def log_roughness(
    variance: np.ndarray, assumed: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Unbiased log of a variance about a plane over the assumed one, and its variance.

    Mean and variance of the logarithm of chi^2 / freedom, to the second order.

    Parameters
    ----------
    variance, assumed : (p,) array
        Units: m^2.
    points : (p,) array
        On each plane.
    """
    freedom = degrees_of_freedom(points)
    return np.log(variance / assumed) + 1 / freedom, 2 / freedom


def roughness(
    survey: Survey, patches: Patches
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Roughness of patches relative to the assumed scanner noise.

    Parameters
    ----------
    survey : Survey
    patches : Patches

    Returns
    -------
    tuple of four (p,) arrays
        Log variance ratio, its variance, the assumed variance (m^2), and flags of patches that
        count: curved ones never do, and none do if the scanner's noise is a default.
    """
    assumed = _assumed_variance(survey, patches)
    ratio, variance = log_roughness(patches.variance, assumed, patches.points)
    flat = patches.ripple <= SETTINGS.largest_ripple
    return ratio, variance, assumed, flat & (not survey.scanner.assumed)


def limited_noise(rows: Rows) -> tuple[Rows, tuple[str, ...]]:
    """Rows for a scanner that is not noisier than the cloud, and a sentence if it was.

    Noise only adds: no effect makes a scanner quieter if its assumed noise is too large.

    Parameters
    ----------
    rows : Rows
    """
    rough = (rows.channel == "roughness") & np.isfinite(rows.residual)
    if rough.any():
        offset = float(np.median(rows.residual[rough]))
    else:
        offset = 0.0
    if offset > -np.log(2):  # half the variance: more than planes differ among themselves
        return rows, ()
    quiet = replace(
        rows,
        residual=np.where(rough, rows.residual - offset, rows.residual),
        assumed=np.where(rough, rows.assumed * np.exp(offset), rows.assumed),
    )
    return quiet, (
        f"Flat surfaces scatter {np.exp(-offset / 2):.1f} times less than simulated: the range "
        "or angle noise of the simulator is too large. Only noise beyond this was tested.",
    )


def return_rate(patches: Patches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of returning pulses of patches, relative to the assumed 1.

    Parameters
    ----------
    patches : Patches

    Returns
    -------
    tuple of three (p,) arrays
        Share minus 1, its variance for equal losses, and flags of patches that count: none if the
        median share is so low that the cloud must have been thinned.
    """
    fired = np.maximum(patches.fired, 1)
    share = patches.returned / fired
    counted = patches.fired >= SETTINGS.fired
    if counted.any():
        counted &= np.median(share[counted]) >= SETTINGS.thinned
    return share - 1.0, loss_variance(share, fired, counted), counted


def loss_variance(share: np.ndarray, fired: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Variance (p,) of the shares of returning pulses if all patches have the same loss.

    It uses the common loss of the patches instead of each single one, because few pulses are lost
    by chance, and a patch without losses would get a variance of zero.

    Parameters
    ----------
    share : (p,) array
        That returned.
    fired : (p,) array
        Pulses.
    counted : (p,) bool array
        Patches to use; the tenth of them with the largest loss, crowns and edges, is omitted.
    """
    share_lost = 1.0 - share[counted]
    if counted.any():
        usual = share_lost <= np.quantile(share_lost, 0.9)
    else:
        usual = counted[:0]
    if usual.any():
        loss = float(np.average(share_lost[usual], weights=fired[counted][usual]))
    else:
        loss = 0
    loss = min(max(loss, SETTINGS.least_loss), 1.0 - SETTINGS.least_loss)
    return loss * (1.0 - loss) / fired


def with_loss_variance(rows: Rows) -> Rows:
    """Return rows whose return rates have the variance indicated by their losses.

    Parameters
    ----------
    rows : Rows
    """
    rate = rows.channel == "return_rate"
    noise = rows.noise.copy()
    noise[rate] = loss_variance(1.0 + rows.residual[rate], rows.points[rate], rate[rate])
    return replace(rows, noise=noise)
