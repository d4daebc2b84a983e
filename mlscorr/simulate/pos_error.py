"""The error of a position and orientation system, from its causes.

Noise of a good GNSS solution, multipath between houses, drift of the inertial system while GNSS
is lost, slow wander of the attitude. Each is made by what causes it, never drawn from a
covariance function: the estimator's own model must not be what it is tested on.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from mlscorr.survey import Trajectory, angles_from_attitude, attitude_from_angles

GNSS_NOISE = np.array([0.010, 0.010, 0.018])  # m, smoothed kinematic GNSS/INS of 1-2 cm
GNSS_PERIOD = 20.0  # s, what the smoother leaves of the noise
MULTIPATH = np.array([0.04, 0.04, 0.06])  # m, carrier phase and wrong reflections in streets
MULTIPATH_PERIOD = 80.0  # s, the geometry of satellites and houses changes slowly
VELOCITY_ERROR = 0.02  # m/s when GNSS is lost, of GNSS/INS in good GNSS
VELOCITY_WALK = 0.0008  # m/s per sqrt(s), 0.05 m/s per sqrt(h), tactical to MEMS class
VERTICAL = 0.5  # of the horizontal drift: tilt turns gravity into horizontal acceleration
ATTITUDE_ERROR = np.radians([0.006, 0.006, 0.014])  # one sigma of roll, pitch, heading
ATTITUDE_STEP = 0.25  # of one sigma, walked in a second
OPTIMISM = 1.5  # software reports its sigmas within this factor of the truth
EDGE = 3.0  # s in which multipath comes and goes


@dataclass(frozen=True)
class PosError:
    """Recorded minus true pose at n epochs, and the sigmas that the POS software reports.

    position, position_sigma (n, 3) in m: E, N, H; attitude, attitude_sigma (n, 3) in rad: roll,
    pitch, heading.
    """

    position: np.ndarray
    attitude: np.ndarray
    position_sigma: np.ndarray
    attitude_sigma: np.ndarray


def pos_error(elapsed, scenario, rng):
    """PosError at the epochs elapsed (n,) since the start of the drive. Units: s."""
    noise_rng, path_rng, outage_rng, attitude_rng, report_rng = rng.spawn(5)
    position = GNSS_NOISE * slow_noise(elapsed, GNSS_PERIOD, noise_rng)
    variance = np.tile(GNSS_NOISE**2, (len(elapsed), 1))

    gate = _gate(elapsed, scenario.canyons)[:, None]
    position += gate * MULTIPATH * slow_noise(elapsed, MULTIPATH_PERIOD, path_rng)
    variance += (gate * MULTIPATH) ** 2

    for start, duration in scenario.outages:
        inside = (elapsed > start) & (elapsed < start + duration)
        drift, drift_variance = outage_drift(
            elapsed[inside] - start, duration, scenario.accelerometer_bias, outage_rng
        )
        position[inside] += drift
        variance[inside] += drift_variance

    optimism = OPTIMISM ** report_rng.uniform(-1.0, 1.0, 2)
    return PosError(
        position,
        ATTITUDE_ERROR * bounded_walk(elapsed, ATTITUDE_STEP, attitude_rng),
        optimism[0] * np.sqrt(variance),
        np.tile(optimism[1] * ATTITUDE_ERROR, (len(elapsed), 1)),
    )


def record(trajectory, error):
    """Trajectory that the POS records of a true one."""
    angles = np.column_stack(angles_from_attitude(trajectory.attitude)) + error.attitude
    return Trajectory(
        trajectory.gps_time,
        trajectory.position + error.position,
        attitude_from_angles(*angles.T),
        error.position_sigma,
        error.attitude_sigma,
    )


def outage_drift(elapsed, duration, accelerometer_bias, rng):
    """Drift (n, 3) of the smoothed position in an outage, and its variance (n, 3). Units: m, m^2.

    Dead reckoning runs forward from the last fix and backward from the next one; each drifts by
    what its own calibration of the sensors lacks, and the smoother weights them by their
    predicted variances, so that the drift starts and ends at nothing.

    Parameters
    ----------
    elapsed : (n,) array
        Time since the last fix. Units: s.
    duration : float
        Units: s.
    accelerometer_bias : float
        One sigma of what calibration left. Units: m/s^2.
    """
    scale = np.array([1.0, 1.0, VERTICAL])
    remaining = duration - elapsed[::-1]
    forward = _dead_reckoning(elapsed, accelerometer_bias, rng)
    backward = _dead_reckoning(remaining, accelerometer_bias, rng)[::-1]
    forward_variance = _predicted_variance(elapsed, accelerometer_bias)[:, None]
    backward_variance = _predicted_variance(remaining, accelerometer_bias)[::-1, None]
    weight = backward_variance / (forward_variance + backward_variance)
    drift = weight * forward + (1 - weight) * backward
    return scale * drift, scale**2 * weight * forward_variance


def _dead_reckoning(elapsed, accelerometer_bias, rng):
    """Position error (n, 3): velocity error, and the accelerations' error integrated twice. m."""
    epochs = np.insert(elapsed, 0, 0.0)
    steps = np.sqrt(np.diff(epochs))[:, None] * rng.standard_normal((len(elapsed), 3))
    walk = VELOCITY_WALK * np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    bias = accelerometer_bias * rng.standard_normal(3)
    velocity = VELOCITY_ERROR * rng.standard_normal(3) + bias * epochs[:, None] + walk
    return cumulative_trapezoid(velocity, epochs, axis=0)


def _predicted_variance(elapsed, accelerometer_bias):
    """Variance (n,) of dead reckoning on one axis. Units: m^2."""
    return (
        (VELOCITY_ERROR * elapsed) ** 2
        + (accelerometer_bias * elapsed**2 / 2) ** 2
        + VELOCITY_WALK**2 * elapsed**3 / 3
    )


def slow_noise(elapsed, period, rng):
    """Noise (n, 3) of unit variance without waves shorter than a period (s).

    White noise at 1 Hz, filtered forward and backward as a smoother does.
    """
    margin = int(3 * period)
    seconds = np.arange(np.floor(elapsed[0]) - margin, elapsed[-1] + margin + 2)
    low_pass = butter(2, 1 / period, fs=1.0, output="sos")
    impulse = np.zeros(2 * margin + 1)
    impulse[margin] = 1.0
    gain = np.linalg.norm(sosfiltfilt(low_pass, impulse, padlen=0))
    noise = sosfiltfilt(low_pass, rng.standard_normal((len(seconds), 3)), axis=0, padlen=0)
    return CubicSpline(seconds, noise / gain)(elapsed)


def bounded_walk(elapsed, step, rng):
    """Random walk (n, 3) of unit variance between two bounds that throw it back.

    As an attitude held by gravity and GNSS wanders by the gyros' bias: evenly between its bounds.
    """
    bound = np.sqrt(3.0)  # of an even distribution of unit variance
    seconds = np.arange(np.floor(elapsed[0]) - 2, elapsed[-1] + 4)
    walk = step * np.cumsum(rng.standard_normal((len(seconds), 3)), axis=0)
    walk += rng.uniform(-bound, bound, 3)
    folded = np.abs(np.mod(walk - bound, 4 * bound) - 2 * bound) - bound
    return CubicSpline(seconds, folded)(elapsed)


def _gate(elapsed, spans):
    """1 inside the spans (start, duration), 0 outside, smooth at their edges: (n,)."""
    gate = np.zeros_like(elapsed)
    for start, duration in spans:
        depth = np.minimum(elapsed - start, start + duration - elapsed) / EDGE
        depth = np.clip(depth, 0.0, 1.0)
        gate = np.maximum(gate, depth**2 * (3 - 2 * depth))
    return gate
