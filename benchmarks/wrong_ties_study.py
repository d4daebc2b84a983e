"""Effect of wrong ties on a correction, through files: a street that changed between passes.

    python benchmarks/wrong_ties_study.py [--seeds 3] [--first 0] [--control 4] [--cases NAME ...]

A street is scanned there and back as it is (``clean``), and again with changes between the passes:
``fifth`` (half of the stretches of facades 0.1 to 1 m aside or shifted by a window, cars gone
elsewhere), ``window`` (three whole stretches of facades shifted by a window), ``lorry`` (three hid
the facades in the first pass), ``rebuilt`` (other houses, cars, trees and lamps along the same
road) and ``parallel`` (the way back is another street, 25 m aside). Printed are the RMS (m) of the
whole trajectory by control alone and with ties, the number of ties used, how many of these are
truly wrong by more than 5 sigmas, the share of such among all pairs within the widest gate about
the true places, and the largest truly wrong misclosure of a used tie (m).
"""

import argparse
import tempfile
import warnings
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from ties_files_study import rms, scenario

import mlscorr
from mlscorr.frames import georeference, to_scanner
from mlscorr.simulate import SimulatedSurvey, simulate
from mlscorr.simulate.scan import Surfaces
from mlscorr.simulate.scene import Mesh, build_scene, section
from mlscorr.survey import Trajectory
from mlscorr.ties import SETTINGS, pair_features

DURATION = 40.0  # s of each pass
WINDOW = 2.6  # m: a bay of the simulator's facades
STRETCH = 4.0  # m of a facade that goes aside as a whole
NEAR_TARGET = 4.0  # m: what is nearer stays, so that control is the same in all cases
LORRY = 12.0, 2.4, 4.0  # m: length, distance of its side from the middle of the way, height
PARALLEL = np.array([25.0, 0.0, 0.4])  # m to the right, forward, up


@dataclass(frozen=True)
class ChangedSurvey(SimulatedSurvey):
    """A SimulatedSurvey with a street that changed between the passes.

    ``move`` is a function of pass (0, 1), points (n, 3) about the origin, where they truly were,
    and the scanner's places, which returns by how much they are moved (n, 3); ``later`` the mesh
    that the second pass met, if another one, and for each of its triangles the scene's own (the
    first for what is no target). Units: m.
    """

    move: Any = None
    later: Any = None

    def _blocks_of(self, file, number, k, **size):
        survey = self
        if self.later is not None and number == 1:
            survey = replace(self, later=None)
            survey.__dict__["surfaces"] = Surfaces(self.later[0])  # as a cached property keeps it
        for block in super(ChangedSurvey, survey)._blocks_of(file, number, k, **size):
            cloud = block.cloud
            pulses = block.pulses
            if self.move is not None:
                origin = np.array(self.scenario.origin)
                pose = self.true_trajectory.at(cloud.gps_time)
                place = pose.position + pose.attitude.apply(self.true_mountings[k].lever_arm)
                moved = self.move(number, pulses.point - origin, place - origin)
                cloud = replace(cloud, xyz=cloud.xyz + moved)
            if survey is not self:
                pulses = replace(pulses, triangle=self.later[1][pulses.triangle])
            yield replace(block, cloud=cloud, pulses=pulses)


class Street:
    """Coordinates of points along a simulated street, and its occlusions and shifts."""

    def __init__(self, survey, rng):
        self.line = survey.scene.centre_line
        self.targets = survey.scene.targets.centre
        lengths, tree = self.line._samples
        self._lengths = lengths
        self._tree = tree
        way = section(survey.scenario.drive, lengths[-1])
        self.kerb = way.road
        self.front = way.road + way.pavement
        self.stretches = rng.random(2000) < 0.5
        self.aside = rng.choice([-1.0, 1.0], 2000) * rng.uniform(0.1, 1.0, 2000)
        self.is_window = rng.random(2000) < 0.5
        drive = survey.true_passes[0].position - np.array(survey.scenario.origin)
        middle = lengths[tree.query(drive[:, :2])[1]]
        self.places = np.quantile(middle, [0.25, 0.5, 0.75])

    def local(self, points):
        """Length along the way, distance to the right, height (n,), and unit vectors (n, 3)."""
        s = self._lengths[self._tree.query(points[:, :2])[1]]
        place, forward, right = self.line.frame(s)
        way = points - place
        along = np.einsum("ni,ni->n", way, forward)
        return s + along, np.einsum("ni,ni->n", way, right), way[:, 2], forward, right

    def free(self, points):
        """Mask of points (n,) far from all targets."""
        away = np.linalg.norm(points[:, None] - self.targets, axis=2)
        return away.min(axis=1) > NEAR_TARGET

    def fifth(self, number, points, scanner):
        """Shift parts of facades aside or along by a window, and move cars, in the second pass."""
        s, lateral, height, forward, right = self.local(points)
        block = np.floor(s / STRETCH).astype(int) * 2 + (lateral > 0) + 500
        is_front = (np.abs(lateral) > self.front - 0.3) & (height > 0.5) & self.stretches[block]
        is_car = (np.abs(np.abs(lateral) - self.kerb) < 1.2) & (np.abs(height - 1.0) < 0.7)
        by_window = self.is_window[block]
        aside = self.aside[block]
        along = np.where(is_car | by_window, np.where(is_car, 3.0 * aside, WINDOW), 0.0)
        across = np.where(is_front & ~by_window, aside, 0.0)
        moved = along[:, None] * forward + across[:, None] * right
        return np.where(
            ((is_front | is_car) & self.free(points) & (number == 1))[:, None], moved, 0
        )

    def window(self, number, points, scanner):
        """Shift three 30 m pieces of facades along by a window in the second pass."""
        s, lateral, height, forward, _ = self.local(points)
        here = (np.abs(s[:, None] - self.places) < 15.0).any(axis=1)
        here &= (np.abs(lateral) > self.front - 0.3) & (height > 0.5) & self.free(points)
        return np.where((here & (number == 1))[:, None], WINDOW * forward, 0.0)

    def lorry(self, number, points, scanner):
        """Put trucks on the right in the first pass, which the beams meet before facades."""
        length, beside, height = LORRY
        s, lateral, up, _, _ = self.local(points)
        from_s, from_lateral, from_up, _, _ = self.local(scanner)
        share = (beside - from_lateral) / np.where(lateral > beside, lateral - from_lateral, 1.0)
        at = from_s + share * (s - from_s)
        z = from_up + share * (up - from_up)
        here = (np.abs(at[:, None] - self.places) < length / 2).any(axis=1)
        here &= (lateral > beside) & (z > 0.3) & (z < height) & (number == 0)
        return np.where(here[:, None], (share - 1.0)[:, None] * (points - scanner), 0.0)


def changed(survey, case, seed):
    """A SimulatedSurvey whose second pass differs according to the case."""
    if case == "clean":
        return survey
    rng = np.random.default_rng([seed, 3])
    known = {field.name: getattr(survey, field.name) for field in fields(survey)}
    if case not in ("rebuilt", "parallel"):
        return ChangedSurvey(**known, move=getattr(Street(survey, rng), case))
    line = survey.scene.centre_line
    scene = survey.scene
    other = build_scene(survey.scenario, line, line.curve.x[-1] - 60.0, rng)
    triangles = other.mesh.triangles
    reflectance = other.mesh.reflectance
    keep = other.target < 0
    own = np.flatnonzero(scene.target >= 0)
    number = np.append(np.zeros(keep.sum(), int), own)
    mesh = Mesh(
        np.concatenate([triangles[keep], scene.mesh.triangles[own]]),
        np.concatenate([reflectance[keep], scene.mesh.reflectance[own]]),
    )
    if case == "parallel":
        pose = survey.true_passes[0].at(survey.true_passes[0].gps_time[:1])
        aside = pose.attitude.apply(PARALLEL)[0]
        mesh = Mesh(triangles[keep] + aside, reflectance[keep])
        for name in ("true_passes", "passes"):
            first, second = known[name]
            known[name] = first, replace(second, position=second.position + aside)
    return ChangedSurvey(**known, later=(mesh, number))


def with_control(survey, number):
    """The survey with evenly chosen control points along the street, without the others."""
    centred = survey.control.position - survey.control.position.mean(axis=0)
    along = np.linalg.svd(centred)[2][0]  # their longest direction
    order = np.argsort(centred @ along)
    kept = np.unique(np.linspace(0, len(order) - 1, number).round().astype(int))
    return replace(survey, control=survey.control[np.sort(order[kept])])


def measure(survey, true, ties):
    """RMS (m) of the residual error of the trajectory, and the estimate."""
    with warnings.catch_warnings(action="ignore"):
        result = mlscorr.correct(survey, ties=ties)
    left = true.at(result.trajectory.gps_time).position - result.trajectory.position
    return rms(left), result.estimate


def missing(survey, true, place, times):
    """True - recorded place (n, 3) of points recorded at places and times. Units: m."""
    seen = to_scanner(survey.trajectory, survey.mounting, place, times)
    return georeference(true, survey.mounting, seen, times) - place


def wrong_share(survey, true):
    """Share of the pairs within the widest gate about the true places that are truly wrong."""
    with warnings.catch_warnings(action="ignore"):
        features = mlscorr.find_ties(survey).features
    correction = missing(survey, true, features.centre, features.gps_time)
    sigma = np.full(len(features), SETTINGS.least_gate)  # so that the radius alone is the gate
    pairs = pair_features(features, correction, sigma, SETTINGS.least_gate)
    if len(pairs):
        return float(np.mean(truly_left(survey, true, pairs)[1] > 5.0))
    return np.nan


def truly_left(survey, true, ties):
    """Residuals of ties (n,) on the true path, and those over their sigmas."""
    change = [missing(survey, true, ties.place[:, v], ties.gps_time[:, v]) for v in range(2)]
    moved = np.einsum("ni,ni->n", ties.direction, change[0] - change[1])
    left = np.abs(ties.misclosure - moved)
    return left, left / ties.sigma


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--control", type=int, default=4)
    names = ["clean", "fifth", "window", "lorry", "rebuilt", "parallel"]
    parser.add_argument("--cases", nargs="+", choices=names, default=names)
    arguments = parser.parse_args()
    drive = scenario(duration=DURATION)
    print("case      seed   alone    ties   used  wrong  offered wrong  largest", flush=True)
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        simulated = simulate(drive, np.random.default_rng(seed))
        for case in arguments.cases:
            with tempfile.TemporaryDirectory() as folder:
                made = changed(simulated, case, seed)
                made.write(Path(folder) / "survey")
                recorded = mlscorr.read_survey(Path(folder) / "survey")
                survey = with_control(recorded, arguments.control)
                true = Trajectory.concatenate(made.true_passes)
                alone, _ = measure(survey, true, "off")
                tied, estimate = measure(survey, true, "auto")
                offered = wrong_share(recorded, true)
            used = 0
            wrong = 0
            largest = 0.0
            if estimate.ties is not None:
                left, ratio = truly_left(recorded, true, estimate.ties.ties)
                kept = estimate.ties.used
                used = int(kept.sum())
                wrong = int((ratio[kept] > 5.0).sum())
                largest = left[kept].max(initial=0.0)
            print(
                f"{case:9s}{seed:5d}{alone:8.3f}{tied:8.3f}{used:7d}{wrong:7d}{offered:15.0%}"
                f"{largest:9.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
