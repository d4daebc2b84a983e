"""A painted road, any way round, that a line scanner crosses askew, there and back."""

from dataclasses import replace

import numpy as np

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import PointCloud, Trajectory
from tests.beds import tie_streets

ORIGIN = np.array([447_000.3, 5_410_000.6, 120.2])  # m
START = 413_200.25  # s
# m/s, m, m of the scanner above the road
SPEED = 8.0
LENGTH = 64.0
HEIGHT = 2.5
# scan lines a second, m between their points on the road
LINES = 80
STEP = 0.032
# m, of paint
WIDTH = 0.12
DASH = 3.0
GAP = 6.0
EDGE = 3.4  # m from the middle line to that along the edge
PAUSE = 60.0  # s between the passes
# intensities; one sigma of both, relative
DARK = 2_000.0
BRIGHT = 5_000.0
TEXTURE = 0.12


def turned(places, azimuth):
    "Places (n, 3) along the road, to its left and up as E, N, H; the road runs to an azimuth (deg)"
    along = np.sin(np.radians(azimuth))
    left = np.cos(np.radians(azimuth))
    axes = np.array([[along, left, 0.0], [-left, along, 0.0], [0.0, 0.0, 1.0]])
    return ORIGIN + places @ axes


def on_paint(x, y):
    "Flags of places, along and to the left of the middle line, that are painted"
    dashed = (np.abs(y) < WIDTH / 2) & (x % (DASH + GAP) < DASH)
    return dashed | (np.abs(y - EDGE) < WIDTH / 2)


def cloud(number, rng, azimuth=70.0, paint=on_paint, noise=0.004):
    "PointCloud of the road by pass number 0, 1, ...: lines 35 deg askew, points in their order"
    back = number % 2
    times = np.arange(0.0, LENGTH / SPEED, 1 / LINES)
    left = np.arange(-6.0, 6.0, STEP)
    left = (left[::-1] if back else left) + rng.uniform(0, STEP, (len(times), 1))
    lateral = 1.5 if back else -1.5
    ahead = np.tan(np.radians(35.0)) * (left - lateral)
    x = (LENGTH - SPEED * times if back else SPEED * times)[:, None] + ahead
    time = START + number * PAUSE + times[:, None] + np.linspace(0, 0.5 / LINES, left.shape[1])
    x = x.ravel()
    y = left.ravel()
    time = time.ravel()
    places = np.column_stack([x, y, rng.normal(0, noise, len(x))])
    level = np.where(paint(x, y), BRIGHT, DARK) * rng.normal(1.0, TEXTURE, len(x))
    return PointCloud(turned(places, azimuth), time, np.maximum(level, 0).astype(np.uint16))


def survey(azimuth=70.0, passes=2):
    "A Survey without files, a cloud for each pass"
    times = np.arange(0.0, LENGTH / SPEED + 0.02, 0.01)
    time = []
    place = []
    heading = []
    for number in range(passes):
        back = number % 2
        x = LENGTH - SPEED * times if back else SPEED * times
        y = np.full(len(x), 1.5 if back else -1.5)
        z = np.full(len(x), HEIGHT)
        time.append(START + number * PAUSE + times)
        place.append(turned(np.column_stack([x, y, z]), azimuth))
        heading.append(np.full(len(x), np.radians(azimuth + 180.0 * back)))
    zero = np.zeros(passes * len(times))
    attitude = attitude_from_angles(zero, zero, np.concatenate(heading))
    way = Trajectory(np.concatenate(time), np.concatenate(place), attitude)
    return replace(tie_streets.survey(passes), name="road", trajectory=way)


def features(azimuth=70.0, seed=1, shift=(0.0, 0.0, 0.0), passes=2):
    "TieFeatures of the road, its second pass displaced by a shift (m)"
    rng = np.random.default_rng(seed)
    parts = []
    for number in range(passes):
        part = cloud(number, rng, azimuth)
        moved = part.xyz + np.where(number == 1, 1.0, 0.0) * np.array(shift)
        parts.append(replace(part, xyz=moved))
    return tie_streets.collect(survey(azimuth, passes), parts)


def along_and_left(places, azimuth=70.0):
    "Places (n, 2) along the road and to the left of its middle line, of E, N, H"
    along = np.sin(np.radians(azimuth))
    left = np.cos(np.radians(azimuth))
    east, north, _ = (places - ORIGIN).T
    return np.column_stack([along * east + left * north, along * north - left * east])
