"""Simulated surveys at feature level: target centers with noise instead of rays and extraction.

The drive, the scene, the POS with its errors and sigmas, the mounting and the surveyor are the
simulator's; a target is observed when the scan plane passes over its center. Thus hundreds of
surveys take minutes, and only the estimate is measured.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.evaluate import misclosures
from mlscorr.frames import georeference, to_scanner
from mlscorr.simulate import DEMO, read_scenario, simulate
from mlscorr.simulate.scenario import DriveScenario, PosScenario
from mlscorr.survey import ControlPoints, Matched, TargetObservations, Trajectory

EXTRACTION = 0.004  # m, one sigma of a target's center, as extraction reaches it
REACH = 40.0  # m, beyond which no target is extracted
RATE = 10.0  # Hz of the trajectory; the POS's errors change more slowly
FOLDER = Path(__file__).parents[1] / "examples" / "scenarios"


@dataclass(frozen=True)
class FeatureSurvey:
    """Input of an estimate, and the truth: true trajectory, true centers of check points."""

    true: Trajectory
    recorded: Trajectory
    control: ControlPoints
    observations: TargetObservations
    check: ControlPoints
    checked: TargetObservations

    def check_rmse(self, correction):
        """RMSE (3,) of the check points after a correction. Units: m."""
        return np.sqrt(np.mean(misclosures(self.matched_check, correction) ** 2, axis=0))

    @property
    def matched(self):
        """The observed control points."""
        return Matched.by_name(self.observations, self.control)

    @property
    def matched_check(self):
        """The observed check points."""
        return Matched.by_name(self.checked, self.check)

    def position_left(self, correction):
        """Residual position error (n, 3) after a correction, true - corrected. Units: m."""
        return self.true.position - correction.corrected.position

    def keep(self, names):
        """The survey with only some of its control points."""
        rows = [name in names for name in self.observations.name]
        return replace(self, observations=self.observations[np.array(rows)])

    def spoil(self, share, rng, adjacent=False):
        """The survey with gross errors of 0.1 to 1 m, and the names of those control points.

        Adjacent ones follow each other in time and are wrong by the same vector.
        """
        seen = list(dict.fromkeys(self.observations.name))
        count = max(1, round(share * len(seen)))
        if adjacent:
            first = rng.integers(len(seen) - count + 1)
            names = seen[first : first + count]
        else:
            names = list(rng.choice(seen, count, replace=False))
        size = rng.uniform(0.1, 1.0, (1 if adjacent else count, 1))
        vector = rng.normal(size=(len(size), 3))
        vector *= size / np.linalg.norm(vector, axis=1, keepdims=True)
        position = self.control.position.copy()
        position[self.control.rows(names)] += vector
        return replace(self, control=replace(self.control, position=position)), set(names)


def scenarios():
    """Scenarios by name: the examples, the demo, and drives with outages of two POS grades."""
    names = ("boat", "canyon", "motorway", "calibration", "car")
    found = {name: read_scenario(FOLDER / f"{name}.toml") for name in names}
    canyons = found["boat"].pos.model_copy(update={"canyons": ((45.0, 15.0), (105.0, 12.0))})
    found["boat_canyons"] = found["boat"].model_copy(update={"pos": canyons})
    found["demo"] = DEMO
    spans = {"outages": ((60.0, 40.0), (150.0, 50.0)), "canyons": ((20.0, 25.0),)}
    for grade in ("mems", "tactical"):
        changed = {
            "pos": PosScenario(grade=grade, **spans),
            "drive": DriveScenario(duration=240.0, speed=8.0),
        }
        found[grade] = found["motorway"].model_copy(update=changed)
    return found


def feature_survey(scenario, seed, rate=RATE):
    """FeatureSurvey of a scenario, at a trajectory rate in Hz; None keeps the recorded rate."""
    simulated = simulate(scenario, np.random.default_rng(seed))
    rng = np.random.default_rng([seed, 1])
    pairs = list(zip(simulated.true_passes, simulated.passes, strict=True))
    parts = [_observe(simulated, *pair, number, rng) for number, pair in enumerate(pairs, 1)]
    target, number, gps_time, position = (np.concatenate(part) for part in zip(*parts, strict=True))
    targets = simulated.targets
    n = len(target)
    observations = TargetObservations(
        tuple(targets.name[i] for i in target),
        number,
        gps_time,
        position,
        np.tile(EXTRACTION**2 * np.eye(3), (n, 1, 1)),
        targets.normal[target],
        tuple(targets.kind[i] for i in target),
        targets.size[target],
        np.full(n, 300),
    )
    is_check = simulated.is_check
    return FeatureSurvey(
        Trajectory.concatenate([_thinned(true, rate) for true, _ in pairs]),
        Trajectory.concatenate([_thinned(recorded, rate) for _, recorded in pairs]),
        _points(targets, np.flatnonzero(~is_check), targets.position),
        observations[~is_check[target]],
        _points(targets, np.flatnonzero(is_check), simulated.true_centre),
        observations[is_check[target]],
    )


def _observe(simulated, true, recorded, number, rng):
    """Targets, pass number, times and observed centers in one pass."""
    coarse = true.gps_time[::10]
    found = []
    mounting = simulated.true_mountings[0]
    stated = simulated.mountings[0]
    for i, centre in enumerate(simulated.true_centre):
        local = to_scanner(true, mounting, np.tile(centre, (len(coarse), 1)), coarse)
        across = local[:, 2]
        near = np.linalg.norm(local, axis=1)
        passed = np.flatnonzero((across[:-1] * across[1:] <= 0) & (near[:-1] < REACH))
        if len(passed):
            k = passed[np.argmin(near[passed])]
            share = across[k] / (across[k] - across[k + 1])
            time = np.array([coarse[k] + share * (coarse[k + 1] - coarse[k])])
            beam = to_scanner(true, mounting, centre[None], time)
            observed = georeference(recorded, stated, beam, time)[0]
            found.append((i, time[0], observed + EXTRACTION * rng.normal(size=3)))
    target, time, observed = zip(*found, strict=True)
    return np.array(target), np.full(len(target), number), np.array(time), np.array(observed)


def _thinned(trajectory, rate):
    if rate is None:
        return trajectory
    step = max(round(1.0 / rate / np.median(np.diff(trajectory.gps_time))), 1)
    rows = np.unique(np.append(np.arange(0, len(trajectory), step), len(trajectory) - 1))
    stated = (trajectory.position_sigma, trajectory.attitude_sigma)
    sigmas = (None if sigma is None else sigma[rows] for sigma in stated)
    at = trajectory.gps_time[rows], trajectory.position[rows], trajectory.attitude[rows]
    return Trajectory(*at, *sigmas)


def _points(targets, rows, position):
    return ControlPoints(
        tuple(targets.name[i] for i in rows),
        position[rows],
        targets.sigma[rows],
        tuple(targets.kind[i] for i in rows),
        targets.size[rows],
        targets.normal[rows],
    )
