"""How well the diagnosis names effects, over many made-up surveys of features alone.

    OMP_NUM_THREADS=1 python benchmarks/gap_study.py [--cases 24] [--seed 1000]

Two opposite passes, 40 targets and 200 patches seen by a line scanner. The drift is made by sums
of sinusoids or by a random walk with bias instability through a crude smoother, survey and
extraction errors have heavier tails than assumed; nothing is drawn from the estimator's model.
Effects are applied at finite size. MDB is the minimal detectable bias of each effect there.
"""

import argparse
import pickle
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects import make_effect
from mlscorr.gap.assemble import assemble, sample_pulses
from mlscorr.gap.background import Setting, epochs
from mlscorr.gap.causes import cause_of
from mlscorr.gap.changes import Bench
from mlscorr.gap.rows import Pulses, Rows, background
from mlscorr.gap.separability import separability
from mlscorr.gap.signatures import signatures
from mlscorr.gap.verdict import best_lead, compare, pairs, verdict
from mlscorr.gap.whitening import whitener
from mlscorr.georeference import to_scanner
from mlscorr.survey import (
    ControlPoints,
    Mounting,
    Pos,
    Scanner,
    Survey,
    Trajectory,
    attitude_from_angles,
)

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
                Pulses.concatenate(both), pass_number[p][one], gps_time_2=time[p][two],
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


class Outside:
    """Mechanisms that no library knows: shifts (m,) of the rows by one unit of each."""

    names = (
        "lift with speed", "thermal range drift", "roll with turn rate", "mirror wobble",
        "cyclic range", "local subsidence", "attitude lag", "heading-dependent bias",
    )  # fmt: skip
    leads: ClassVar = {  # words of which one should be in the lead
        "lift with speed": ("height error", "speed"),
        "thermal range drift": ("range error", "time"),
        "roll with turn rate": ("roll error|right", "turn"),
        "mirror wobble": ("across|pitch|heading|along the drive", "turn of the scanner|scan angle"),
        "cyclic range": ("range error", "range"),
        "local subsidence": ("height error", "place|time"),
        "attitude lag": ("roll error|pitch error|heading error|right|along", "rate|acceleration"),
        "heading-dependent bias": ("easting|northing|right|along", "heading|pass|place|time"),
    }

    def __init__(self, g):
        rows, trajectory = g.rows, g.survey.trajectory
        item = rows.pulses.item
        key = np.argsort(item, kind="stable")
        self.g, self.legs = g, []
        for sign in (1.0, -1.0):
            mine = key[np.sign(rows.pulses.weight[key]) == sign]
            known = item[mine]
            place = np.clip(np.searchsorted(known, rows.item), 0, max(len(known) - 1, 0))
            if len(known):
                has = known[place] == rows.item
                self.legs.append((sign, has, rows.pulses[mine[place]]))
        self.trajectory = trajectory

    def shift(self, name, rng):
        total = np.zeros(len(self.g.rows))
        number, phase = rng.integers(3), rng.uniform(0, 2 * np.pi)
        for sign, has, pulses in self.legs:
            moved = self._moved(name, pulses, number, phase)
            along = np.einsum("mi,mi->m", self.g.rows.direction, moved)
            total += sign * has * along
        return total

    def _moved(self, name, pulses, number, phase):
        t, trajectory, mounting = pulses.gps_time, self.trajectory, self.g.survey.mounting
        pose = trajectory.at(t)
        start = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])[trajectory.segment(t)]
        early = np.maximum(t - 0.3, start)
        before, after = trajectory.at(early), trajectory.at(np.minimum(early + 0.6, t + 0.3))
        span = (after.gps_time - before.gps_time)[:, None]
        speed = np.linalg.norm(after.position - before.position, axis=1) / span[:, 0]
        turn = (after.attitude * before.attitude.inv()).as_rotvec() / span
        arm = pulses.xyz - pose.position
        beam = pulses.xyz - pose.position - pose.attitude.apply(mounting.lever_arm)
        away = np.linalg.norm(beam, axis=1, keepdims=True)
        beam = beam / away
        forward = pose.attitude.apply([0.0, 1.0, 0.0])
        up = np.array([0.0, 0.0, 1.0])
        angle = np.arctan2(pulses.scanner_xyz[:, 1], pulses.scanner_xyz[:, 0])[:, None]
        if name == "lift with speed":
            return up * (speed**2)[:, None] / 64
        if name == "thermal range drift":
            return beam * (1 - np.exp(-(t - trajectory.gps_time[0]) / 60))[:, None]
        if name == "roll with turn rate":
            return np.cross(forward, arm) * turn[:, 2:]
        if name == "mirror wobble":
            axis = pose.attitude.apply(mounting.boresight.apply([0.0, 0.0, 1.0]))
            return axis * away * np.sin((2 + number) * angle + phase)
        if name == "cyclic range":
            return beam * np.sin(2 * np.pi * away / (4.0 + 4 * number) + phase)
        if name == "local subsidence":
            centre = trajectory.position[len(trajectory.position) // 5 + number * 100]
            near = np.linalg.norm((pulses.xyz - centre)[:, :2], axis=1)
            return up * np.exp(-0.5 * (near / 40.0) ** 2)[:, None]
        if name == "attitude lag":
            return np.cross(turn, arm)
        heading = np.arctan2(forward[:, 0], forward[:, 1])
        return np.column_stack([np.cos(heading), np.sin(heading), 0 * heading])


STUDIED = (  # deterministic effects, named where the geometry shows them at all
    "time_offset", "clock_drift", "range_bias", "range_scale", "range_walk", "incidence_bias",
    "angle_scale", "angle_eccentricity", "heading_drift", "boresight", "lever_arm",
    "position_step", "position_bump", "map_rotation", "map_scale", "horizontal_datum",
    "vertical_datum", "target_outlier",
)  # fmt: skip
NOISES = {"range_noise": 0.004, "angle_noise": 0.02, "time_jitter": 1e-3, "position_noise": 0.04}


ACTUAL = Setting(1.0, "matern32", 0.3, 2.0)  # nearest to the drift that is made here


def metric(g):
    """Function that gives the size of a shift (m,) in units of the minimal detectable bias."""
    observed = epochs(g.rows, g.background)
    factor = whitener(observed, ACTUAL)

    def size(shift):
        return float(np.sqrt(factor.whiten(observed.columns(shift[:, None])).squares[0])) / 4.13

    return size


def sized(g, signs, name, m, rng, size):
    """Shift (m,) by an effect of m MDB, at finite size, and its parameters."""
    one = signs[rng.choice([i for i, s in enumerate(signs) if s.name == name])]
    way = rng.standard_normal(len(one.parameters)) * one.typical
    fixed = dict(one.fixed)
    for key, wide in (("time", 1.0), ("width", 0.3)):  # off the bank's grid
        if key in fixed and name == "position_bump":
            fixed[key] *= float(np.exp(0.02 * wide * rng.standard_normal()))
            fixed[key] = max(fixed[key], 1.5)
    way *= m / size(one.jacobian @ way)
    bench = Bench(g.rows, g.survey)
    try:
        shift = bench.change(replace(one, fixed=fixed).effect(way)).shift
    except ValueError:
        fixed, shift = one.fixed, bench.change(one.effect(way)).shift
    return shift, way, fixed


def noisy(g, name, rng):
    """What a random effect does to residuals and to the noise that the points show."""
    effect = make_effect(name, magnitude=NOISES[name])
    rows, zero = g.rows, np.zeros(len(g.rows))
    if name == "position_noise":
        thin = g.survey.trajectory
        moved = effect.apply(thin, rows.reference, rng).position - thin.position
        legs = [(rows.gps_time, rows.partials)]
        if rows.two_times.any():
            legs.append((np.where(rows.two_times, rows.gps_time_2, rows.gps_time), rows.partials_2))
        shift = sum(
            part[:, i] * np.interp(t, thin.gps_time, moved[:, i])
            for t, part in legs
            for i in range(3)
        )
        return shift, zero
    change = Bench(rows, g.survey).change(effect, rng)
    shift = np.sqrt(change.variance) * rng.standard_normal(len(rows)) + np.log1p(change.growth)
    return shift, change.variance


@dataclass(frozen=True)
class Bed:
    """A geometry with its signatures."""

    g: Geometry
    signs: tuple
    size: object
    separable: object

    @classmethod
    def of(cls, seed):
        g = geometry(seed, shared=bool(seed % 2))
        signs, _ = signatures(g.rows, g.survey)
        return cls(g, signs, metric(g), separability(epochs(g.rows, g.background), signs, ACTUAL))


def _rho(bed, told, label):
    """Squared correlation of the truth with the effect that was named; zero where unknown."""
    compared = bed.separable
    if len(told) != 1 or label not in compared.effects:
        return 0.0
    name, (way, _) = next(iter(told.items()))
    return compared.share(name, way, label) if name in compared.effects else 0.0


def _off(bed, rows, signs, found, told, name, m):
    """Error of a named cause: share of its signal, and of each parameter in sigmas."""
    cause = cause_of(rows, signs, found, name, 1.0)
    way, fixed = told
    part, estimate = cause.parts[0]
    if "target" in fixed and part.fixed != fixed:
        return None
    same = part.fixed == fixed
    difference = part.jacobian @ (estimate - way) if same else cause.shift - part.jacobian @ way
    z = [(p.estimate - t) / p.sigma for p, t in zip(cause.parameters, way, strict=False)]
    return bed.size(difference) / m, z


def case(bed, rng, kind, effects=(), m=3.0, withheld=None, outside=None, noise=None, replicas=0):
    """One survey, diagnosed: a dict of truth and answers."""
    g, rows = bed.g, bed.g.rows
    residual, told = errors(g, rng, kind), {}
    for name in effects:
        shift, way, fixed = sized(g, bed.signs, name, m, rng, bed.size)
        residual += shift
        told[name] = (way, fixed)
    if outside:
        shift = Outside(g).shift(outside, rng)
        residual += shift * m / bed.size(shift)
    if noise:
        shift, variance = noisy(g, noise, rng)
        residual += shift
        rows = replace(rows, noise=rows.noise + variance)
    rows = replace(rows, residual=residual)
    signs = tuple(s for s in bed.signs if s.name != withheld)
    found = compare(rows, g.background, g.survey, signs, rng, replicas)
    probability = pairs(rows, signs, found)
    answer = verdict(found, probability)
    truth = "+".join(effects) or outside or noise or "none"
    off = None
    if len(effects) == 1 and answer.label == truth:
        off = _off(bed, rows, signs, found, told[truth], truth, m)
    return {
        "truth": truth, "m": m, "kind": kind, "withheld": withheld, "told": told,
        "label": answer.label, "probability": probability, "set": answer.set,
        "p": answer.p_value, "lead": best_lead(found)[0],
        "score": {k: float(v[0]) for k, v in found.score.items()},
        "off": off, "rho": _rho(bed, told, answer.label),
        "same": {n: bed.separable.same(n, w if n in bed.separable.effects else None)
                 for n, (w, _) in told.items()},
    }  # fmt: skip


def jobs(cases, rng):
    """What is studied: keyword arguments of `case`, in cells."""
    cells = {"clean": [{"replicas": 50}] * (3 * cases)}
    cells["noise"] = [{"noise": n} for n in NOISES for _ in range(max(1, cases // 8))]
    for m in (2.0, 3.0, 5.0):
        cells[f"single {m:g} MDB"] = [{"effects": (n,), "m": m} for n in _cycle(rng, 2 * cases)]
    cells["withheld 4 MDB"] = [
        {"effects": (n,), "m": 4.0, "withheld": n} for n in _cycle(rng, 2 * cases)
    ]
    names = [Outside.names[i % len(Outside.names)] for i in range(cases)]
    cells["outside 4 MDB"] = [{"outside": n, "m": 4.0} for n in names]
    cells["pairs 4 MDB"] = [
        {"effects": tuple(str(n) for n in rng.choice(STUDIED, 2, replace=False)), "m": 4.0}
        for _ in range(cases)
    ]
    return cells


def _cycle(rng, number):
    names = [n for _ in range(number // len(STUDIED) + 1) for n in rng.permutation(STUDIED)]
    return [str(n) for n in names[:number]]


def run(cases, seed, beds=4, save=None):
    """All cells: lists of what `case` returns."""
    ground = [Bed.of(seed + i) for i in range(beds)]
    rng, results, count = np.random.default_rng(seed), {}, 0
    for cell, several in jobs(cases, rng).items():
        results[cell] = []
        for job in several:
            kind = ("sines", "walk")[count // beds % 2]
            chance = np.random.default_rng([seed, count])
            results[cell].append(case(ground[count % beds], chance, kind, **job))
            count += 1
        print(report(cell, results[cell]), flush=True)
        if save:
            Path(save).write_bytes(pickle.dumps(results))
    print(calibration(results))
    return results


def right(one):
    """Whether a label is the truth, or by class: what the geometry can't tell from it."""
    parts, truth = one["label"].split("+"), one["truth"].split("+")
    strict = sorted(parts) == sorted(truth)
    alike = len(parts) == len(truth) and all(
        any(p == t or p in one["same"].get(t, ()) for p in parts) for t in truth
    )
    return strict, alike


def report(cell, results):
    """One line of the table."""
    n, label = len(results), [one["label"] for one in results]
    size = np.mean([len(one["set"]) for one in results])
    if cell == "clean":
        claimed = [x for x in label if x not in ("none", *NOISES)]
        noise = [x for x in label if x in NOISES]
        low = np.mean([one["p"] < 0.05 for one in results])
        return (
            f"clean: {n} cases, a cause claimed on {_share(len(claimed), n)} {claimed}, noise on "
            f"{len(noise)}, p < 0.05 in {low:.0%}"
        )
    if cell.startswith("withheld"):
        good = sum(x in ("unknown", "none") or x.split("+")[0] in NOISES for x in label)
        unknown = sum(x == "unknown" for x in label)
        false = [
            (o["truth"], o["label"], round(o["rho"], 2))
            for o in results
            if o["label"] not in ("unknown", "none", *NOISES)
        ]
        far = sum(one[2] < 0.5 for one in false)
        return (
            f"{cell}: {n} cases, unknown or noise {_share(good, n)} (unknown {unknown}), another "
            f"named whose squared correlation is below 0.5 {_share(far, n)}; all {false}"
        )
    if cell.startswith("outside"):
        flagged = [o for o in results if o["label"] == "unknown"]
        led = [o for o in flagged if _led(o)]
        missed = [(o["truth"], o["label"]) for o in results if o["label"] != "unknown"]
        missed += [(o["truth"], o["lead"]) for o in flagged if not _led(o)]
        return (
            f"{cell}: {n} cases, unknown {_share(len(flagged), n)}, lead right {len(led)} of "
            f"{len(flagged)} {missed}"
        )
    hits = np.array([right(one) for one in results])
    held = sum(any(right({**one, "label": name})[1] for name in one["set"]) for one in results)
    wrong = [(o["truth"], o["label"]) for o, hit in zip(results, hits, strict=True) if not hit[1]]
    line = (
        f"{cell}: {n} cases, right {_share(hits[:, 0].sum(), n)}, by class "
        f"{_share(hits[:, 1].sum(), n)}, set holds it {_share(held, n)}, set size {size:.2f}"
    )
    off = [one["off"] for one in results if one.get("off")]
    if off:
        error, z = np.median([o[0] for o in off]), np.concatenate([o[1] for o in off])
        line += f", error {error:.0%}, 95 % interval holds {np.mean(np.abs(z) < 1.96):.0%}"
    return f"{line} {wrong}"


def _led(one):
    what, by = Outside.leads[one["truth"]]
    return any(w in one["lead"] for w in what.split("|")) and any(
        w in one["lead"] for w in by.split("|")
    )


def _share(k, n):
    """Share with its 95 % Wilson interval."""
    z, p = 1.96, k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return f"{p:.1%} [{max(middle - half, 0):.0%}, {min(middle + half, 1):.0%}]"


def calibration(results):
    """Stated probability of the label against how often it was right, over all cells."""
    stated, hit = [], []
    for cell, several in results.items():
        for one in several:
            if cell.startswith(("withheld", "outside")):
                good = one["label"] == "unknown"
            else:
                good = right(one)[1]
            stated.append(one["probability"][one["label"]])
            hit.append(good)
    stated, hit = np.array(stated), np.array(hit, dtype=float)
    bins = np.clip((stated * 5).astype(int), 0, 4)
    error, lines = 0.0, []
    for b in np.unique(bins):
        mine = bins == b
        error += abs(stated[mine].mean() - hit[mine].mean()) * mine.mean()
        lines.append(f"  stated {stated[mine].mean():.2f}, right {hit[mine].mean():.2f} of "
                     f"{mine.sum()}")  # fmt: skip
    return "\n".join([f"calibration error {error:.3f}", *lines])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--save", help="file for the results, pickled")
    given = parser.parse_args()
    run(given.cases, given.seed, save=given.save)


if __name__ == "__main__":
    main()
