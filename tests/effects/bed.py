"""A drive there and back, its pulses on targets, and small effects."""

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects import (
    EFFECTS,
    Reference,
    Returns,
    make_effect,
)
from mlscorr.effects._settings import SETTINGS
from mlscorr.frames import attitude_from_angles, georeference
from mlscorr.survey import ControlPoints, Mounting, Trajectory

START = 357_700.0  # s of the GPS week
CENTRE = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
PASSES = ((0.0, 60.0), (100.0, 160.0))  # s after START: there, and back
# in each pass, on each target
TARGETS = 8
BEAMS = 500
WALK_INTENSITY = 6553.5  # a tenth of the full scale
GRAZING = SETTINGS.grazing_cosine
AGREEMENT = 1e-3  # of the analytic mean shift; second order and rounding stay below 1e-4
SMALL = {  # magnitudes at which second order stays small
    "time_offset": {"magnitude": 1e-4},
    "clock_drift": {"magnitude": 1e-6},
    "time_jitter": {"magnitude": 1e-4},
    "boresight": {"magnitude": [0.004, -0.003, 0.006]},
    "lever_arm": {"magnitude": [0.02, -0.01, 0.03]},
    "range_bias": {"magnitude": 0.01},
    "range_scale": {"magnitude": 1e-4},
    "range_walk": {"magnitude": 0.005},
    "incidence_bias": {"magnitude": 0.003},
    "range_noise": {"magnitude": 0.005},
    "angle_scale": {"magnitude": 1e-5},
    "angle_eccentricity": {"magnitude": 1e-5, "phase": 0.4},
    "angle_noise": {"magnitude": 0.002},
    "heading_drift": {"magnitude": 0.005},
    "position_step": {"magnitude": [0.1, -0.2, 0.05], "time": 30.0},
    "position_bump": {"magnitude": [0.1, -0.2, 0.05], "time": 130.0, "width": 10.0},
    "position_noise": {"magnitude": 0.02},
    "vertical_datum": {"magnitude": 0.03},
    "horizontal_datum": {"magnitude": [0.05, -0.02]},
    "map_rotation": {"magnitude": 1e-5},
    "map_scale": {"magnitude": 1e-4},
    "target_outlier": {"magnitude": [0.05, 0.0, -0.1], "target": "T03"},
    "beam_divergence": {"magnitude": 0.35},
    "dropout": {"magnitude": 0.05},
}
NAMES = [kind.name for kind in EFFECTS]


def make_trajectory():
    "Two passes of a minute at 8 m/s on a curving way, opposite in direction, with a gap"
    elapsed = np.concatenate([np.arange(start, end + 1e-9, 0.01) for start, end in PASSES])
    back = elapsed > PASSES[1][0] - 1.0
    along = np.where(back, 8.0 * (PASSES[1][1] - elapsed), 8.0 * elapsed)
    course = 0.4 + 0.2 * np.sin(along / 60.0)
    position = np.empty((len(elapsed), 3))
    for one in (~back, back):
        step = np.diff(along[one], prepend=along[one][0])
        position[one, 0] = np.cumsum(step * np.sin(course[one]))
        position[one, 1] = np.cumsum(step * np.cos(course[one]))
        position[one, 2] = 0.5 * np.sin(along[one] / 90.0)
    position[back, :2] += 480.0 * np.array([np.sin(0.4), np.cos(0.4)])
    attitude = attitude_from_angles(
        np.radians(1.0) * np.sin(0.7 * elapsed),
        np.radians(2.0) * np.sin(0.3 * elapsed),
        course + np.where(back, np.pi, 0.0),
    )
    return Trajectory(START + elapsed, CENTRE + position, attitude)


def make_returns(rng):
    "Beams on small patches at several ranges, angles and incidences, in both passes, in time order"
    n = len(PASSES) * TARGETS
    when = np.concatenate([start + np.linspace(5, 55, TARGETS) for start, _ in PASSES])
    patch = np.repeat(np.arange(n), BEAMS)
    spread = np.sort(rng.uniform(-0.02, 0.02, (n, BEAMS)), axis=1).ravel()
    turn = np.linspace(-1.2, 1.3, TARGETS)[np.arange(n) % TARGETS]
    far = np.linspace(4.0, 25.0, TARGETS)[(np.arange(n) * 3) % TARGETS]
    return patch, Returns(
        gps_time=START + when[patch] + spread,
        angle=turn[patch] + rng.uniform(-0.05, 0.05, len(patch)),
        range=far[patch] + rng.uniform(-0.1, 0.1, len(patch)),
        intensity=rng.uniform(500.0, 3000.0, len(patch)),
        incidence=rng.uniform(0.3, 0.9, len(patch)),
        kept=np.ones(len(patch), dtype=bool),
    )


def make_control():
    rng = np.random.default_rng(4)
    place = rng.uniform([0, 0, -2], [200, 400, 6], (6, 3))
    normal = rng.standard_normal((6, 3))
    return ControlPoints(
        tuple(f"T{i + 1:02d}" for i in range(6)),
        CENTRE + place,
        np.full((6, 3), 0.003),
        ("circle", "square") * 3,
        np.full(6, 0.6),
        normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


TRAJECTORY = make_trajectory()
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
)
PATCH, RETURNS = make_returns(np.random.default_rng(3))
CONTROL = make_control()
REFERENCE = Reference(START, START + PASSES[1][1], CENTRE + np.array([100.0, 200.0, 0.0]))
VALUES = {
    "beam": 3e-4,
    **dict.fromkeys(("clock", "range", "angle", "return"), RETURNS),
    "pos": TRAJECTORY,
    "mounting": MOUNTING,
    "control": CONTROL,
}


def zero(name):
    "An effect with its magnitude at zero"
    small = SMALL[name]
    return make_effect(name, **{**small, "magnitude": np.multiply(small["magnitude"], 0.0)})


def applied(name, seed=0):
    "Value of the stage after a small effect"
    effect = make_effect(name, **SMALL[name])
    return effect.apply(VALUES[effect.stage], REFERENCE, np.random.default_rng(seed))


def beam(angle):
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])


def place(returns=RETURNS, trajectory=TRAJECTORY, mounting=MOUNTING):
    "Positions of the pulses on the map, by Eq. 1"
    scanner_xyz = returns.range[:, None] * beam(returns.angle)
    return georeference(trajectory, mounting, scanner_xyz, returns.gps_time)


def by_patch(values):
    "Mean over the beams on each patch"
    return np.add.reduceat(values, np.arange(0, len(values), BEAMS)) / BEAMS
