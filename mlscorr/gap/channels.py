"""What each patch tells of itself: its roughness, and how many of its pulses returned.

Log intensity is left out: a reference surface has no reflectance, and survey.toml says nothing of
how strength falls with range, so that there is nothing to compare it with.
"""

import numpy as np

from mlscorr.gap.covariates import scanner_origin

ROUNDING = 1e-3 / np.sqrt(12)  # m, one sigma: of the usual LAS scale of 1 mm
PARAMETERS = 3  # of a plane
LEAST_LOSS = 0.002  # share: what any scanner loses, so that no loss in 100 pulses proves nothing
FEWEST_PULSES = 20  # fired between points of a patch, to speak of a share
LARGEST_RIPPLE = 1.5  # of Patches: 19 of 20 flat ones have less, by the chance of few points
THINNED = 0.6  # median share of returns below which the cloud was thinned, not poorly received


def believed_variance(survey, patches):
    """Variance (p,) about the plane that range and angle noise should make. Units: m^2."""
    p, samples = patches.time.shape
    time, xyz = patches.time.ravel(), patches.xyz.reshape(-1, 3)
    normal = np.repeat(patches.normal, samples, axis=0)
    sight = xyz - scanner_origin(survey, time)
    away = np.linalg.norm(sight, axis=1)
    slant = np.einsum("ni,ni->n", sight, normal) / away
    across = _sweep(survey, sight, time)
    sideways = np.einsum("ni,ni->n", across, normal)
    variance = (survey.scanner.range_noise * slant) ** 2 + ROUNDING**2
    variance += (survey.scanner.angle_noise * sideways) ** 2
    return variance.reshape(p, samples).mean(axis=1)


def _sweep(survey, sight, time):
    """How a point moves (n, 3) as its scan angle grows, m per rad; as if the scanner turned about
    the driving direction where the mounting is not known."""
    if survey.mounting is None:
        forward = survey.trajectory.at(time).attitude.apply([0.0, 1.0, 0.0])
        return np.cross(forward, sight)
    axis = survey.trajectory.at(time).attitude.apply(
        survey.mounting.boresight.apply([0.0, 0.0, 1.0])
    )
    return np.cross(axis, sight)


def roughness(survey, patches):
    """Log variance ratio, its variance, the believed variance, and which patches tell it: (p,)
    each. None that is curved does, whatever the noise."""
    believed = believed_variance(survey, patches)
    freedom = patches.points - PARAMETERS
    ratio = np.log(patches.variance / believed)
    # mean and variance of the logarithm of chi^2 / freedom, to the second order
    return ratio + 1 / freedom, 2 / freedom, believed, patches.ripple <= LARGEST_RIPPLE


def return_rate(patches):
    """Share returned minus the believed 1, its variance, and which patches tell it: (p,) each.

    None tells it where the median share is so low that the cloud must have been thinned.
    """
    fired = np.maximum(patches.fired, 1)
    share, told = patches.returned / fired, patches.fired >= FEWEST_PULSES
    told &= np.median(share[told]) >= THINNED if told.any() else False
    loss = np.maximum(1.0 - share, LEAST_LOSS)
    return share - 1.0, loss * (1.0 - loss) / fired, told
