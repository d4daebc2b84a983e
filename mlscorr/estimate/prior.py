"""What is believed of the parameters of the signals before the misclosures."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from mlscorr.estimate.equations import NO_TREND, Equations
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters

SCALES = ("drift_scale", "walk_scale", "jitter_scale", "bias_scale")
# One sigma of the logarithms about their start
SPREAD = {
    name: float(np.log(factor))
    for factor, names in (
        (SETTINGS.precise_factor, ("drift_time", "attitude_scale")),
        (SETTINGS.time_factor, ("jitter_time", "bias_time", "attitude_time", "trend_sigma")),
        (SETTINGS.scale_factor, (*SCALES, "level_scale")),
    )
    for name in names
}
SPLIT = ("jitter_scale", "jitter_time", "bias_scale", "bias_time")  # where sigma(t) has two parts
NAMES = tuple(field.name for field in fields(SignalParameters) if field.name != "family")


@dataclass(frozen=True)
class Prior:
    """What is believed of the parameters: log-normal about start values.

    Parameters
    ----------
    start : (len(NAMES),) array
        Logarithms.
    free : (k,) int array
        Numbers of those that are chosen.
    spread : (k,) array
        One sigma of their logarithms.
    attitude_follows : bool
        Whether the attitude's correlation time is that of the drift.
    """

    start: np.ndarray
    free: np.ndarray
    spread: np.ndarray
    attitude_follows: bool


def position_prior(equations: Equations) -> Prior:
    """Prior of a correction.

    The time of drift and bias is by the paper's rule, or what is believed where the trajectory has
    no sigmas; the attitude's time is that of the drift.

    Parameters
    ----------
    equations : Equations
    """
    time = SETTINGS.start_ratio * equations.interval
    if equations.trajectory.position_sigma is None:
        time = equations.pos.correlation_time
    return _prior(equations, time, attitude_follows=True)


def mounting_prior(equations: Equations) -> Prior:
    """Prior of a calibration.

    A site's targets stand so close that their interval says nothing of the POS, so the time is the
    believed correlation time; the attitude's is that of gyro biases.

    Parameters
    ----------
    equations : Equations
    """
    return _prior(equations, equations.pos.correlation_time, attitude_follows=False)


def _prior(equations, time, attitude_follows):
    start = {
        "drift_time": time,
        "jitter_time": equations.interval,  # correlated over one interval
        "bias_time": time,
        "attitude_time": SETTINGS.attitude_time,
        "walk_scale": SETTINGS.walk_scale,
        "trend_sigma": SETTINGS.trend_sigma,
    }
    is_held = len(equations.names) > 0
    if not is_held:  # nothing tells of what all passes share, of which the POS states this
        start["trend_sigma"] = float(np.sqrt(np.mean(equations.stated_epochs.gnss**2)))
    is_split = bool(np.any(equations.stated.gnss))
    fixed = (() if is_split else SPLIT) + (("attitude_time",) if attitude_follows else ())
    fixed += ("level_scale",) if equations.stated.gnss_clock is None else ()
    fixed += ("trend_sigma",) if equations.order == NO_TREND or not is_held else ()
    free = [name for name in NAMES if name not in fixed]
    return Prior(
        np.log([start.get(name, 1.0) for name in NAMES]),
        np.array([NAMES.index(name) for name in free]),
        np.array([SPREAD[name] for name in free]),
        attitude_follows,
    )
