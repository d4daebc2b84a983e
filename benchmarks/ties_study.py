"""Gain from ties between passes over control points alone, on simulated drives there and back.

python benchmarks/ties_study.py [--seeds 6] [--control 3 6 12] [--streets canyon] [--preview]

RMS in 3D of the whole trajectory by control alone and with ties, and the shares within 2 sigma.
Drives, drift and sigmas are the simulator's canyon; ties are facades, road and cross walls at
random places along the street, observed in both passes with 10 mm of noise, a share of them wrong.
Other streets have curbs and eaves too, or road, poles, curbs and markings alone; all by --streets
without a name. With --preview parameters are those of control alone, in a tenth of the time.
"""

import argparse
import warnings

import numpy as np
from feature_surveys import feature_survey, scenarios
from scipy.spatial.transform import Rotation

from mlscorr.estimate import estimate_correction, previewed_correction, with_ties
from mlscorr.frames import georeference, to_scanner
from mlscorr.survey import Mounting, Ties

NOISE = 0.010  # m, one sigma of a tie: what is left of a street that changes a little
FARTHEST = 30.0  # m from the vehicle
WRONG_SIZE = (0.1, 1.0)  # m, of cars that moved, and facades shifted by one window
OUTAGES = ((20.0, 40.0), (225.0, 40.0))  # s
# Number of ties of a drive of 90 s there, by kind: the share that a second surface retains, poles
# and trees every 12 m, ends of dashes every 12 m. A pole or an end of a dash has a sigma of 2
# NOISE.
CANYON = {"facade": 600, "road": 300, "cross wall": 100}
ROAD = {"road": 300}
STREETS = {
    "canyon": CANYON,
    "canyon with kerbs": {**CANYON, "kerb": 500},
    "canyon with eaves": {**CANYON, "eaves": 500},
    "canyon with markings": {**CANYON, "line": 500, "dash": 45},
    "road": ROAD,
    "road with kerbs": {**ROAD, "kerb": 500},
    "road with markings": {**ROAD, "line": 500, "dash": 45},
    "road with poles": {**ROAD, "pole": 45},
    "road with poles and kerbs": {**ROAD, "pole": 45, "kerb": 500},
    "road with poles and markings": {**ROAD, "pole": 45, "line": 500, "dash": 45},
    "tunnel": {"facade": 600, "road": 300},
    "tunnel with markings": {"facade": 600, "road": 300, "line": 500, "dash": 45},
}
# Axis along which such a tie constrains: right, forward or up.
AXES = {
    "facade": "r",
    "road": "u",
    "cross wall": "f",
    "kerb": "r",
    "eaves": "u",
    "line": "r",
    "dash": "f",
    "pole": "rf",
}


def feature_ties(survey, seed, street=CANYON, wrong=0.05):
    """Ties of a FeatureSurvey's first two passes in a street; a share of them wrong."""
    rng = np.random.default_rng([seed, 2])
    true = survey.true
    recorded = survey.recorded
    (first, last), (begin, end) = true.passes[:2]
    kind = np.repeat(list(street), list(street.values()))
    sigma = np.where(np.isin(kind, ["pole", "dash"]), 2 * NOISE, NOISE)
    times = rng.uniform(first + 1.0, last - 1.0, len(kind))
    pose = true.at(times)
    forward = pose.attitude.apply([0.0, 1.0, 0.0])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    low = np.isin(kind, ["road", "kerb", "line", "dash"])
    side = rng.choice([-1.0, 1.0], len(kind)) * np.where(low, 3.0, rng.uniform(6, 12, len(kind)))
    height = np.where(low, -2.0, rng.uniform(-1.0, 6.0, len(kind)))
    height = np.where(kind == "eaves", 12.0, height)
    place = pose.position + side[:, None] * right + height[:, None] * [0.0, 0.0, 1.0]
    row = np.repeat(np.arange(len(kind)), [len(AXES[name]) for name in kind])
    axis = np.array(list("".join(AXES[name] for name in kind)))[:, None]
    normal = np.where(axis == "u", [0.0, 0.0, 1.0], right[row])
    normal = np.where(axis == "f", forward[row], normal)
    times = times[row]
    place = place[row]
    sigma = sigma[row]
    back = (true.gps_time >= begin + 1.0) & (true.gps_time <= end - 1.0)
    away = np.linalg.norm(true.position[back] - place[:, None], axis=2)
    again = true.gps_time[back][away.argmin(axis=1)]
    seen = away.min(axis=1) < FARTHEST
    times = times[seen]
    again = again[seen]
    place = place[seen]
    normal = normal[seen]
    sigma = sigma[seen]
    mounting = Mounting(np.zeros(3), Rotation.identity())
    views = [
        georeference(recorded, mounting, to_scanner(true, mounting, place, when), when)
        for when in (times, again)
    ]
    n = len(times)
    error = sigma * rng.standard_normal(n)
    bad = rng.random(n) < wrong
    error[bad] += rng.choice([-1.0, 1.0], bad.sum()) * rng.uniform(*WRONG_SIZE, bad.sum())
    views[1] = views[1] + error[:, None] * normal
    return Ties(
        gps_time=np.column_stack([times, again]),
        place=np.stack(views, axis=1),
        direction=normal,
        misclosure=np.einsum("ni,ni->n", normal, views[1] - views[0]),
        variance=sigma**2,
        kind=np.full(n, "plane"),
        pass_number=np.tile([1, 2], (n, 1)),
        scanner=np.zeros((n, 2), int),
        feature=np.arange(2 * n).reshape(n, 2),
    )


def some_control(survey, number):
    """The survey with evenly chosen control points along the street."""
    names = list(survey.control.name)
    kept = np.unique(np.linspace(0, len(names) - 1, number).round().astype(int))
    return survey.keep([names[i] for i in kept])


def by_control(survey):
    """The estimate by control points alone."""
    with warnings.catch_warnings(action="ignore"):
        return estimate_correction(survey.recorded, survey.matched)


def measure(survey, correction):
    """RMS in 3D (m) of the residual error of the whole trajectory, and the share within 2 sigma."""
    left = survey.position_left(correction)
    within = np.mean(np.abs(left) < 2 * correction.corrected.position_sigma)
    return float(np.sqrt(np.mean(np.sum(left**2, axis=1)))), float(within)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--control", type=int, nargs="+", default=[3, 6, 12])
    parser.add_argument("--wrong", type=float, default=0.05, help="share of wrong ties")
    parser.add_argument("--preview", action="store_true")
    parser.add_argument("--streets", nargs="*", default=["canyon"], choices=STREETS)
    parser.add_argument("--filtered", action="store_true", help="in real time, two outages")
    parser.add_argument("--grade", default="mems", choices=("mems", "tactical"))
    arguments = parser.parse_args()
    scenario = scenarios()["canyon"]
    changes = {"grade": arguments.grade}
    if arguments.filtered:  # 40 s in each pass, at other places of the road
        changes |= {"processing": "filtered", "sky_view": False, "outages": OUTAGES}
    pos = scenario.pos.model_copy(update=changes)
    scenario = scenario.model_copy(update={"pos": pos})
    print("control  seed     raw   alone  within    ties  within   ratio  street")
    for number in arguments.control:
        ratios = {street: [] for street in arguments.streets or STREETS}
        for seed in range(arguments.seeds):
            survey = some_control(feature_survey(scenario, seed), number)
            left = survey.true.position - survey.recorded.position
            estimate = by_control(survey)
            raw = np.sqrt(np.mean(np.sum(left**2, axis=1)))
            alone = measure(survey, estimate.correction)
            for street, values in ratios.items():
                ties = feature_ties(survey, seed, STREETS[street], arguments.wrong)
                with warnings.catch_warnings(action="ignore"):
                    if arguments.preview:
                        correction = previewed_correction(estimate, ties, with_sigmas=True)
                    else:
                        correction = with_ties(estimate, ties).correction
                tied = measure(survey, correction)
                values.append(tied[0] / alone[0])
                print(
                    f"{number:7d}{seed:6d}{raw:8.3f}{alone[0]:8.3f}{alone[1]:8.0%}"
                    f"{tied[0]:8.3f}{tied[1]:8.0%}{values[-1]:8.2f}  {street}",
                    flush=True,
                )
        for street, values in ratios.items():
            middle = np.median(values)
            largest = max(values)
            print(f"{number:7d} median ratio {middle:.2f}, largest {largest:.2f}: {street}")


if __name__ == "__main__":
    main()
