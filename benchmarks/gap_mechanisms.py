"""Effects at finite size, noise, and mechanisms outside the library, for synthetic surveys."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from mlscorr.effects import make_effect
from mlscorr.gap.evidence import SETTINGS, ErrorModel, Observations
from mlscorr.gap.signatures import Bench


class Outside:
    """Mechanisms outside the library: shifts (m,) of the rows by one unit of each."""

    names = (
        "lift with speed",
        "thermal range drift",
        "roll with turn rate",
        "mirror wobble",
        "cyclic range",
        "local subsidence",
        "attitude lag",
        "heading-dependent bias",
    )
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
        rows = g.rows
        trajectory = g.survey.trajectory
        item = rows.pulses.item
        key = np.argsort(item, kind="stable")
        self.g = g
        self.legs = []
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
        number = rng.integers(3)
        phase = rng.uniform(0, 2 * np.pi)
        for sign, has, pulses in self.legs:
            moved = self._moved(name, pulses, number, phase)
            along = np.einsum("mi,mi->m", self.g.rows.direction, moved)
            total += sign * has * along
        return total

    def _moved(self, name, pulses, number, phase):
        t = pulses.gps_time
        trajectory = self.trajectory
        mounting = self.g.survey.mounting
        pose = trajectory.at(t)
        start = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])[trajectory.segment(t)]
        early = np.maximum(t - 0.3, start)
        before = trajectory.at(early)
        after = trajectory.at(np.minimum(early + 0.6, t + 0.3))
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
    "time_offset",
    "clock_drift",
    "range_bias",
    "range_scale",
    "range_walk",
    "incidence_bias",
    "angle_scale",
    "angle_eccentricity",
    "heading_drift",
    "boresight",
    "lever_arm",
    "position_step",
    "position_bump",
    "map_rotation",
    "map_scale",
    "horizontal_datum",
    "vertical_datum",
    "target_outlier",
)
NOISES = {"range_noise": 0.004, "angle_noise": 0.02, "time_jitter": 1e-3, "position_noise": 0.04}


ACTUAL = ErrorModel(
    1.0, "matern32", 0.3, (1.0, "matern32", 0.3)
)  # nearest to the drift that is made here


def metric(g):
    """Function that returns the size of a shift (m,) in units of the minimal detectable bias."""
    observed = Observations.of(g.rows, g.background)
    whitener = observed.whitener(ACTUAL)

    def size(shift):
        square = whitener.whiten(observed.columns(shift[:, None])).squares[0]
        return float(np.sqrt(square)) / SETTINGS.detectable

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
        fixed = one.fixed
        shift = bench.change(one.effect(way)).shift
    return shift, way, fixed


def noisy(g, name, rng):
    """Changes by a random effect to the residuals and to the observed noise of points."""
    effect = make_effect(name, magnitude=NOISES[name])
    rows = g.rows
    zero = np.zeros(len(g.rows))
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
