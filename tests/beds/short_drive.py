"""A short simulated drive past four targets, with one effect each time."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import CloudFile, PointCloud, Scanner, Survey, TargetObservations

SEED = 5

EXACT = {  # with which the simulator is run; sizes are usual ones
    "time_offset": {"magnitude": 1e-3},
    "clock_drift": {"magnitude": 2e-5},
    "range_bias": {"magnitude": 0.01},
    "range_walk": {"magnitude": 0.005},
    "incidence_bias": {"magnitude": 0.003},
    "angle_scale": {"magnitude": 1e-4},
    "angle_eccentricity": {"magnitude": 1e-4, "phase": 0.7},
    "boresight": {"magnitude": [0.03, -0.05, 0.04]},
    "lever_arm": {"magnitude": [0.02, -0.03, 0.01]},
    "heading_drift": {"magnitude": 0.03},
    "position_step": {"magnitude": [0.1, -0.05, 0.03], "time": 2.0},
    "position_bump": {"magnitude": [0.1, -0.05, 0.03], "time": 25.0, "width": 2.0},
    "map_rotation": {"magnitude": 1e-4},
    "map_scale": {"magnitude": 4e-4},
    "target_outlier": {"magnitude": [0.05, 0.02, -0.01], "target": "T02"},
}

NOISE = {
    "range_noise": {"magnitude": 0.006},
    "angle_noise": {"magnitude": 0.03},
    "time_jitter": {"magnitude": 0.002},
    "dropout": {"magnitude": 0.1},
}

SIZES = {**EXACT, **NOISE}


def scenario(effects=()):
    "Two passes of five seconds, there and back, past four targets"
    return Scenario(
        drive={
            "duration": 5.0,
            "speed": 6.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 3, "check": 1, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        effects=effects,
    )


@cache
def run(name=None):
    "A simulated survey with one effect, all its points, and the target that each lies on"
    if name is None:
        effects = ()
    else:
        effects = ({"name": name, **SIZES[name]},)
    simulated = simulate(scenario(effects), np.random.default_rng(SEED))
    blocks = list(simulated.blocks())
    target = np.concatenate([simulated.scene.target[b.pulses.triangle] for b in blocks])
    return simulated, PointCloud.concatenate([b.cloud for b in blocks]), target


def survey_of(simulated):
    "Recorded data as a Survey without files"
    targets = simulated.targets
    is_check = simulated.is_check

    def some(rows):
        rows = np.flatnonzero(rows)
        return replace(
            targets,
            name=tuple(targets.name[i] for i in rows),
            kind=tuple(targets.kind[i] for i in rows),
            **{k: getattr(targets, k)[rows] for k in ("position", "sigma", "size", "normal")},
        )

    return Survey(
        name="simulated",
        path=Path("simulated"),
        crs=None,
        clouds=(CloudFile(Path("pass.laz"), 0, 0.0, "week"),),
        trajectory=simulated.trajectory,
        mounting=simulated.mounting,
        control=some(~is_check),
        check=some(is_check),
        scanner=Scanner(range_noise=0.004),
    )


def observations(simulated, cloud, target):
    "Ideal observations, the mean of all points of a target and pass, and the rows of these points"
    number = 1 + simulated.trajectory.segment(cloud.gps_time)
    found = []
    for i in range(len(simulated.targets)):
        apart = np.linalg.norm(cloud.xyz - simulated.true_centre[i], axis=1)
        for one in np.unique(number):
            # the disc or plate alone: circles stand on a board that is larger
            rows = np.flatnonzero((target == i) & (number == one) & (apart < 0.28))
            if len(rows) >= 12:
                found.append((i, one, rows))
    which = [i for i, _, _ in found]
    matched = TargetObservations(
        name=tuple(simulated.targets.name[i] for i in which),
        pass_number=np.array([one for _, one, _ in found]),
        gps_time=np.array([cloud.gps_time[rows].mean() for _, _, rows in found]),
        position=np.array([cloud.xyz[rows].mean(axis=0) for _, _, rows in found]),
        covariance=np.tile(1e-6 * np.eye(3), (len(found), 1, 1)),
        normal=simulated.targets.normal[which],
        kind=tuple(simulated.targets.kind[i] for i in which),
        size=simulated.targets.size[which],
        points=np.array([len(rows) for _, _, rows in found]),
    )
    return matched, [rows for _, _, rows in found]


def in_simulation(clean, name):
    "Change of the target rows when the full simulator has the effect"
    _, rows, cloud, points = clean
    simulated, changed, _ = run(name)
    assert len(changed) == len(cloud)
    shift = np.array([(changed.xyz[of] - cloud.xyz[of]).mean(axis=0) for of in points])
    now = survey_of(simulated)
    shift = np.repeat(shift, 3, axis=0)
    moved = now.surveyed.position - rows.targets.position
    return np.einsum("mi,mi->m", rows.direction, shift - moved[rows.survey_item])
