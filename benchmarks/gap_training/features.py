"""Synthetic surveys at feature level: a drive there and back, and the view of a line scanner."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles, to_scanner
from mlscorr.gap.residuals import SETTINGS, Background, Rows, assemble, background, sample_pulses
from mlscorr.gap.residuals.rows import SamplePulses
from mlscorr.survey import ControlPoints, Mounting, Pos, Scanner, Survey, Trajectory

START = 413200.0
ORIGIN = np.array([523000.0, 3378000.0, 20.0])
STEP = 0.1  # s between epochs


def drive(rng: Generator, passes: int = 2, duration: float = 75.0) -> Trajectory:
    """Trajectory of a road driven there and back, with bends, hills and changing speed.

    Parameters
    ----------
    rng : Generator
    passes : int
    duration : float
        Of a pass. Units: s.
    """
    t = np.arange(0.0, duration, STEP)
    phase = rng.uniform(0, 2 * np.pi, 6)
    speed = 8 + 2.0 * np.sin(2 * np.pi * t / 40 + phase[0]) + np.sin(2 * np.pi * t / 17 + phase[1])
    parts = []
    road = rng.uniform(0, 2 * np.pi)
    way = np.cumsum(speed) * STEP
    for number in range(passes):
        if number % 2:
            speed = speed[::-1] + 0.7 * np.sin(2 * np.pi * t / 23 + phase[2])
            way_now = way[-1] - np.cumsum(speed) * STEP * way[-1] / (speed.sum() * STEP)
            side = -1.5
        else:
            way_now = way
            side = 1.5
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
    return Trajectory(time, position, attitude_from_angles(roll, pitch, heading))


def _sightings(survey, place):
    """Times at which the scan plane sweeps over places (k, 3), one per pass: index, time, pass."""
    trajectory = survey.trajectory
    sightings = []
    for number in range(len(trajectory.gaps) + 1):
        epochs = np.flatnonzero(trajectory.segment(trajectory.gps_time) == number)[::2]
        time = trajectory.gps_time[epochs]
        z = np.array(
            [
                to_scanner(trajectory, survey.mounting, np.repeat(p[None], len(time), 0), time)
                for p in place
            ]
        )
        near = np.linalg.norm(z, axis=2)
        cross = (z[:, :-1, 2] * z[:, 1:, 2] <= 0) & (near[:, :-1] < 60)
        for k in range(len(place)):
            hits = np.flatnonzero(cross[k])
            if len(hits):
                i = hits[np.argmin(near[k, hits])]
                a = z[k, i, 2]
                b = z[k, i + 1, 2]
                share = a / (a - b) if a != b else 0.0
                sightings.append((k, time[i] + share * (time[i + 1] - time[i]), number + 1))
    return (np.array(v) for v in zip(*sightings, strict=True))


@dataclass(frozen=True)
class Geometry:
    """A survey, its rows without errors, and quantities derived from them."""

    survey: Survey
    rows: Rows
    background: Background


def geometry(
    seed: int,
    targets: int = 40,
    patches: int = 200,
    passes: int = 2,
    rough: bool = True,
    shared: bool = False,
    duration: float = 75.0,
) -> Geometry:
    """A survey of features without residuals.

    Parameters
    ----------
    seed, targets, patches, passes : int
    rough : bool
        True to observe roughness and return rate.
    shared : bool
        True to compare patches between two passes, instead of with a reference.
    duration : float
        Of a pass. Units: s.
    """
    rng = np.random.default_rng(seed)
    trajectory = drive(rng, passes, duration)
    first = trajectory.segment(trajectory.gps_time) == 0
    path = trajectory.position[first]
    k = targets + patches
    base = path[np.linspace(40, len(path) - 60, k).astype(int)]
    base = base[rng.permutation(k)]
    ahead = np.roll(path, -1, axis=0) - path
    ahead = ahead[
        np.argmin(
            np.abs(path[:, None, 0] - base[None, :, 0])
            + np.abs(path[:, None, 1] - base[None, :, 1]),
            axis=0,
        )
    ]
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    side = rng.choice([-1.0, 1.0], k)
    away = rng.gamma(3.0, 2.5, k) + 3.0
    place = base + right * (side * away)[:, None]
    ground = rng.random(k) < 0.4
    place[:, 2] += np.where(ground, -2.0, rng.uniform(-1.0, 5.0, k))
    normal = np.where(ground[:, None], [0.0, 0.0, 1.0], -right * side[:, None])
    normal += 0.15 * rng.standard_normal((k, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    names = tuple(f"T{i + 1:02d}" for i in range(targets))
    control = ControlPoints(
        names,
        place[:targets],
        np.tile([0.005, 0.005, 0.007], (targets, 1)),
        ("circle",) * targets,
        np.full(targets, 0.6),
        normal[:targets],
    )
    none = ControlPoints((), np.zeros((0, 3)), np.zeros((0, 3)), (), np.zeros(0), np.zeros((0, 3)))
    arm = np.array([0.1, -0.6, 0.4])
    turn = Rotation.from_euler("ZX", [35.0, 90.0], degrees=True)
    survey = Survey(
        "study",
        Path("study"),
        None,
        (),
        trajectory,
        Mounting(arm, turn),
        control,
        none,
        Scanner(),
        Pos(0.02, np.radians([0.004, 0.004, 0.01]), 30.0),
    )
    which, time, pass_number = _sightings(survey, place)
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
        n = len(t)
        item = np.arange(len(t))
        direction = np.tile(np.eye(3), (n, 1))
        sigma = survey.control.sigma[which[t]]
        variance = np.tile([0.003**2, 0.003**2, 0.002**2], n)
        pulses = sample_pulses(
            survey, item, np.ones(n), place[which[t]], time[t], counts[which[t]], normal[which[t]]
        )
        parts.append(
            assemble(
                survey,
                "target",
                np.repeat(item, 3),
                np.repeat(time[t], 3),
                np.repeat(place[which[t]], 3, axis=0),
                direction,
                np.zeros(3 * n),
                variance,
                np.full(3 * n, 300),
                pulses,
                np.repeat(pass_number[t], 3),
                survey_item=np.repeat(which[t], 3),
                survey_factor=(sigma[:, :, None] * np.eye(3)).reshape(-1, 3),
            )
        )
    parts += _patch_parts(survey, place, normal, counts, which, time, pass_number, rough, shared)
    rows = Rows.concatenate(parts)
    return rows, background(rows, survey)


def _patch_parts(survey, place, normal, counts, which, time, pass_number, rough, shared):
    p = np.flatnonzero(which >= len(survey.control))
    if not len(p):
        return []
    pulses = sample_pulses(
        survey,
        np.arange(len(p)),
        np.ones(len(p)),
        place[which[p]],
        time[p],
        counts[which[p]],
        normal[which[p]],
    )
    variance = 0.002**2 + 0.005**2 / 80
    if shared:
        parts = [
            _shared_part(survey, place, normal, which[p], time[p], pass_number[p], pulses, variance)
        ]
    else:
        parts = []
    if shared:
        channels = []
    else:
        channels = [("surface", normal[which[p]], variance, None)]
    if rough:
        away = np.linalg.norm(pulses.scanner_xyz, axis=1)
        slant = pulses.incidence
        assumed = (survey.scanner.range_noise * slant) ** 2 + 1e-7
        assumed += (survey.scanner.angle_noise * away) ** 2 * (1 - slant**2) / 2
        none = np.zeros((len(p), 3))
        lost = SETTINGS.least_loss
        channels.append(("roughness", none, 2 / 77, assumed))
        channels.append(("return_rate", none, lost * (1 - lost) / 80, np.ones(len(p))))
    return parts + [
        assemble(
            survey,
            name,
            np.arange(len(p)),
            time[p],
            place[which[p]],
            direction,
            np.zeros(len(p)),
            np.full(len(p), spread),
            np.full(len(p), 80),
            pulses,
            pass_number[p],
            assumed=expected,
        )
        for name, direction, spread, expected in channels
    ]


def _shared_part(survey, place, normal, which, time, pass_number, pulses, variance):
    """Rows that compare the patches of both passes."""
    pairs = [np.flatnonzero(which == k) for k in np.unique(which)]
    first, second = np.array([pair[np.argsort(time[pair])] for pair in pairs if len(pair) == 2]).T
    item = np.arange(len(first))
    both = [
        replace(pulses[rows], item=item, weight=np.full(len(first), sign))
        for rows, sign in ((first, 1.0), (second, -1.0))
    ]
    return assemble(
        survey,
        "shared",
        item,
        time[first],
        place[which[first]],
        normal[which[first]],
        np.zeros(len(first)),
        np.full(len(first), 2 * variance),
        np.full(len(first), 80),
        SamplePulses.concatenate(both),
        pass_number[first],
        gps_time_2=time[second],
    )
