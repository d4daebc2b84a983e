"""A pass that was recorded metres off, and the correction that puts it back."""

from dataclasses import replace

import numpy as np

from mlscorr.correction import Correction


def displaced(survey, patches, shift):
    "Patches with the first pass off by a shift (3,) in m, and a Correction known to 1 cm"
    first = patches.pass_number == 1
    off = replace(
        patches,
        centre=patches.centre + first[:, None] * shift,
        xyz=patches.xyz + first[:, None, None] * shift,
    )
    return off, correction_of(survey, shift)


def correction_of(survey, shift):
    "The Correction, known to 1 cm, of a first pass that is off by a shift (3,) in m"
    trajectory = survey.trajectory
    pose = np.zeros((len(trajectory), 6))
    pose[trajectory.segment(trajectory.gps_time) == 0, :3] = -np.asarray(shift)
    covariance = np.tile(np.diag([1e-4] * 3 + [1e-12] * 3), (len(pose), 1, 1))
    return Correction.by_pose_error(trajectory, pose, covariance)
