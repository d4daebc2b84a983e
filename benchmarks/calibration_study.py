"""Accuracy of calibrations over many simulated surveys, against their truth.

    python benchmarks/calibration_study.py [--seeds 24] [--scenario FILE.toml] [--whole | --site]

Each survey is the scenario's with another seed: another street, drive, POS error and survey of the
targets. Targets are observed when the scan plane passes their centers, with the noise of extraction
and no occlusion; with --whole the cloud is simulated and the targets found in it (a minute each).
With --site it is a site of 24 control points with a boresight error of half a degree, read from its
files and calibrated with the ties between both passes; targets alone are listed too. The POS error
is made by its causes, not by the estimator's covariance.

Prints for both methods the RMS error of each component, its stated sigma, and the RMS of error
over sigma (one if the sigma is honest), then the RMSE at the check points.
"""

import argparse
import tempfile
import warnings
from pathlib import Path

import numpy as np

import mlscorr
from mlscorr.estimate import MOUNTING_COMPONENTS as COMPONENTS
from mlscorr.estimate import estimate_mounting
from mlscorr.evaluate import misclosures
from mlscorr.frames import georeference, to_scanner
from mlscorr.simulate import Scenario, read_scenario, simulate
from mlscorr.survey import Matched, TargetObservations

SCENARIO = Path(__file__).parents[1] / "examples" / "scenarios" / "calibration.toml"
EXTRACTION = 0.003  # m, one sigma: stated by target extraction for 0.6 m at 10 m
REACH = 25.0  # m, beyond which the houses occlude targets
GRAZING = 0.2  # smallest cosine of incidence at which a target is found
METHODS = ("lsc", "ls", "targets")  # the last: collocation by targets alone
SITE = Scenario(
    name="site",
    scene={"kind": "street", "gaps": 0.3},
    drive={"duration": 40.0, "speed": 5.0, "passes": [{}, {"direction": "back", "pause": 60.0}]},
    targets={"control": 24, "check": 6, "kinds": ["circle", "square"], "hidden": 0.0},
    scanner=[{"boresight": [90.0, 0.0, 35.0], "lines_per_second": 60, "points_per_line": 500}],
    pos={"grade": "tactical"},
    effects=[
        {"name": "boresight", "magnitude": [0.3, -0.3, 0.3]},  # deg
        {"name": "lever_arm", "magnitude": [0.03, -0.02, 0.05]},  # m
    ],
)
UNITS = np.repeat([1e3, 180 / np.pi], 3)  # mm, deg


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--scenario", type=Path, default=SCENARIO)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--whole", action="store_true", help="simulate and read the whole cloud")
    parser.add_argument("--site", action="store_true", help="24 control points, with ties")
    arguments = parser.parse_args()
    if arguments.site:
        scenario = SITE
    else:
        scenario = read_scenario(arguments.scenario)
    if arguments.whole or arguments.site:
        study = whole_survey
    else:
        study = features
    results = []
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        results.append(study(scenario, seed))
        print(f"seed {seed:3d}", *(f"{v:8.3f}" for v in results[-1]["lsc"][0]), flush=True)
    tell(results)


def tell(results):
    """Print the table over all seeds."""
    print("\nRMS over the surveys; mm and deg")
    for method in METHODS:
        error, sigma = np.moveaxis([result[method] for result in results], 1, 0)
        for title, values in (
            ("error", error),
            ("stated sigma", sigma),
            ("error over sigma", error / sigma),
        ):
            rms = np.sqrt(np.mean(values**2, axis=0))
            print(f"{method:8s}{title:18s}", *(f"{value:8.4f}" for value in rms))
        within = np.mean(np.abs(error) <= 2 * sigma, axis=0)
        largest = np.abs(error).max(axis=0)
        print(f"{method:8s}{'within 2 sigma':18s}", *(f"{share:8.0%}" for share in within))
        print(f"{method:8s}{'largest error':18s}", *(f"{value:8.4f}" for value in largest))
    told = np.mean([result["determined"] for result in results], axis=0)
    print(f"{'determined':22s}", *(f"{share:8.0%}" for share in told))
    print("components:", ", ".join(COMPONENTS))
    print("\nRMSE at check points, E/N/H in m: median and worst")
    for title in ("raw", "ls", "lsc", "lsc with drift"):
        rmse = np.array([result["check"][title] for result in results])
        numbers = [*np.median(rmse, axis=0), *rmse.max(axis=0)]
        print(f"{title:16s}", *(f"{value:8.4f}" for value in numbers))


def features(scenario, seed):
    """Simulate a survey whose targets are observed without a cloud."""
    simulated = simulate(scenario, np.random.default_rng(seed))
    observations, is_check = observe(simulated, np.random.default_rng([seed, 1]))
    control, check = (simulated.targets[of] for of in (~simulated.is_check, simulated.is_check))
    calibration = estimate_mounting(
        simulated.trajectory,
        [simulated.mounting],
        Matched.by_name(observations[~is_check], control),
    )
    return score(calibration, simulated, Matched.by_name(observations[is_check], check))


def whole_survey(scenario, seed):
    """A survey from its files."""
    simulated = simulate(scenario, np.random.default_rng(seed))
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulated.write(Path(folder))
        result = mlscorr.calibrate(mlscorr.read_survey(folder))
        alone = estimate_mounting(
            result.survey.trajectory, [simulated.mounting], result.matched_control
        )
    return score(result.calibration, simulated, result.matched_check, alone)


def score(calibration, simulated, check, alone=None):
    """Errors and sigmas (2, 6) of both methods and of targets alone, and the check points' RMSE."""
    true = simulated.true_mountings[0]
    recorded = simulated.mounting
    turn = (true.boresight * recorded.boresight.inv()).as_rotvec()
    lacks = np.append(true.lever_arm - recorded.lever_arm, turn)
    corrections = {
        "raw": None,
        "ls": calibration.correction("ls"),
        "lsc": calibration.correction(),
        "lsc with drift": calibration.correction_with_drift,
    }
    result = {
        method: UNITS * [estimate.correction - lacks, estimate.sigma]
        for method, estimate in zip(
            METHODS,
            (calibration.lsc, calibration.ls, (alone or calibration).lsc),
            strict=True,
        )
    }
    result["determined"] = calibration.determined
    result["check"] = {
        title: np.sqrt(np.mean(misclosures(check, correction) ** 2, axis=0))
        for title, correction in corrections.items()
    }
    return result


def observe(simulated, rng):
    """TargetObservations of all targets that face the scanner, and a mask of check points."""
    mounting = simulated.true_mountings[0]
    centres = simulated.true_centre
    found = []
    for number, true in enumerate(simulated.true_passes):
        eye = true.position + true.attitude.apply(mounting.lever_arm)
        across = true.attitude.apply(mounting.boresight.apply([0.0, 0.0, 1.0]))
        out_of_plane = np.einsum("qi,tqi->tq", across, centres[:, None] - eye)
        for target, k in zip(*np.nonzero(np.diff(np.sign(out_of_plane), axis=1) != 0), strict=True):
            sight = eye[k] - centres[target]
            distance = np.linalg.norm(sight)
            if (
                sight @ simulated.scene.targets.normal[target] < GRAZING * distance
                or distance > REACH
            ):
                continue
            a, b = out_of_plane[target, k : k + 2]
            time = true.gps_time[k] + (true.gps_time[k + 1] - true.gps_time[k]) * a / (a - b)
            found.append((number, target, time))
    number, target, time = (np.array(column) for column in zip(*found, strict=True))
    position = np.empty((len(time), 3))
    for one, (true, recorded) in enumerate(
        zip(simulated.true_passes, simulated.passes, strict=True)
    ):
        rows = number == one
        seen = to_scanner(true, mounting, centres[target[rows]], time[rows])
        seen += EXTRACTION * rng.standard_normal(seen.shape)
        position[rows] = georeference(recorded, simulated.mounting, seen, time[rows])
    surveyed = simulated.targets
    n = len(time)
    observations = TargetObservations(
        name=tuple(surveyed.name[i] for i in target),
        pass_number=number + 1,
        gps_time=time,
        position=position,
        covariance=np.tile(EXTRACTION**2 * np.eye(3), (n, 1, 1)),
        normal=simulated.scene.targets.normal[target],
        kind=tuple(surveyed.kind[i] for i in target),
        size=surveyed.size[target],
        points=np.full(n, 300),
    )
    return observations, simulated.is_check[target]


if __name__ == "__main__":
    main()
