"""Displacement directions of items by errors of a vehicle and its scanner, for each view."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.gap.residuals import SETTINGS, Rows, covariates, poses_about, scanner_origin
from mlscorr.survey import Survey


@dataclass(frozen=True)
class Displacements:
    """Displacements of each view of each item: k, with two for a plane in an overlap.

    Parameters
    ----------
    item : (k,) int array
    sign : (k,) array
        Sign of its shift in the residual.
    directions : dict of (k, 3) arrays
        Displacement on the map by a unit (m, rad or s) of each error.
    covariates : dict of (k,) arrays
    xyz : (k, 3) array
        Units: m.
    """

    item: np.ndarray
    sign: np.ndarray
    directions: dict[str, np.ndarray]
    covariates: dict[str, np.ndarray]
    xyz: np.ndarray


def displacements(rows: Rows, survey: Survey) -> Displacements:
    """Compute displacements of the items behind the metric rows of a survey.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    """
    pulses = rows.pulses[np.isin(rows.pulses.item, rows.item[rows.metric])]
    known, number = np.unique(2 * pulses.item + (pulses.weight < 0), return_inverse=True)
    count = np.bincount(number)

    def mean(values):
        return np.column_stack([np.bincount(number, v) / count for v in values.T])

    time = mean(pulses.gps_time[:, None])[:, 0]
    xyz = mean(pulses.xyz)
    common = covariates(
        survey,
        time,
        xyz,
        replace(pulses, item=number),
        np.arange(len(known)),
        survey.trajectory.segment(time) + 1,
        np.zeros((len(known), 3)),
    )
    sign = np.where(known % 2, -1.0, 1.0)
    directions = _directions(survey, time, xyz)
    more = common | _motion(survey.trajectory, time)
    return Displacements(known // 2, sign, directions, more, xyz)


def _directions(survey, time, xyz):
    """Displacements (k, 3) by a unit in each direction."""
    pose, (before, after) = survey.trajectory.at(time), _about(survey.trajectory, time)
    right, forward, up = np.moveaxis(pose.attitude.as_matrix(), 2, 0)
    velocity = (after.position - before.position) / (after.gps_time - before.gps_time)[:, None]
    arm = xyz - pose.position
    sight = xyz - scanner_origin(survey, time)
    beam = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    unit = np.broadcast_to(np.eye(3)[:, None], (3, len(time), 3))
    moved = {
        **dict(zip(("east", "north", "height"), unit, strict=True)),
        "right": right,
        "forward": forward,
        "beam": beam,
        "roll": np.cross(forward, arm),
        "pitch": np.cross(right, arm),
        "yaw": np.cross(-up, arm),
        "clock": velocity + np.cross(_turning(before, after), arm),
    }
    if survey.mounting is not None:
        axis = pose.attitude.apply(survey.mounting.boresight.apply([0.0, 0.0, 1.0]))
        moved |= {"scan": np.cross(axis, sight), "across": axis}
    return moved


def _about(trajectory, time):
    """Poses before and after times (k,), with a longer step, because they give second
    differences.
    """
    return poses_about(trajectory, time, 2 * SETTINGS.motion_step)


def _turning(before, after):
    """Rates (k, 3) about map axes, rad/s."""
    turn = (after.attitude * before.attitude.inv()).as_rotvec()
    return turn / (after.gps_time - before.gps_time)[:, None]


def _motion(trajectory, time):
    """Further covariates: sines of roll and pitch, their rates (rad/s), acceleration (m/s^2),
    time in the pass.
    """
    start, end = trajectory.passes[trajectory.segment(time)].T
    before, after = _about(trajectory, time)
    now = trajectory.at((before.gps_time + after.gps_time) / 2)
    turn = now.attitude.inv().apply(_turning(before, after))
    span = after.gps_time - before.gps_time
    moved = after.position - 2 * now.position + before.position
    forward = now.attitude.apply([0.0, 1.0, 0.0])
    right, ahead, _ = np.moveaxis(trajectory.at(time).attitude.as_matrix(), 2, 0)
    return {
        "roll": right[:, 2],
        "pitch": ahead[:, 2],
        "roll_rate": turn[:, 1],
        "pitch_rate": turn[:, 0],
        "acceleration": 4 * np.einsum("ki,ki->k", moved, forward) / span**2,
        "elapsed": (time - start) / (end - start),
    }
