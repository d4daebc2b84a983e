"""Why two REAL passes of a UAV scanner don't meet: the two-pass misfit and what explains it.

    python examples/real/two_pass_gap.py [--seed S] [--out FOLDER] [--picture FILE.png]

Real are the points, the sensor's positions and attitudes, and so the misfit of planes that both
passes of a car and of a tent saw (coin-or/Gravity, LANL LA-UR-20-28196). These data were not
corrected for boresight. Simulated is what a survey of the same beams and times would misfit by if
the sensors were as believed, and what is left once the named cause is in the simulator. Without
the points it says so and ends.
"""

import argparse
import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from page import ROOT, SHARED, counted, needed, picture, words
from scipy.spatial.transform import Rotation, Slerp
from two_pass_page import draw_slice, parameter_told, write

from mlscorr.effects import in_order, make_effect
from mlscorr.frames import georeference, to_scanner
from mlscorr.gap.infer.causes import infer_causes
from mlscorr.gap.infer.observations import Observations
from mlscorr.gap.infer.settings import SETTINGS
from mlscorr.gap.observe import background
from mlscorr.gap.observe.patch_search import find_patches
from mlscorr.gap.observe.rows import reference_of
from mlscorr.gap.observe.shared_planes import shared_rows
from mlscorr.gap.signatures import signatures
from mlscorr.gap.signatures.changes import Bench
from mlscorr.survey import (
    CloudFile,
    ControlPoints,
    Mounting,
    PointCloud,
    Pos,
    Scanner,
    Survey,
    Trajectory,
)

DATA = SHARED / "routescene_uav"
FILES = "{}_points_time_derived.npz"  # of the name of a scene
SCENES = ("Car", "Tent")  # of the data; yaw + 180 deg, - pitch and + roll in both
AXES = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # right, forward, up in its
BEAM = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])  # turns about forward
STEP = 0.005  # s between epochs: the attitude is given with each point
BELIEVED_SCANNER = Scanner(0.02, np.radians(0.01), 10.0)  # Velodyne HDL-32E: 2 cm, 0.01 deg, 10 Hz
# What our simulator's MEMS unit states with GNSS; 2 cm as RTK does.
BELIEVED_POS = Pos(0.02, np.radians([0.0136, 0.0136, 0.10]))
FOLDS, SQUARE = 4, 1.0  # held-out planes, by squares of the ground (m)
REPLICAS = 400
CHANCE = 100  # replicas for the p-value
TOLD = ("time_offset", "lever_arm", "range_bias")  # how small one these planes would show


@dataclass(frozen=True)
class Scene:
    """A scene: Survey, points (PointCloud), how far they are from where their pose puts them."""

    survey: Survey
    cloud: PointCloud
    away: np.ndarray
    passes: np.ndarray


def main():
    arguments = parse()
    files = [FILES.format(name) for name in SCENES]
    needed(DATA, files, "Car.adc.laz and Tent.adc.laz of coin-or/Gravity, with a time per point")
    result, scenes = {}, {}
    for name in SCENES:
        rng = np.random.default_rng(arguments.seed)
        scenes[name] = scene(name)
        result[name] = study(scenes[name], rng)
        show(name, result[name])
    arguments.out.mkdir(parents=True, exist_ok=True)
    plain = {name: {k: v for k, v in one.items() if k != "drawn"} for name, one in result.items()}
    (arguments.out / "two_pass_gap.json").write_text(json.dumps(plain, indent=1) + "\n")
    turned = {name: corrected(scenes[name], result[name]) for name in scenes}
    print(f"Page: {write(arguments.out, scenes, result, turned)}")
    if turned["Car"] is not None:
        drawn = (scenes["Car"], turned["Car"], result["Car"])
        print(f"Picture: {picture(arguments.picture, draw_slice, (7.6, 2.6), *drawn)}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--out", type=Path, default=Path("two_pass_gap"))
    parser.add_argument("--picture", type=Path, default=ROOT / "assets" / "two_pass_gap.png")
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
        name, path, None, (CloudFile(path, len(time), 0.0, "GPS seconds"),), trajectory,
        Mounting(np.zeros(3), Rotation.from_matrix(BEAM)), none, none,
        BELIEVED_SCANNER, BELIEVED_POS,
    )  # fmt: skip
    own = Trajectory(1000.0 + np.arange(len(time)), place, attitude)  # the pose of each point
    beam = to_scanner(own, survey.mounting, xyz, own.gps_time)
    again = georeference(trajectory, survey.mounting, beam, time)
    cloud = PointCloud(again, time, intensity.astype(float))
    return Scene(survey, cloud, np.linalg.norm(again - xyz, axis=1), passes)


def _epochs(time, place, attitude):
    """Times, positions and attitudes of one pass in even steps, from those of its points."""
    _, first = np.unique(time, return_index=True)
    time, place, attitude = time[first], place[first], attitude[first]
    even = np.append(np.arange(time[0], time[-1], STEP), time[-1])
    even = even[np.append(np.diff(even) > 1e-6, True)]
    moved = np.column_stack([np.interp(even, time, column) for column in place.T])
    return even, moved, Slerp(time, attitude)(even)


def study(one, rng, folds=FOLDS, chance=CHANCE):
    """All numbers of a scene."""
    survey = one.survey
    patches = find_patches(survey, chunks=lambda file: [one.cloud])
    rows = shared_rows(survey, patches, rng)
    answer = diagnosed(rows, survey, rng, chance)
    drawn, before = rms(replicas(rows, survey, rng)), rms(rows.residual)
    residual, effects = held_out(rows, survey, rng, folds, chance)
    shrink, interval = shrunk(rows, residual, folds)
    return told(answer) | {
        "points": len(one.cloud), "planes": len(rows),
        "pose_check": float(np.percentile(one.away, 95) * 1e3),
        "before": before, "after": rms(residual), "shrink": shrink, "shrink_interval": interval,
        "null_band": np.percentile(drawn, SETTINGS.band).tolist(), "effects": effects,
        "rows": {"position": rows.position.tolist(), "before": (1e3 * rows.residual).tolist(),
                 "after": (1e3 * residual).tolist(), "normal": rows.direction.tolist(),
                 "pass": rows.covariates["pass"].tolist()},
        "drawn": (1e3 * drawn).tolist(),
    }  # fmt: skip


def told(answer):
    """What the diagnosis says, plain."""
    verdict, compared = answer.verdict, answer.separability
    return {
        "verdict": verdict.label, "probability": verdict.probability,
        "p_value": verdict.p_value, "set": list(verdict.set), "lead": verdict.lead,
        "same": list(answer.same), "classes": [list(c) for c in compared.classes],
        "causes": [[c.effect, c.probability] for c in answer.causes[:6]],
        "parameters": [
            [c.effect, p.name, p.unit, p.estimate, p.sigma, p.detectable]
            for c in answer.causes if c.effect == verdict.label for p in c.parameters
        ],
        "detectable": [
            [n, float(d), u]
            for n, d, u in zip(compared.names, compared.detectable, compared.units, strict=True)
            if n.split()[0] in TOLD
        ],
    }  # fmt: skip


def shrunk(rows, after, folds):
    """Share of the square of the misfit that is gone, and its 95 % interval by jackknife."""
    blocks = np.array(
        [[np.sum(r[f] ** 2) for f in _folds(rows, folds)] for r in (rows.residual, after)]
    )
    left = blocks.sum(axis=1, keepdims=True) - blocks  # without each fold in turn
    spread = float(1.96 * np.std(1 - left[1] / left[0]) * np.sqrt(folds - 1))
    share = float(1 - blocks[1].sum() / blocks[0].sum())
    return share, [share - spread, min(share + spread, 1.0)]


def diagnosed(rows, survey, rng, chance=CHANCE):
    """Inference on planes that both passes saw."""
    signs, _ = signatures(rows, survey)
    return infer_causes(rows, background(rows, survey), survey, signs, rng, chance)


def replicas(rows, survey, rng):
    """Simulated misfits (m, k) of the same planes if all sensors were as believed. Units: m."""
    observed = Observations.of(rows, background(rows, survey))
    looks = observed.whitener().draw(rng, REPLICAS)  # both looks share the plane's height
    drawn = np.zeros((len(rows), REPLICAS))
    np.add.at(drawn, observed.row, looks)
    return drawn[np.isin(np.arange(len(rows)), observed.row)]


def rms(values):
    """Root mean square of (m,) or (m, k) over rows."""
    value = np.sqrt(np.mean(np.square(values), axis=0))
    return float(value) if np.ndim(value) == 0 else value


def _folds(rows, folds):
    """Which planes (m,) are held out together: squares of the ground in turn, a list of bool."""
    place = rows.position[:, :2] - rows.position[:, :2].min(axis=0)
    square = np.floor(place / SQUARE).astype(int)
    number = (square[:, 0] + 2 * square[:, 1]) % folds
    return [number == k for k in range(folds)]


def held_out(rows, survey, rng, folds, chance):
    """Misfit (m,) of planes once the cause named from all others is in the simulator, and those."""
    after, named = rows.residual.copy(), []
    for out in _folds(rows, folds):
        answer = diagnosed(rows.select(~out), survey, rng, chance)
        cause = answer.causes[0] if answer.verdict.label != "unknown" else None
        named.append(answer.verdict.label)
        if cause is None or not out.any():
            continue
        bench = Bench(rows.select(out), survey)
        for effect in in_order(e for e in cause.effects if not e.random):
            after[out] -= bench.change(effect).shift
    return after, named


def corrected(one, result):
    """Points of a scene with the boresight that was found taken out, or None."""
    size = {p[1]: p[3] for p in result["parameters"] if p[2] == "deg"}
    if set(size) != {"right", "forward", "up"}:
        return None
    effect = make_effect("boresight", magnitude=[-size[k] for k in ("right", "forward", "up")])
    survey, time = one.survey, one.cloud.gps_time
    beam = to_scanner(survey.trajectory, survey.mounting, one.cloud.xyz, time)
    mounting = effect.apply(survey.mounting, reference_of(survey))
    return georeference(survey.trajectory, mounting, beam, time)


def show(name, r):
    """The result as text."""
    low, high = r["null_band"]
    print(
        f"{name}: {r['planes']} planes in both passes; {words(r['verdict'])} "
        f"(probability {r['probability']:.2f}, p of none {r['p_value']:.1g})"
    )
    print(
        f"  misfit {1e3 * r['before']:.0f} -> {1e3 * r['after']:.0f} mm on held-out planes "
        f"({r['shrink']:.0%} of its square [{r['shrink_interval'][0]:.0%}, "
        f"{r['shrink_interval'][1]:.0%}]); {1e3 * low:.0f} to {1e3 * high:.0f} mm if all is as "
        f"believed; named from the other planes: {counted(Counter(r['effects']))}"
    )
    for _, parameter, unit, value, sigma, least in r["parameters"]:
        print(
            f"  {parameter_told(parameter, unit)}: {value:.3f} ± {sigma:.3f} {unit}, "
            f"detectable {least:.3f}"
        )
    alike = "; ".join(", ".join(words(effect) for effect in c) for c in r["classes"])
    print(f"  can't be told apart here: {alike or 'none'}")


if __name__ == "__main__":
    main()
