"""A winding drive, its errors, and points about it."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Mounting, PointCloud, Trajectory

START = 413_200.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM
MOUNTING = Mounting(np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], True))


def drive(step=0.005, length=20.0, gap=False):
    "A winding drive at 10 m/s, with a gap from 8 to 12 s if asked"
    elapsed = np.arange(0.0, length, step)
    if gap:
        elapsed = elapsed[(elapsed <= 8.0) | (elapsed >= 12.0)]
    wave = np.sin(elapsed[:, None] / [3.0, 5.0, 7.0])
    position = CORNER + np.outer(elapsed, [0.0, 10.0, 0.0]) + 2.0 * wave
    attitude = attitude_from_angles(*(np.array([0.02, 0.03, 0.5]) * wave).T)
    return Trajectory(START + elapsed, position, attitude)


def with_errors(trajectory):
    "Slow errors of decimetres and milliradians"
    wave = np.sin((trajectory.gps_time[:, None] - START) / [4.0, 6.0, 9.0] + 1.0)
    return replace(
        trajectory,
        position=trajectory.position + 0.3 * wave,
        attitude=Rotation.from_rotvec(2e-3 * wave) * trajectory.attitude,
    )


def cloud_of(trajectory, points=20_000):
    "Points up to 50 m around the drive, in no order of time"
    rng = np.random.default_rng(1)
    gps_time = rng.uniform(*trajectory.gps_time[[0, -1]], points)
    gps_time = gps_time[trajectory.segment(gps_time) >= 0]
    arm = rng.uniform(-50.0, 50.0, (len(gps_time), 3))
    return PointCloud(trajectory.at(gps_time).position + arm, gps_time, np.ones(len(gps_time)))
