"""What each patch tells of itself: its roughness, and how many of its pulses returned.

Log intensity is left out: a reference surface has no reflectance, and survey.toml says nothing of
how strength falls with range, so that there is nothing to compare it with.
"""

from dataclasses import replace

import numpy as np

from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows, scanner_origin
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.surfaces import degrees_of_freedom
from mlscorr.survey import Survey


def rounding_sigma() -> float:
    """What rounding in a file adds to a coordinate, one sigma of its even errors. Units: m."""
    return SETTINGS.file_step / np.sqrt(12)


def _believed_variance(survey, patches):
    """Variance (p,) about the plane that range and angle noise should make. Units: m^2."""
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
    """How a point moves (n, 3) as its scan angle grows, m per rad; as if the scanner turned about
    the driving direction where the mounting is not known.
    """
    mounting = survey.mounting
    axis = np.array([0.0, 1.0, 0.0])
    if mounting is not None:
        axis = mounting.boresight.apply([0.0, 0.0, 1.0])
    return np.cross(survey.trajectory.at(time).attitude.apply(axis), sight)


def log_roughness(
    variance: np.ndarray, believed: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Log of a variance about a plane over the believed one, without its bias, and its variance.

    Mean and variance of the logarithm of chi^2 / freedom, to the second order.

    Parameters
    ----------
    variance, believed : (p,) array
        Units: m^2.
    points : (p,) array
        On each plane.
    """
    freedom = degrees_of_freedom(points)
    return np.log(variance / believed) + 1 / freedom, 2 / freedom


def roughness(
    survey: Survey, patches: Patches
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """How rough patches are beside what the scanner is believed to make.

    Parameters
    ----------
    survey : Survey
    patches : Patches

    Returns
    -------
    tuple of four (p,) arrays
        Log variance ratio, its variance, the believed variance (m^2), and which patches count:
        none that is curved does, whatever the noise, nor any where the scanner's noise is assumed.
    """
    believed = _believed_variance(survey, patches)
    ratio, variance = log_roughness(patches.variance, believed, patches.points)
    flat = patches.ripple <= SETTINGS.largest_ripple
    return ratio, variance, believed, flat & (not survey.scanner.assumed)


def beside_seen_noise(rows: Rows) -> tuple[Rows, tuple[str, ...]]:
    """Rows beside a scanner that is no noisier than the cloud, and a sentence where one was.

    Noise only adds: of a scanner that is believed too noisy no effect makes a quieter one.

    Parameters
    ----------
    rows : Rows
    """
    rough = (rows.channel == "roughness") & np.isfinite(rows.residual)
    if rough.any():
        offset = float(np.median(rows.residual[rough]))
    else:
        offset = 0.0
    if offset > -np.log(2):  # half the variance: more than planes differ by among themselves
        return rows, ()
    quiet = replace(
        rows,
        residual=np.where(rough, rows.residual - offset, rows.residual),
        believed=np.where(rough, rows.believed * np.exp(offset), rows.believed),
    )
    return quiet, (
        f"Flat surfaces scatter {np.exp(-offset / 2):.1f} times less than simulated: the range "
        "or angle noise of the simulator is too large. Only noise beyond this was tested.",
    )


def return_rate(patches: Patches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of pulses that returned from patches beside the believed 1.

    Parameters
    ----------
    patches : Patches

    Returns
    -------
    tuple of three (p,) arrays
        Share minus 1, its variance where all lose alike, and which patches count: none where the
        median share is so low that the cloud must have been thinned.
    """
    fired = np.maximum(patches.fired, 1)
    share = patches.returned / fired
    counted = patches.fired >= SETTINGS.fired
    if counted.any():
        counted &= np.median(share[counted]) >= SETTINGS.thinned
    return share - 1.0, loss_variance(share, fired, counted), counted


def loss_variance(share: np.ndarray, fired: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Variance (p,) of the shares of pulses that return where all patches lose alike.

    It is of what the patches lose together, not each of them: few pulses are lost by chance, and a
    patch that has lost none would seem to know so.

    Parameters
    ----------
    share : (p,) array
        That returned.
    fired : (p,) array
        Pulses.
    counted : (p,) bool array
        Patches that say so; of these the tenth that loses most, crowns and edges, is left out.
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
    """Rows whose return rates have the variance that their losses show.

    Parameters
    ----------
    rows : Rows
    """
    rate = rows.channel == "return_rate"
    noise = rows.noise.copy()
    noise[rate] = loss_variance(1.0 + rows.residual[rate], rows.points[rate], rate[rate])
    return replace(rows, noise=noise)
