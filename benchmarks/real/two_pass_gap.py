"""Causes of the misfit between two REAL passes of a UAV scanner: the mounting, then the rest.

    python benchmarks/real/two_pass_gap.py [--seed S] [--out FOLDER] [--picture FILE.png]

Real are the points, the sensor's positions and attitudes, and so the misfit of planes that both
passes of a car and of a tent saw (coin-or/Gravity, LANL LA-UR-20-28196). These data were not
corrected for boresight: planes of both passes give it, and the misfit is measured on planes of
other squares of the ground. The remaining misfit is diagnosed against a simulator that trusts its
sensors. Without the points the script ends with a message.
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from page import ROOT, SHARED, needed, picture, words
from scipy.spatial.transform import Rotation, Slerp
from two_pass_page import draw_slice, turns, write

from mlscorr.estimate import calibration_with_ties, prior_mounting
from mlscorr.frames import georeference, to_scanner
from mlscorr.gap.evidence import infer_causes
from mlscorr.gap.residuals import background, find_patches
from mlscorr.gap.residuals._surfaces import shared_rows
from mlscorr.gap.signatures import signatures
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import (
    CloudFile,
    ControlPoints,
    Matched,
    Mounting,
    PointCloud,
    Pos,
    Scanner,
    Survey,
    Trajectory,
)
from mlscorr.ties import tie_mounting

DATA = SHARED / "routescene_uav"
FILES = "{}_points_time_derived.npz"  # of the name of a scene
SCENES = ("Car", "Tent")  # of the data; yaw + 180 deg, - pitch and + roll in both
AXES = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # right, forward, up in its
BEAM = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])  # turns about forward
STEP = 0.005  # s between epochs: the attitude is given with each point
BELIEVED_SCANNER = Scanner(0.02, np.radians(0.01), 10.0)  # Velodyne HDL-32E: 2 cm, 0.01 deg, 10 Hz
# Sigmas of our simulator's MEMS unit with GNSS; 2 cm as for RTK.
BELIEVED_POS = Pos(0.02, np.radians([0.0136, 0.0136, 0.10]))
# held-out planes, by squares of the ground (m)
FOLDS = 4
SQUARE = 1.0
CHANCE = 100  # replicas for the p-value


@dataclass(frozen=True)
class Scene:
    """A scene: Survey, points (PointCloud), and their distances from those given by their poses."""

    survey: Survey
    cloud: PointCloud
    away: np.ndarray
    passes: np.ndarray


def main():
    arguments = parse()
    files = [FILES.format(name) for name in SCENES]
    needed(DATA, files, "Car.adc.laz and Tent.adc.laz of coin-or/Gravity, with a time per point")
    result = {}
    scenes = {}
    turned = {}
    for name in SCENES:
        scenes[name] = scene(name)
        answer = study(scenes[name], np.random.default_rng(arguments.seed))
        if answer is None:
            print(f"{name}: the passes saw no plane in common that the others agree with.")
            continue
        result[name], turned[name] = answer
        show(name, result[name])
    if not result:
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    (arguments.out / "two_pass_gap.json").write_text(json.dumps(result, indent=1) + "\n")
    print(f"Page: {write(arguments.out, scenes, result, turned)}")
    if "Car" in result:
        drawn = (scenes["Car"], turned["Car"], result["Car"])
        print(f"Picture: {picture(arguments.picture, draw_slice, (7.6, 2.6), *drawn)}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--out", type=Path, default=Path("two_pass_gap"))
    parser.add_argument(
        "--picture", type=Path, default=ROOT / "build" / "pictures" / "two_pass_gap.png"
    )
    return parser.parse_args()


def scene(name):
    """Scene of the real points, georeferenced again from their own sensor's poses."""
    data = np.load(DATA / FILES.format(name))
    order = np.argsort(data["time"], kind="stable")
    time, xyz, place, rpy, passes, intensity = (
        data[k][order] for k in ("time", "xyz", "sensor_xyz", "rpy", "pass_", "intensity")
    )
    roll, pitch, yaw = rpy.T
    angles = np.column_stack([yaw + np.pi, -pitch, roll])
    attitude = Rotation.from_euler("ZYX", angles) * Rotation.from_matrix(AXES)
    parts = [_epochs(time[p], place[p], attitude[p]) for p in (passes == 0, passes == 1)]
    trajectory = Trajectory(
        *(np.concatenate([part[i] for part in parts]) for i in (0, 1)),
        Rotation.concatenate([part[2] for part in parts]),
    )
    none = ControlPoints((), np.zeros((0, 3)), np.zeros((0, 3)), (), np.zeros(0), np.zeros((0, 3)))
    path = DATA / f"{name}.adc.laz"
    survey = Survey(
        name,
        path,
        None,
        (CloudFile(path, len(time), 0.0, "GPS seconds"),),
        trajectory,
        Mounting(np.zeros(3), Rotation.from_matrix(BEAM)),
        none,
        none,
        BELIEVED_SCANNER,
        BELIEVED_POS,
    )
    own = Trajectory(1000.0 + np.arange(len(time)), place, attitude)  # the pose of each point
    beam = to_scanner(own, survey.mounting, xyz, own.gps_time)
    again = georeference(trajectory, survey.mounting, beam, time)
    cloud = PointCloud(again, time, intensity.astype(float))
    return Scene(survey, cloud, np.linalg.norm(again - xyz, axis=1), passes)


def _epochs(time, place, attitude):
    """Times, positions and attitudes of one pass at even steps, from those of its points."""
    _, first = np.unique(time, return_index=True)
    time = time[first]
    place = place[first]
    attitude = attitude[first]
    even = np.append(np.arange(time[0], time[-1], STEP), time[-1])
    even = even[np.append(np.diff(even) > 1e-6, True)]
    moved = np.column_stack([np.interp(even, time, column) for column in place.T])
    return even, moved, Slerp(time, attitude)(even)


def study(scene, rng, folds=FOLDS, chance=CHANCE):
    """All numbers of a scene and its calibrated points, or None without a common plane."""
    survey = scene.survey
    collector = FeatureCollector(survey)
    collector.add(survey.clouds[0], scene.cloud)
    start = prior_mounting(survey.trajectory, survey.mountings, Matched.none(), survey.pos)
    calibration = tie_mounting(survey, start, Matched.none(), collector.features())
    if calibration.ties is None:
        return None
    ties = calibration.ties.ties
    estimate = calibration.lsc
    after = np.array(ties.misclosure)
    for out in _folds(ties, folds):
        rest = calibration_with_ties(calibration, Matched.none(), ties[~out])
        after[out] = misfit(survey, rest.lsc.mounting, ties[out])
    calibrated = remounted(scene, estimate.mounting)
    return {
        "points": len(scene.cloud),
        "planes": len(ties),
        "pose_check": float(np.percentile(scene.away, 95) * 1e3),
        "boresight": np.degrees(estimate.correction[3:]).tolist(),
        "sigma": np.degrees(estimate.sigma[3:]).tolist(),
        "determined": calibration.determined[3:].tolist(),
        "before": (1e3 * ties.misclosure).tolist(),
        "after": (1e3 * after).tolist(),
        "left": left(calibrated, rng, chance),
    }, calibrated.cloud.xyz


def misfit(survey, mounting, ties):
    """Distances (n,) between both views of ties under another mounting. Units: m."""
    time = ties.gps_time.ravel()
    beam = to_scanner(survey.trajectory, survey.mounting, ties.place.reshape(-1, 3), time)
    place = georeference(survey.trajectory, mounting, beam, time).reshape(-1, 2, 3)
    return np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])


def remounted(scene, mounting):
    """The scene under another mounting."""
    survey = scene.survey
    time = scene.cloud.gps_time
    beam = to_scanner(survey.trajectory, survey.mounting, scene.cloud.xyz, time)
    xyz = georeference(survey.trajectory, mounting, beam, time)
    mounted = replace(survey, mounting=mounting)
    return replace(scene, survey=mounted, cloud=replace(scene.cloud, xyz=xyz))


def left(scene, rng, chance):
    """Summary of the diagnosis of planes common to both passes; None if there are none."""
    patches = find_patches(scene.survey, chunks=lambda file: [scene.cloud])
    if patches is None:
        rows = None
    else:
        rows = shared_rows(scene.survey, patches, rng)
    if rows is None:
        return None
    signs, _ = signatures(rows, scene.survey)
    seen = background(rows, scene.survey)
    answer = infer_causes(rows, seen, scene.survey, signs, rng, chance)
    return {
        "planes": len(rows),
        "median": float(1e3 * np.median(np.abs(rows.residual))),
        "verdict": answer.verdict.label,
        "probability": answer.verdict.probability,
        "p_value": answer.verdict.p_value,
        "causes": [[c.effect, c.probability] for c in answer.causes[:6]],
    }


def _folds(ties, folds):
    """Folds of held-out ties: squares of the ground in turn, a list of bool masks (n,)."""
    place = ties.place[:, 0, :2] - ties.place[:, 0, :2].min(axis=0)
    square = np.floor(place / SQUARE).astype(int)
    number = (square[:, 0] + 2 * square[:, 1]) % folds
    return [number == k for k in range(folds) if (number == k).any()]


def show(name, r):
    """The result as text."""
    before, after = (np.median(np.abs(r[k])) for k in ("before", "after"))
    print(f"{name}: boresight off by {turns(r)}, by {r['planes']} planes that both passes saw")
    print(f"  misfit {before:.0f} -> {after:.0f} mm (median) on planes that were held out")
    if r["left"] is None:
        print("  then no plane is left that both passes saw")
        return
    rest = r["left"]
    print(
        f"  then {words(rest['verdict'])} (probability {rest['probability']:.2f}, p of none "
        f"{rest['p_value']:.1g}) on {rest['planes']} planes, {rest['median']:.0f} mm (median)"
    )


if __name__ == "__main__":
    main()
