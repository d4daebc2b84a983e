"""A small line scanner that scans one target among clutter, for tests and studies.

It shares nothing with the package: each pulse is seven rays across its footprint, their hits form
its echo, and range, angle and intensity are noisy.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import PointCloud, Scanner
from mlscorr.targets import ScannerPath

ORIGIN = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
START = 413_200.0  # s
SCANNER = Scanner(range_noise=0.004, angle_noise=np.radians(0.002), lines_per_second=100.0)
DIVERGENCE = 0.35e-3  # rad, 1/e^2 diameter: four sigmas
LINES = 0.05  # m between scan lines
SPEED = 5.0  # m/s
SPECKLE = 0.1
UP = np.array([0.0, 0.0, 1.0])
FOOTPRINT = [(0.0, 0.0, 0.28)] + [  # sigmas across, and weight
    (1.4 * np.cos(a), 1.4 * np.sin(a), 0.12) for a in np.arange(6) * np.pi / 3
]
DARK = 0.06
WHITE = 0.9


@dataclass(frozen=True)
class Surface:
    "A flat piece: center (3,), axes u, v (2, 3), and reflectance of (u, v), NaN outside of it"

    centre: np.ndarray
    axes: np.ndarray
    paint: object


@dataclass(frozen=True)
class View:
    "One piece of cloud, the path of the scanner, and the truth"

    cloud: PointCloud
    path: ScannerPath
    centre: np.ndarray
    gps_time: float
    on_target: int


def disc(size, inner=0.0, bright=WHITE):
    def paint(u, v):
        r = 2 * np.hypot(u, v) / size
        return np.where(r > 1, np.nan, np.where(r < inner, DARK, bright))

    return paint


def plate(width, height=None, bright=WHITE):
    height = width if height is None else height
    return lambda u, v: np.where((np.abs(u) < width / 2) & (np.abs(v) < height / 2), bright, np.nan)


def checkerboard(size):
    def paint(u, v):
        colour = np.where(u * v > 0, WHITE, DARK)
        return np.where(np.maximum(np.abs(u), np.abs(v)) < size / 2, colour, np.nan)

    return paint


def holed(size):
    def paint(u, v):
        inside = np.maximum(np.abs(u), np.abs(v)) < size
        return np.where(inside & (np.hypot(u, v) > size / 2), 0.4, np.nan)

    return paint


TARGETS = {  # look -> kind and surfaces' paints from the front
    "disc": ("circle", lambda s: [disc(s), plate(1.5 * s, bright=DARK)]),
    "ring": ("circle", lambda s: [disc(s, 0.5), plate(1.5 * s, bright=DARK)]),
    "painted disc": ("circle", lambda s: [disc(s), plate(12.0, bright=0.18)]),
    "retro disc": ("circle", lambda s: [disc(1.1 * s, bright=60.0), plate(1.5 * s, bright=DARK)]),
    "plate": ("square", lambda s: [plate(s)]),
    "hole": ("hole", lambda s: [holed(s)]),
    "checkerboard": ("checkerboard", lambda s: [checkerboard(s)]),
    "board": ("board", lambda s: [plate(s, bright=0.3)]),
}


def view(look, size, rng, incidence=70.0, hidden=0.4, clutter=True, away=(3.0, 20.0), step=None):
    "A View of a target 3-20 m off, up to an incidence (deg) and an occluded share"
    distance = rng.uniform(*away)
    if look == "painted disc":
        low = -0.05
    else:
        low = rng.uniform(-0.25, 0.25)
    sight = np.array([np.sqrt(1 - low**2), 0.0, low])
    tilt = np.radians(rng.uniform(0, incidence))
    about = rng.uniform(0, 2 * np.pi)
    side = np.cos(about) * np.array([0, 1.0, 0]) + np.sin(about) * np.cross(sight, [0, 1.0, 0])
    normal = -np.cos(tilt) * sight + np.sin(tilt) * side
    u = np.cross(normal, rng.standard_normal(3))
    u /= np.linalg.norm(u)
    axes = np.array([u, np.cross(normal, u)])
    centre = distance * sight
    surfaces = [
        Surface(centre - 2e-4 * i * normal, axes, paint)
        for i, paint in enumerate(TARGETS[look][1](size))
    ]
    surfaces += _surroundings(look, size, centre, sight, hidden, clutter, rng)
    if step is None:
        step = np.exp(rng.uniform(np.log(0.6e-3), np.log(2.0e-3)))
    return _scan(surfaces, centre, sight, size, step, rng, len(TARGETS[look][1](size)))


def _surroundings(look, size, centre, sight, hidden, clutter, rng):
    "Ground, at times a wall behind, a post in front, and bright things of other shapes beside"
    upright = np.array([[0.0, 1.0, 0.0], UP])
    below = min(centre[2] - 1.2 * size - 0.4, -1.5)  # the scanner stands above it, at 0
    ground = Surface(np.array([centre[0], 0.0, below]), np.eye(3)[:2], plate(30.0, bright=0.15))
    surfaces = [] if look == "painted disc" else [ground]
    if look != "painted disc" and (look == "hole" or rng.random() < 0.5):
        behind = centre + rng.uniform(1.0, 2.5) * size * sight + 0.3 * sight
        surfaces.append(Surface(behind, upright, plate(30.0, bright=0.3)))
    if hidden and rng.random() < 0.5:
        wide = rng.uniform(0, hidden) * size
        edge = rng.choice([-1, 1]) * (size / 2 - wide / 2) * upright[0]
        before = centre - rng.uniform(0.3, 1.0) * sight + edge
        surfaces.append(Surface(before, upright, plate(wide, 4.0, bright=rng.choice([0.2, 0.8]))))
    if clutter:
        beside = centre + rng.choice([-1, 1]) * rng.uniform(1.4, 2.0) * size * upright[0]
        beside = beside - 0.3 * sight
        wide, high = rng.choice([(0.3, 4.0), (0.55, 1.4), (1.5, 0.4)]) * np.array([size, size])
        surfaces.append(Surface(beside, upright, plate(wide, high, bright=WHITE)))
    return surfaces


def _scan(surfaces, centre, sight, size, step, rng, own):
    "Echoes of the pulses about the target"
    reach = 2.5 * size + 0.3
    distance = np.linalg.norm(centre)
    lines = np.arange(-reach, reach, LINES) + rng.uniform(0, LINES)
    pitch = np.arctan2(sight[2], sight[0])
    angles = np.arange(pitch - reach / distance, pitch + reach / distance, step)
    y, angle = (a.ravel() for a in np.meshgrid(lines, angles, indexing="ij"))
    angle = angle + np.repeat(rng.uniform(0, step, len(lines)), len(angles))
    period = LINES / SPEED
    time = np.round((y - lines[0]) / LINES) * period + (angle - pitch) / step * 1e-6 + 0.01
    start = np.outer(y, [0.0, 1.0, 0.0])
    true = angle + SCANNER.angle_noise * rng.standard_normal(len(angle))
    yaw = SCANNER.angle_noise * rng.standard_normal(len(angle))
    weights = []
    ranges = []
    values = []
    hits = []
    for across, along, weight in FOOTPRINT:
        sigma = DIVERGENCE / 4
        hit = _cast(surfaces, start, _beam(true + sigma * across, yaw + sigma * along))
        weights.append(np.full(len(angle), weight))
        for store, value in zip((ranges, values, hits), hit, strict=True):
            store.append(value)
    measured, strength, hit = _echo(*map(np.array, (weights, ranges, values, hits)))
    seen = np.isfinite(measured)
    measured = measured + SCANNER.range_noise * rng.standard_normal(len(measured))
    strength = strength * (1 + SPECKLE * rng.standard_normal(len(strength)))
    counts = np.round(np.clip(12_000 * strength, 1, 65_535))
    beam = _beam(angle, 0 * yaw)
    xyz = start + measured[:, None] * beam
    near = seen & (np.linalg.norm(xyz - centre, axis=1) < 3.0)
    order = np.flatnonzero(near)[np.argsort(time[near], kind="stable")]
    cloud = PointCloud(np.round(xyz[order] + ORIGIN, 3), START + time[order], counts[order])
    line_time = START + np.arange(len(lines)) * period + 0.01
    path = ScannerPath(line_time, np.outer(lines, [0.0, 1.0, 0.0]) + ORIGIN)
    middle = (0.0 - lines[0]) / LINES * period + 0.01
    return View(
        cloud,
        path,
        centre + ORIGIN,
        START + middle,
        int((hit[order] < own - (own > 1)).sum()),
    )


def _beam(angle, yaw):
    level = np.cos(angle)
    return np.column_stack([level * np.cos(yaw), level * np.sin(yaw), np.sin(angle)])


def _cast(surfaces, start, beam):
    "Range, reflectance times cosine, and index of the surface that each ray hits first"
    nearest = np.full(len(beam), np.inf)
    value = np.zeros(len(beam))
    number = np.full(len(beam), 99)
    for i, surface in enumerate(surfaces):
        normal = np.cross(*surface.axes)
        cosine = beam @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = ((surface.centre - start) @ normal) / cosine
        places = start + np.where(np.isfinite(distance), distance, 0.0)[:, None] * beam
        u, v = ((places - surface.centre) @ surface.axes.T).T
        paint = surface.paint(u, v)
        hit = (distance > 0.1) & (distance < nearest) & np.isfinite(paint)
        nearest = np.where(hit, distance, nearest)
        value = np.where(hit, paint * np.abs(cosine), value)
        number = np.where(hit, i, number)
    return nearest, value, number


def _echo(weight, ranges, values, hits):
    "Range, intensity and surface of the first echo with a third of the footprint, else the last"
    first = ranges.min(axis=0)
    one = ranges < first + 0.15
    weak = (weight * one).sum(axis=0) < 0.33
    later = np.where(one, np.inf, ranges).min(axis=0)
    one = np.where(weak & np.isfinite(later), (ranges >= later) & (ranges < later + 0.15), one)
    one &= np.isfinite(ranges)
    share = (weight * one).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (weight * np.where(one, ranges, 0.0)).sum(axis=0) / share
    return mean, (weight * one * values).sum(axis=0), np.where(one[0], hits[0], 99)
