"""Made-up surveys of features: a drive there and back, what a line scanner sees, and its errors.

The drift is made by sums of sinusoids or by a random walk with bias instability through a crude
smoother, survey and extraction errors have heavier tails than assumed; nothing is drawn from the
estimator's model.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles, to_scanner
from mlscorr.gap.observe.assemble import assemble, sample_pulses
from mlscorr.gap.observe.rows import Rows, SamplePulses, background
from mlscorr.survey import ControlPoints, Mounting, Pos, Scanner, Survey, Trajectory

START, ORIGIN = 413200.0, np.array([523000.0, 3378000.0, 20.0])
STEP = 0.1  # s between epochs
RANGE_NOISE, ANGLE_NOISE = 0.005, np.radians(0.002)


def drive(rng, passes=2, duration=75.0):
    """Trajectory of a road driven there and back, with bends, hills and changing speed."""
    t = np.arange(0.0, duration, STEP)
    phase = rng.uniform(0, 2 * np.pi, 6)
    speed = 8 + 2.0 * np.sin(2 * np.pi * t / 40 + phase[0]) + np.sin(2 * np.pi * t / 17 + phase[1])
    parts, road = [], rng.uniform(0, 2 * np.pi)
    way = np.cumsum(speed) * STEP
    for number in range(passes):
        if number % 2:
            speed = speed[::-1] + 0.7 * np.sin(2 * np.pi * t / 23 + phase[2])
            way_now = way[-1] - np.cumsum(speed) * STEP * way[-1] / (speed.sum() * STEP)
            side = -1.5
        else:
            way_now, side = way, 1.5
        bend = 12 * np.sin(way_now / 60 + phase[3]) + 4 * np.sin(way_now / 23 + phase[4])
        slope = 0.2 * np.cos(way_now / 60 + phase[3]) + 4 / 23 * np.cos(way_now / 23 + phase[4])
        across = np.column_stack([-slope, np.ones_like(slope)]) / np.hypot(1, slope)[:, None]
        plane = np.column_stack([way_now, bend]) - side * across * (-1 if number % 2 else 1)
        turn = np.array([[np.cos(road), -np.sin(road)], [np.sin(road), np.cos(road)]])
        plane = plane @ turn.T
        height = 1.0 * np.sin(way_now / 90 + phase[5]) + 2.0
        xyz = np.column_stack([plane, height])
        velocity = np.gradient(xyz, STEP, axis=0)
        heading = np.arctan2(velocity[:, 0], velocity[:, 1])
        pitch = np.arctan2(velocity[:, 2], np.hypot(*velocity[:, :2].T))
        pitch += 0.004 * np.sin(2 * np.pi * t / 5 + phase[0])
        roll = 0.01 * np.sin(2 * np.pi * t / 7 + phase[1]) + 0.02 * np.gradient(
            np.unwrap(heading), STEP
        )
        time = START + number * (duration + 60.0) + t
        parts.append((time, xyz + ORIGIN, np.unwrap(heading), pitch, roll))
    time, position, heading, pitch, roll = (np.concatenate(p) for p in zip(*parts, strict=True))
    attitude = attitude_from_angles(roll, pitch, heading)
    return Trajectory(time, position, attitude)


def seen_at(survey, place):
    """Times at which the scan plane sweeps over places (k, 3), one a pass: index, time, pass."""
    trajectory, found = survey.trajectory, []
    for number in range(len(trajectory.gaps) + 1):
        epochs = np.flatnonzero(trajectory.segment(trajectory.gps_time) == number)[::2]
        time = trajectory.gps_time[epochs]
        z = np.array(
            [to_scanner(trajectory, survey.mounting, np.repeat(p[None], len(time), 0), time)
             for p in place]
        )  # fmt: skip
        near = np.linalg.norm(z, axis=2)
        cross = (z[:, :-1, 2] * z[:, 1:, 2] <= 0) & (near[:, :-1] < 60)
        for k in range(len(place)):
            hits = np.flatnonzero(cross[k])
            if len(hits):
                i = hits[np.argmin(near[k, hits])]
                a, b = z[k, i, 2], z[k, i + 1, 2]
                share = a / (a - b) if a != b else 0.0
                found.append((k, time[i] + share * (time[i + 1] - time[i]), number + 1))
    return (np.array(v) for v in zip(*found, strict=True))


@dataclass(frozen=True)
class Geometry:
    """A survey, its rows without errors, and what is made of them."""

    survey: Survey
    rows: Rows
    background: object


def geometry(seed, targets=40, patches=200, passes=2, rough=True, shared=False):
    """A survey of features; the residuals are zero."""
    rng = np.random.default_rng(seed)
    trajectory = drive(rng, passes)
    first = trajectory.segment(trajectory.gps_time) == 0
    path = trajectory.position[first]
    k = targets + patches
    base = path[np.linspace(40, len(path) - 60, k).astype(int)]
    base = base[rng.permutation(k)]
    ahead = np.roll(path, -1, axis=0) - path
    ahead = ahead[np.argmin(np.abs(path[:, None, 0] - base[None, :, 0])
                            + np.abs(path[:, None, 1] - base[None, :, 1]), axis=0)]  # fmt: skip
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    side, away = rng.choice([-1.0, 1.0], k), rng.gamma(3.0, 2.5, k) + 3.0
    place = base + right * (side * away)[:, None]
    ground = rng.random(k) < 0.4
    place[:, 2] += np.where(ground, -2.0, rng.uniform(-1.0, 5.0, k))
    normal = np.where(ground[:, None], [0.0, 0.0, 1.0], -right * side[:, None])
    normal += 0.15 * rng.standard_normal((k, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    names = tuple(f"T{i + 1:02d}" for i in range(targets))
    control = ControlPoints(
        names, place[:targets], np.tile([0.005, 0.005, 0.007], (targets, 1)),
        ("circle",) * targets, np.full(targets, 0.6), normal[:targets],
    )  # fmt: skip
    none = ControlPoints((), np.zeros((0, 3)), np.zeros((0, 3)), (), np.zeros(0), np.zeros((0, 3)))
    arm = np.array([0.1, -0.6, 0.4])
    turn = Rotation.from_euler("ZX", [35.0, 90.0], degrees=True)
    survey = Survey(
        "study", Path("study"), None, (), trajectory, Mounting(arm, turn), control, none,
        Scanner(RANGE_NOISE, ANGLE_NOISE, 100.0),
        Pos(0.02, np.radians([0.004, 0.004, 0.01]), 30.0),
    )  # fmt: skip
    which, time, pass_number = seen_at(survey, place)
    counts = 10 ** rng.uniform(3.0, 4.6, k)
    return Geometry(
        survey, *_rows(survey, place, normal, counts, which, time, pass_number, rough, shared)
    )


def _rows(survey, place, normal, counts, which, time, pass_number, rough, shared):
    targets = len(survey.control)
    is_target = which < targets
    parts = []
    t = np.flatnonzero(is_target)
    if len(t):
        n, item = len(t), np.arange(len(t))
        direction = np.tile(np.eye(3), (n, 1))
        sigma = survey.control.sigma[which[t]]
        variance = np.tile([0.003**2, 0.003**2, 0.002**2], n)
        pulses = sample_pulses(
            survey, item, np.ones(n), place[which[t]], time[t], counts[which[t]], normal[which[t]]
        )
        parts.append(
            assemble(
                survey, "target", np.repeat(item, 3), np.repeat(time[t], 3),
                np.repeat(place[which[t]], 3, axis=0), direction, np.zeros(3 * n), variance,
                np.full(3 * n, 300), pulses, np.repeat(pass_number[t], 3),
                survey_item=np.repeat(which[t], 3),
                survey_factor=(sigma[:, :, None] * np.eye(3)).reshape(-1, 3),
            )
        )  # fmt: skip
    parts += _patch_parts(survey, place, normal, counts, which, time, pass_number, rough, shared)
    rows = Rows.concatenate(parts)
    return rows, background(rows, survey)


def _patch_parts(survey, place, normal, counts, which, time, pass_number, rough, shared):
    p = np.flatnonzero(which >= len(survey.control))
    if not len(p):
        return []
    pulses = sample_pulses(
        survey, np.arange(len(p)), np.ones(len(p)), place[which[p]], time[p], counts[which[p]],
        normal[which[p]],
    )  # fmt: skip
    variance, parts = 0.002**2 + 0.005**2 / 80, []
    if shared:
        pairs = [np.flatnonzero(which[p] == k) for k in np.unique(which[p])]
        one, two = np.array([pair[np.argsort(time[p][pair])] for pair in pairs if len(pair) == 2]).T
        item = np.arange(len(one))
        both = [
            replace(pulses[some], item=item, weight=np.full(len(one), sign))
            for some, sign in ((one, 1.0), (two, -1.0))
        ]
        parts.append(
            assemble(
                survey, "shared", item, time[p][one], place[which[p][one]], normal[which[p][one]],
                np.zeros(len(one)), np.full(len(one), 2 * variance), np.full(len(one), 80),
                SamplePulses.concatenate(both), pass_number[p][one], gps_time_2=time[p][two],
            )
        )  # fmt: skip
    common = (np.arange(len(p)), time[p], place[which[p]])
    points = np.full(len(p), 80)
    if not shared:
        parts.append(
            assemble(
                survey, "surface", *common, normal[which[p]], np.zeros(len(p)),
                np.full(len(p), variance), points, pulses, pass_number[p],
            )
        )  # fmt: skip
    if rough:
        away, slant = np.linalg.norm(pulses.scanner_xyz, axis=1), pulses.incidence
        believed = (RANGE_NOISE * slant) ** 2 + 1e-7
        believed += (ANGLE_NOISE * away) ** 2 * (1 - slant**2) / 2
        parts.append(
            assemble(
                survey, "roughness", *common, np.zeros((len(p), 3)), np.zeros(len(p)),
                np.full(len(p), 2 / 77), points, pulses, pass_number[p], believed=believed,
            )
        )  # fmt: skip
    return parts


def process(rng, time, kind):
    """A drift (n,) of unit rms that no covariance of the estimator describes."""
    t = time - time.min()
    if kind == "sines":
        periods = np.exp(rng.uniform(np.log(8.0), np.log(250.0), 5))
        phases, sizes = rng.uniform(0, 2 * np.pi, 5), rng.standard_normal(5)
        return np.sqrt(2 / 5) * np.sin(2 * np.pi * t[:, None] / periods + phases) @ sizes
    grid = np.arange(0.0, t.max() + 1.0, 1.0)
    walk = np.cumsum(rng.standard_normal(len(grid)))  # velocity noise, in
    flicker = sum(np.repeat(rng.standard_normal(len(grid) // k + 1), k)[: len(grid)]
                  for k in (4, 16, 64))  # fmt: skip
    walk = walk / 6 + flicker
    for fixes in (10, 25):  # a crude smoother: GNSS every so often pulls it back
        fit = np.interp(grid, grid[::fixes], walk[::fixes])
        walk = walk - 0.6 * fit
    walk = np.convolve(walk, np.ones(5) / 5, mode="same")
    return np.interp(t, grid, walk / np.sqrt(np.mean(walk**2)))


def errors(g, rng, kind="sines", noise=True):
    """Residuals (m,) of a survey in which no effect acts."""
    rows, m = g.rows, len(g.rows)
    scale = np.exp(0.2 * rng.standard_normal())
    time = np.append(rows.gps_time, np.where(rows.two_times, rows.gps_time_2, rows.gps_time))
    order = np.argsort(time)
    pose = np.empty((2 * m, 6))
    for i in range(6):
        pose[order, i] = process(rng, time[order], kind)
    sigma = np.append(np.full(3, g.survey.pos.position_sigma), g.survey.pos.attitude_sigma)
    pose *= scale * sigma
    residual = np.einsum("mi,mi->m", rows.partials, pose[:m])
    residual += np.einsum("mi,mi->m", rows.partials_2, pose[m:])
    k = len(rows.targets)
    survey = rng.standard_t(5, 3 * k) * np.sqrt(3 / 5)
    residual += rows.survey_design() @ survey
    own = rng.standard_t(5, m) * np.sqrt(3 / 5) * np.sqrt(rows.noise)
    rough = rows.channel == "roughness"
    own[rough] = np.log(rng.chisquare(77, rough.sum()) / 77) + 1 / 77
    own[rough] += 0.1 * rng.standard_normal(rough.sum())
    return residual + own
