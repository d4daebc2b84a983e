"""Rotation rate and origin of a line scanner's beams, from its cloud only.

The points of a line scanner are in one plane of the vehicle, and their angle in it as seen from the
scanner increases linearly with time. From any other position it does not.
"""

from dataclasses import replace

import numpy as np

from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import CloudFile, PointCloud, Survey, Trajectory


def with_beam_origin(survey: Survey, file: CloudFile) -> Survey:
    """Return the survey of a file with the position of its scanner, if its beams show it.

    Parameters
    ----------
    survey : Survey
        Of one scanner; unchanged if its mounting is given.
    file : CloudFile
        Some runs of its points are read.
    """
    if survey.mounting is not None:
        return survey
    run = min(file.points, SETTINGS.rated_points)
    for share in SETTINGS.looked_shares:
        first = int(share * (file.points - run))
        chunks = list(read_chunks(file, first=first, end=first + run))
        if not chunks:
            continue
        origin = beam_origin(PointCloud.concatenate(chunks), survey.trajectory)
        if origin is not None:
            return replace(survey, beam_origin=origin)
    return survey


def beam_origin(cloud: PointCloud, trajectory: Trajectory) -> np.ndarray | None:
    """Origin of the beams of a uniformly rotating line scanner, in body axes.

    Parameters
    ----------
    cloud : PointCloud
        Run of points, in any order.
    trajectory : Trajectory

    Returns
    -------
    (3,) array or None
        Right, forward, up from the navigation center. None if the points are not in a plane, no
        rate is significant or the beams do not meet in a point: an oscillating mirror, several
        beams, or a narrow view. Units: m.
    """
    beams = sampled_beams(cloud, trajectory)
    if beams is None:
        return None
    try:
        return _origin(*beams)
    except np.linalg.LinAlgError:  # beams of one direction
        return None


def _origin(time, place):
    """Origin (3,) of beams that ended at positions (n, 3) in body axes, or None. m."""
    axes = np.linalg.svd(place - place.mean(axis=0), full_matrices=False)[2]
    across = place @ axes[2]
    offset = float(np.median(across))
    if np.median(np.abs(across - offset)) > SETTINGS.beam_scatter:
        return None
    in_plane = place @ axes[:2].T
    rate = turning_rate(time, np.exp(1j * np.arctan2(in_plane[:, 1], in_plane[:, 0])))
    if rate is None:
        return None
    middle = _meeting_point(time, in_plane, 2 * np.pi * rate)
    if middle is None:
        return None
    return middle @ axes[:2] + offset * axes[2]


def _meeting_point(time, place, rate):
    """Point (2,) from which positions (n, 2) appear at an angle that increases linearly. m.

    Least squares of the distances of the beams from it, with the rate (rad/s) and the angle at time
    zero; distant beams, such as of moving objects, have less weight.
    """
    phase = np.arctan2(place[:, 1], place[:, 0]) - rate * time
    state = np.array([0.0, 0.0, np.angle(np.mean(np.exp(1j * phase))), rate])
    for _ in range(SETTINGS.beam_rounds):
        angle = state[2] + state[3] * time
        beam = np.column_stack([np.cos(angle), np.sin(angle)])
        away = place - state[:2]
        distance = beam[:, 0] * away[:, 1] - beam[:, 1] * away[:, 0]
        along = np.sum(beam * away, axis=1)
        scatter = 1.48 * float(np.median(np.abs(distance)))  # of normal errors: one sigma
        scatter = max(scatter, 1e-6)
        weight = 1.0 / (1.0 + (distance / (3.0 * scatter)) ** 2)
        design = np.column_stack([beam[:, 1], -beam[:, 0], -along, -along * time])
        normal = design.T @ (weight[:, None] * design)
        step = np.linalg.solve(normal, -design.T @ (weight * distance))
        state += step
    sigma = scatter * np.sqrt(np.linalg.inv(normal)[[0, 1], [0, 1]].max())
    is_found = max(scatter, sigma, np.abs(step[:2]).max()) < SETTINGS.beam_scatter
    if is_found:
        return state[:2]
    return None


def line_rate(cloud: PointCloud, trajectory: Trajectory) -> float | None:
    """Rotations per second of the beam about the vehicle's forward axis, if it is uniform.

    It is the rate that minimizes the scatter of the beam's angle minus its rotation.

    Parameters
    ----------
    cloud : PointCloud
        Run of points with a pose, in any order.
    trajectory : Trajectory

    Returns
    -------
    float or None
        None if no rate is significant: an oscillating mirror, several beams, or a narrow view.
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
    """Times (n,) from the first one and positions (n, 3) in body axes of some points of a run.

    Parameters
    ----------
    cloud : PointCloud
        In any order.
    trajectory : Trajectory

    Returns
    -------
    tuple of array, or None
        None if too few of them have a pose. Units: s, m.
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
    """Rotations per second that minimize the scatter of directions, if they rotate uniformly.

    Parameters
    ----------
    time : (n,) array
        Units: s.
    direction : (n,) complex array
        Of length one.

    Returns
    -------
    float or None
        Negative for clockwise rotation. Units: 1/s.
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
    """Length (d, k) of the mean of directions (n,) after removal of each rate: 1 if it explains
    all.
    """
    turns = (np.exp(-2j * np.pi * rate * time) for rate in rates)
    return np.array([[abs(np.mean(each * turn)) for each in directions] for turn in turns]).T
