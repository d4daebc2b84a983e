"""Each look at each item: which way the errors of a vehicle and its scanner would move it, when."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.gap.covariates import covariates, scanner_origin

RATE = 0.5  # s to each side, over which rates and acceleration are taken


@dataclass(frozen=True)
class Looks:
    """Each look at each item: (k,) row in its arrays; two for a plane that was seen twice."""

    item: np.ndarray
    sign: np.ndarray
    directions: dict[str, np.ndarray]  # displacement (k, 3) on the map of one unit: m, rad or s
    covariates: dict[str, np.ndarray]
    xyz: np.ndarray


def looks(rows, survey):
    """The looks behind the metric rows of a survey."""
    pulses = rows.pulses[np.isin(rows.pulses.item, rows.item[rows.metric])]
    key = 2 * pulses.item + (pulses.weight < 0)
    known, number = np.unique(key, return_inverse=True)
    count = np.bincount(number)

    def mean(values):
        return np.column_stack([np.bincount(number, v) / count for v in values.T])

    time, xyz = mean(pulses.gps_time[:, None])[:, 0], mean(pulses.xyz)
    told = covariates(
        survey, time, xyz, replace(pulses, item=number), np.arange(len(known)),
        survey.trajectory.segment(time) + 1, np.zeros((len(known), 3)),
    )  # fmt: skip
    return Looks(
        known // 2,
        np.where(known % 2, -1.0, 1.0),
        _directions(survey, time, xyz),
        told | _motion(survey.trajectory, time),
        xyz,
    )


def _directions(survey, time, xyz):
    """Displacements (k, 3) by a unit in each direction."""
    pose, (before, after) = survey.trajectory.at(time), _about(survey.trajectory, time)
    right, forward, up = np.moveaxis(pose.attitude.as_matrix(), 2, 0)
    arm, sight = xyz - pose.position, xyz - scanner_origin(survey, time)
    beam = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    unit = np.broadcast_to(np.eye(3)[:, None], (3, len(time), 3))
    found = {
        "east": unit[0],
        "north": unit[1],
        "height": unit[2],
        "right": right,
        "forward": forward,
        "beam": beam,
        "roll": np.cross(forward, arm),
        "pitch": np.cross(right, arm),
        "yaw": np.cross(-up, arm),
        "clock": _velocity(before, after) + np.cross(_turning(before, after), arm),
    }
    if survey.mounting is not None:
        axis = pose.attitude.apply(survey.mounting.boresight.apply([0.0, 0.0, 1.0]))
        found |= {"scan": np.cross(axis, sight), "across": axis}
    return found


def _about(trajectory, time):
    """Poses shortly before and after times (k,), within their passes."""
    starts, ends = _passes(trajectory)
    segment = trajectory.segment(time)
    early, late = np.maximum(time - RATE, starts[segment]), np.minimum(time + RATE, ends[segment])
    return trajectory.at(early), trajectory.at(late)


def _passes(trajectory):
    """First and last times of the passes."""
    starts = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])
    return starts, np.append(trajectory.gaps[:, 0], trajectory.gps_time[-1])


def _velocity(before, after):
    """(k, 3), m/s."""
    return (after.position - before.position) / (after.gps_time - before.gps_time)[:, None]


def _turning(before, after):
    """Rates (k, 3) about map axes, rad/s."""
    turn = (after.attitude * before.attitude.inv()).as_rotvec()
    return turn / (after.gps_time - before.gps_time)[:, None]


def _motion(trajectory, time):
    """Further covariates: roll and pitch rate (rad/s), acceleration (m/s^2), time in the pass."""
    starts, ends = _passes(trajectory)
    segment = trajectory.segment(time)
    before, after = _about(trajectory, time)
    now = trajectory.at((before.gps_time + after.gps_time) / 2)
    turn = now.attitude.inv().apply(_turning(before, after))
    span = after.gps_time - before.gps_time
    moved = after.position - 2 * now.position + before.position
    forward = now.attitude.apply([0.0, 1.0, 0.0])
    return {
        "roll_rate": turn[:, 1],
        "pitch_rate": turn[:, 0],
        "acceleration": 4 * np.einsum("ki,ki->k", moved, forward) / span**2,
        "elapsed": (time - starts[segment]) / (ends - starts)[segment],
    }
