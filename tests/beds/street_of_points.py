"""A street of points, its targets, and a correction that moves all by the same."""

import base64

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.survey import PointCloud, Trajectory

ORIGIN = np.array([532000.0, 3374000.0, 42.0])  # m
START = 357881.0  # s
SIZE = (240, 180)  # pixels, of a small picture


def street(points, rng, length=200.0):
    "Points of a street of 20 m width at UTM size, in time along it"
    along = np.sort(rng.uniform(0, length, points))
    xyz = ORIGIN + np.column_stack([along, rng.uniform(-10, 10, points), rng.uniform(0, 8, points)])
    return PointCloud(xyz, START + along / 5.0, rng.uniform(0, 1000, points))


def pieces(cloud, size):
    "A cloud in chunks of a size"
    for first in range(0, len(cloud), size):
        yield cloud[first : first + size]


def target(name, place, moved=(0.3, 0.0, 0.0), gps_time=START + 20.0, left_out=(np.nan,) * 3):
    "A row of a target that was scanned at a place and surveyed beside it"
    observed = np.array(place, float)
    before = np.array(moved, float)
    after = np.array([0.0, 0.0, 0.001])
    sigma = np.full(3, np.nan)
    left_out = np.array(left_out, float)
    vectors = (observed + before, observed, sigma, before, after, left_out)
    return TargetRow(name, 1, gps_time, "control", *vectors, True, None)


def shifted(shift, seconds=41.0):
    "A correction that moves all points by the same"
    times = START + np.arange(-1.0, seconds, 0.5)
    still = Rotation.identity(len(times))
    old = Trajectory(times, np.tile(ORIGIN, (len(times), 1)), still)
    return Correction(old, Trajectory(times, old.position + shift, still))


def unpacked(text, kind="<f4"):
    "An array of the 3D view"
    return np.frombuffer(base64.b64decode(text), kind)


def scattered(n, seed=1):
    "Places (n, 3) within 10 m on each axis"
    return ORIGIN + np.random.default_rng(seed).uniform(-10, 10, (n, 3))
