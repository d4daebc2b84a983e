"""A street of walls, road and posts that a line scanner passes twice, there and back."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import CloudFile, PointCloud, Scanner, Survey, Trajectory

ORIGIN = np.array([447_000.3, 5_410_000.6, 120.2])  # m
START = 413_200.25  # s
# m/s, m, m of the scanner above the road
SPEED = 8.0
LENGTH = 32.0
HEIGHT = 2.5
WALL = 8.0  # m from the middle of the street to both facades
CROSS_WALLS = (9.35, 21.15)  # m along the street
POSTS = ((6.4, 5.55), (16.6, -5.45), (26.45, 5.55))  # m along and across
RADIUS = 0.06  # m, of posts
NOISE = 0.004  # m, one sigma of a range
LINES = 60  # a second
PAUSE = 60.0  # s between the passes


def trajectory(passes=2):
    "There along the street and back, 2 m to the right of its middle each time; x is along"
    time = []
    place = []
    heading = []
    seconds = np.arange(0.0, LENGTH / SPEED + 1e-9, 0.01)
    for number in range(passes):
        back = number % 2
        x = SPEED * seconds
        time.append(START + number * PAUSE + seconds)
        y = np.full(len(x), 2.0 if back else -2.0)
        place.append(np.column_stack([LENGTH - x if back else x, y, np.full(len(x), HEIGHT)]))
        heading.append(np.full(len(x), -np.pi / 2 if back else np.pi / 2))
    zero = np.zeros(passes * len(seconds))
    attitude = attitude_from_angles(zero, zero, np.concatenate(heading))
    return Trajectory(np.concatenate(time), ORIGIN + np.concatenate(place), attitude)


def survey(passes=2, length=None):
    "A Survey without files, a cloud for each pass"
    files = (CloudFile(Path(f"pass-{i + 1}.laz"), 1, 0.0, "week") for i in range(passes))
    return Survey(
        name="street",
        path=Path("survey.toml"),
        crs=None,
        clouds=tuple(files),
        trajectory=trajectory(passes),
        mounting=None,
        control=NO_POINTS,
        check=NO_POINTS,
        scanner=Scanner(range_noise=NOISE),
    )


def surfaces(rng, lateral):
    "Points (n, 3) of the street without noise, as many as a second pass would not hit again"
    n = 2500 * int(LENGTH / 4)
    along = rng.uniform(0, LENGTH, (3, n))
    road = np.column_stack([along[0], rng.uniform(-7.5, 7.5, n), np.zeros(n)])
    walls = [
        np.column_stack([x, np.full(n, side * WALL), rng.uniform(0, 6, n)])
        for x, side in zip(along[1:], (-1, 1), strict=True)
    ]
    m = n // 10
    cross = [
        np.column_stack([np.full(m, x), rng.uniform(5, 8, m), rng.uniform(0, 6, m)])
        for x in CROSS_WALLS
    ]
    return np.concatenate([road, *walls, *cross, *(post(p, lateral, rng) for p in POSTS)])


def post(foot, lateral, rng, n=700, radius=RADIUS, height=4.0):
    "Points (n, 3) on the half of a post that faces a scanner at some lateral place"
    side = rng.uniform(-1, 1, n)
    facing = np.sign(lateral - foot[1])
    x = foot[0] + radius * side
    y = foot[1] + facing * radius * np.sqrt(1 - side**2)
    return np.column_stack([x, y, rng.uniform(0.3, height, n)])


def scan(points, number, rng, noise=NOISE):
    "PointCloud of points that pass number 0, 1, ... measures: in lines, in order of their angle"
    back = number % 2
    lateral = 2.0 if back else -2.0
    x = LENGTH - points[:, 0] if back else points[:, 0]
    line = np.floor(np.clip(x / SPEED, 0, LENGTH / SPEED - 1e-6) * LINES)
    angle = np.arctan2(points[:, 1] - lateral, points[:, 2] - HEIGHT)
    order = np.lexsort([angle, line])
    points = points[order]
    line = line[order]
    angle = angle[order]
    time = START + number * PAUSE + (line + (angle + np.pi) / (2 * np.pi + 1e-3)) / LINES
    sight = points - np.column_stack(
        [points[:, 0], np.full(len(points), lateral), np.full(len(points), HEIGHT)]
    )
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    noisy = points + sight * rng.normal(0, noise, (len(points), 1))
    return PointCloud(ORIGIN + noisy, time, np.full(len(points), 100, np.uint16))


def clouds(seed=1, passes=2, car=None):
    "A PointCloud for each pass; a car (n, 3) stands there in the first and hides what is below"
    rng = np.random.default_rng(seed)
    parts = []
    for number in range(passes):
        points = surfaces(rng, 2.0 if number % 2 else -2.0)
        if number == 0 and car is not None:
            below = (points > car.min(axis=0) - [0, 0, 1]).all(axis=1)
            below &= (points < car.max(axis=0)).all(axis=1)
            points = np.concatenate([points[~below], car])
        parts.append(scan(points, number, rng))
    return parts


def collect(recorded, parts):
    "TieFeatures of clouds, one a file"
    collector = FeatureCollector(recorded)
    for file, cloud in zip(recorded.clouds, parts, strict=True):
        collector.add(file, cloud)
    return collector.features()


@cache
def features(seed=1, passes=2):
    "TieFeatures of the street"
    return collect(survey(passes), clouds(seed, passes))


def misplaced(street, shift=(0.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0)):
    """Features of which the second pass is off by a shift (m), all by a boresight (deg)

    and what was taken from each centre.
    """
    pose = trajectory(int(street.pass_number.max())).at(street.gps_time)
    turn = pose.attitude * Rotation.from_euler("xyz", angles, degrees=True) * pose.attitude.inv()
    centre = pose.position + turn.apply(street.centre - pose.position)
    centre += np.where(street.pass_number == 2, 1.0, 0.0)[:, None] * np.array(shift)
    wrong = replace(street, centre=centre, direction=turn.apply(street.direction))
    return wrong, street.centre - centre
