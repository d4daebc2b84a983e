"""The POS error as random signals, each with its own clock and sigma."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.collocation import INTEGRATED, Covariance, Signal
from mlscorr.pos.stated import StatedSigma


@dataclass(frozen=True)
class SignalParameters:
    """Parameters chosen by likelihood: factors on stated sigmas, correlation times in s, a sigma.

    Parameters
    ----------
    family : str
        Covariance family of drift, of bias and of attitude (Matern 3/2 with integrated drift).
    drift_scale, drift_time : float
    walk_scale : float
        Of the random walk in an integrated drift.
    jitter_scale, jitter_time : float
    bias_scale, bias_time : float
    level_scale : float
        Of abrupt increases of sigma(t), as by a solution that is not fixed.
    attitude_scale, attitude_time : float
    trend_sigma : float
        Of each coefficient of the trend. Units: m.
    """

    family: str
    drift_scale: float
    drift_time: float
    walk_scale: float
    jitter_scale: float
    jitter_time: float
    bias_scale: float
    bias_time: float
    level_scale: float
    attitude_scale: float
    attitude_time: float
    trend_sigma: float


def pose_signals(
    stated: StatedSigma, parameters: SignalParameters, partials: np.ndarray
) -> tuple[Signal, ...]:
    """Return signals as they affect three axes of n points: drift first, GNSS and attitude last.

    The errors of GNSS at its best continue throughout, so that their sigma never changes abruptly.
    Additional errors of another solution come and go with it.

    Parameters
    ----------
    stated : StatedSigma
        At the n epochs.
    parameters : SignalParameters
    partials : (n, 3, 6) array
        Of the points by position and rotation.
    """
    position = partials[:, :, :3]
    rotation = partials[:, :, 3:]
    if parameters.family == INTEGRATED:
        family = "matern32"
    else:
        family = parameters.family
    least = position * stated.least[:, None]
    jitter = Covariance("exponential", parameters.jitter_time)
    bias = Covariance(family, parameters.bias_time)
    added = ()
    if stated.history.added.any():
        clock = stated.gnss_clock
        increased = parameters.level_scale * position * stated.added[:, None]
        added = (
            Signal(parameters.jitter_scale * increased, jitter, clock),
            Signal(parameters.bias_scale * increased, bias, clock),
        )
    return (
        *_drift(stated, parameters, position),
        *added,
        Signal(parameters.jitter_scale * least, jitter),
        Signal(parameters.bias_scale * least, bias),
        Signal(
            parameters.attitude_scale * rotation @ stated.attitude,
            Covariance(family, parameters.attitude_time),
        ),
    )


def drift_signals(parameters: SignalParameters) -> int:
    """Number of drift signals, the first ones of pose_signals.

    Parameters
    ----------
    parameters : SignalParameters
    """
    if parameters.family == INTEGRATED:
        return 2
    return 1


def _drift(stated, parameters, position):
    """Drift with the stated sigma(t), or velocity and position random walk without GNSS."""
    if parameters.family != INTEGRATED:
        drift = parameters.drift_scale * position * stated.drift[:, None]
        clock = stated.clock + parameters.drift_time * stated.folds_clock
        return (Signal(drift, Covariance(parameters.family, parameters.drift_time), clock),)
    clock = stated.growth_clock
    velocity = parameters.drift_scale * position * stated.grown(1.5)[:, None]
    walk = parameters.walk_scale * position * stated.grown(0.5)[:, None]
    # a random walk over its sigma is exponential on a logarithmic clock, exp(-x / 2)
    return (
        Signal(velocity, Covariance(INTEGRATED, 1.0), clock),
        Signal(walk, Covariance("exponential", 2.0), clock),
    )
