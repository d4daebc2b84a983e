"""How many lines a scanner drew in a second, by the directions of its beams over time."""

import numpy as np

from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import PointCloud, Trajectory


def line_rate(cloud: PointCloud, trajectory: Trajectory) -> float | None:
    """Turns a second of the beam about the vehicle's forward axis, where it turns evenly.

    The rate is that by which the angle of the beam, less what it turned, scatters least.

    Parameters
    ----------
    cloud : PointCloud
        A run of points with a pose, in any order.
    trajectory : Trajectory

    Returns
    -------
    float or None
        None where no rate stands out: a swinging mirror, several beams at once, a narrow view.
        Units: 1/s.
    """
    beams = sampled_beams(cloud, trajectory)
    if beams is None:
        return None
    time, place = beams
    rate = turning_rate(time, np.exp(1j * np.arctan2(place[:, 2], place[:, 0])))
    if rate is None:
        return None
    return abs(rate)


def sampled_beams(
    cloud: PointCloud, trajectory: Trajectory
) -> tuple[np.ndarray, np.ndarray] | None:
    """Times (n,) from the first on and places (n, 3) in body axes of some points of a run.

    Parameters
    ----------
    cloud : PointCloud
        In any order.
    trajectory : Trajectory

    Returns
    -------
    tuple of array, or None
        None where too few of them have a pose. Units: s, m.
    """
    some = cloud[np.abs(cloud.gps_time - np.median(cloud.gps_time)) < SETTINGS.turning_time / 2]
    some = some[:: max(1, len(some) // SETTINGS.turning_points)]
    some = some[trajectory.segment(some.gps_time) >= 0]
    if len(some) < 100:
        return None
    pose = trajectory.at(some.gps_time)
    place = pose.attitude.inv().apply(some.xyz - pose.position)
    return some.gps_time - some.gps_time[0], place


def turning_rate(time: np.ndarray, direction: np.ndarray) -> float | None:
    """Turns a second that leave of directions the least scatter, where they turn evenly.

    Parameters
    ----------
    time : (n,) array
        Units: s.
    direction : (n,) complex array
        Of length one.

    Returns
    -------
    float or None
        Negative where they turn clockwise. Units: 1/s.
    """
    length = float(np.ptp(time))
    if length < SETTINGS.turning_time / 10:
        return None
    step = 0.25 / length
    lowest, highest = SETTINGS.turning_rates
    rates = np.arange(lowest, highest, step)
    forward, backward = _evenness(rates, time, direction, direction.conj())
    rates = np.concatenate([-rates[::-1], rates])
    evenness = np.concatenate([backward[::-1], forward])
    best = int(np.argmax(evenness))
    others = np.abs(rates - rates[best]) > 2.0 / length
    near = rates[best] + np.linspace(-2, 2, 81) * step
    (finest,) = _evenness(near, time, direction)
    if 1.0 - finest.max() > SETTINGS.uneven_turn * (1.0 - evenness[others].max()):
        return None
    return float(near[np.argmax(finest)])


def _evenness(rates, time, *directions):
    """Length (d, k) of the mean of directions (n,) left by each rate: 1 where it explains all."""
    turns = (np.exp(-2j * np.pi * rate * time) for rate in rates)
    return np.array([[abs(np.mean(each * turn)) for each in directions] for turn in turns]).T
