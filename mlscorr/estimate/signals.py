"""The POS error as random signals, each on a clock and with a sigma of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import Signal
from mlscorr.collocation.covariance import INTEGRATED, Covariance
from mlscorr.pos import StatedSigma


@dataclass(frozen=True)
class SignalParameters:
    """What is chosen by likelihood: factors on stated sigmas, correlation times in s, and a sigma.

    Parameters
    ----------
    family : str
        Covariance family of drift, of bias and of attitude (Matern 3/2 beside integrated drift).
    drift_scale, drift_time : float
    walk_scale : float
        Of the random walk in an integrated drift.
    jitter_scale, jitter_time : float
    bias_scale, bias_time : float
    level_scale : float
        Of what sigma(t) is raised by at once, as by a solution that is not fixed.
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
    """Signals as they enter three axes of n points: drift first, then jitter, bias, attitude.

    Parameters
    ----------
    stated : StatedSigma
        At the n epochs.
    parameters : SignalParameters
    partials : (n, 3, 6) array
        Of the points by position and rotation.
    """
    position, rotation = partials[:, :, :3], partials[:, :, 3:]
    family = "matern32" if parameters.family == INTEGRATED else parameters.family
    gnss = position * stated.gnss_by(parameters.level_scale)[:, None]
    clock = stated.gnss_clock
    jitter = Covariance("exponential", parameters.jitter_time)
    return (
        *_drift(stated, parameters, position),
        Signal(parameters.jitter_scale * gnss, jitter, clock),
        Signal(parameters.bias_scale * gnss, Covariance(family, parameters.bias_time), clock),
        Signal(
            parameters.attitude_scale * rotation @ stated.attitude,
            Covariance(family, parameters.attitude_time),
        ),
    )


def _drift(stated, parameters, position):
    """Drift with the stated sigma(t), or velocity and position random walk since GNSS went."""
    if parameters.family != INTEGRATED:
        drift = parameters.drift_scale * position * stated.drift[:, None]
        return (Signal(drift, Covariance(parameters.family, parameters.drift_time), stated.clock),)
    clock = stated.growth_clock
    velocity = parameters.drift_scale * position * stated.grown(1.5)[:, None]
    walk = parameters.walk_scale * position * stated.grown(0.5)[:, None]
    # a random walk over its sigma is exponential on a logarithmic clock, exp(-x / 2)
    return (
        Signal(velocity, Covariance(INTEGRATED, 1.0), clock),
        Signal(walk, Covariance("exponential", 2.0), clock),
    )


def drift_alone(signals: tuple[Signal, ...], shown: np.ndarray) -> tuple[Signal, ...]:
    """The signals, of which the last rows show drift, and jitter and bias where they are shown.

    Parameters
    ----------
    signals : tuple of Signal
        As pose_signals gives them: jitter, bias and attitude are the last three.
    shown : (h,) bool array
        Of the last h rows.
    """
    rows = len(shown)
    if rows == 0:
        return signals
    hidden = []
    for signal, stays in zip(signals[-3:], (shown, shown, np.zeros(rows)), strict=True):
        mixing = signal.mixing.copy()
        mixing[-rows:] *= np.reshape(stays, (-1, 1, 1))
        hidden.append(replace(signal, mixing=mixing))
    return (*signals[:-3], *hidden)
