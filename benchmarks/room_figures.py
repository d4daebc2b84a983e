"""Figures of merit of each room on small simulated surveys, for ablation.py.

Each function takes seeds and returns figures by name, the same ones for the same seeds. They are
errors if the truth is known; for documents they are the count and the RMS of the numbers below each
key. No real data are used.
"""

import math
import tempfile
from functools import cache
from pathlib import Path

import gap_study
import matching_study
import numpy as np
import target_study
from calibration_study import features as calibrated
from feature_surveys import feature_survey, scenarios
from ties_study import feature_ties

import mlscorr
from mlscorr.estimate import estimate_correction, with_ties
from mlscorr.evaluate import datum_differences
from mlscorr.pipeline.project import correct_project
from mlscorr.simulate import Scenario, simulate
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import Pos
from mlscorr.ties import search_ties

SCENARIOS = ("demo", "mems")  # a steady drive, and one with outages and multipath
TIED = {"facade": 30, "road": 15, "cross wall": 5}  # ties by kind: few, so that it takes seconds
RATE = 1.0  # Hz of the trajectories of feature surveys
SCANNER = ({"lines_per_second": 75, "points_per_line": 400},)
SHORT = Scenario(
    drive={"duration": 10.0},
    targets={"control": 4, "check": 1},
    scanner=SCANNER,
)
LONG = Scenario(
    drive={"duration": 25.0},
    targets={"control": 8, "check": 2},
    scanner=SCANNER,
    effects=[{"name": "time_offset", "magnitude": 0.02}],
)
THERE_AND_BACK = Scenario(
    drive={"duration": 8.0, "passes": [{}, {"direction": "back", "pause": 20.0}]},
    targets={"control": 4, "check": 1},
    scene={"markings": True},
    scanner=SCANNER,
)


@cache
def written(scenario, seed):
    """Folder of a simulated survey without its truth."""
    folder = Path(tempfile.mkdtemp())
    simulate(scenario, np.random.default_rng(seed)).write(folder)
    for truth in folder.glob("truth*"):
        truth.unlink()
    return folder


def numbers_in(document):
    """All finite numbers in a document, except flags."""
    if isinstance(document, np.ndarray):
        document = document.tolist()
    if isinstance(document, dict):
        document = list(document.values())
    if isinstance(document, list | tuple):
        for part in document:
            yield from numbers_in(part)
        return
    is_number = isinstance(document, int | float) and not isinstance(document, bool)
    if is_number and math.isfinite(document):
        yield float(document)


def summary(document, label=""):
    """Count and RMS of the numbers below each key of a document."""
    figures = {}
    for key, part in document.items():
        numbers = np.array(list(numbers_in(part)))
        if len(numbers):
            figures[f"{label}{key} n"] = float(len(numbers))
            figures[f"{label}{key}"] = float(np.sqrt(np.mean(numbers**2)))
    return figures


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def matching(seeds):
    """Counts of right, refused and wrong matches."""
    return matching_study.figures(seeds)


def targets(seeds):
    """Recall, center errors and false targets."""
    return target_study.figures(seeds)


@cache
def drives(seeds):
    """FeatureSurveys of each scenario and seed."""
    found = scenarios()
    return [feature_survey(found[name], seed, RATE) for name in SCENARIOS for seed in seeds]


@cache
def tied_drives(seeds):
    """FeatureSurveys with two passes and their ties, some of these wrong."""
    scenario = scenarios()["calibration"].model_copy(
        update={"pos": scenarios()["mems"].pos.model_copy(update={"outages": (), "canyons": ()})}
    )
    surveys = [feature_survey(scenario, seed, RATE) for seed in seeds]
    return [
        (survey, feature_ties(survey, seed, TIED))
        for survey, seed in zip(surveys, seeds, strict=True)
    ]


def corrections(seeds):
    """Errors and honesty of corrections by control points: right ones, and with gross errors."""
    figures = {}
    for label in ("clean", "gross"):
        left = []
        normalized = []
        rejected = 0
        surveys = drives(seeds)
        if label == "gross":
            rng = np.random.default_rng(seeds[0])
            surveys = [surveys[0].spoil(0.1, rng)[0]]  # the search takes seconds
        for survey in surveys:
            found = estimate_correction(survey.recorded, survey.matched)
            error = survey.position_left(found.correction)
            left.append(rms(error))
            normalized.append(rms(error / found.correction.corrected.position_sigma))
            rejected += len(found.outliers)
        figures |= {
            f"{label} trajectory m": rms(left),
            f"{label} error/sigma": rms(normalized),
            f"{label} rejected": float(rejected),
        }
    return figures


def estimate(seeds):
    """Errors and honesty of corrections with ties as well, and of a mounting."""
    figures = corrections(seeds)
    for survey, ties in tied_drives(seeds):
        found = with_ties(estimate_correction(survey.recorded, survey.matched), ties)
        error = survey.position_left(found.correction)
        figures["tied trajectory m"] = rms(error)
        figures["tied error/sigma"] = rms(error / found.correction.corrected.position_sigma)
    score = calibrated(scenarios()["calibration"], seeds[0])
    return figures | summary(score, "mounting ")


def pos(seeds):
    """Errors and honesty of corrections of drives with outages and multipath."""
    return corrections(seeds)


def ties(seeds):
    """Features and ties of a street there and back, and their agreement with the truth."""
    figures = {}
    for seed in seeds:
        survey = mlscorr.read_survey(written(THERE_AND_BACK, seed))
        collector = FeatureCollector(survey)
        for file in survey.clouds:
            for cloud in mlscorr.io.clouds.read_chunks(file):
                collector.add(file, cloud)
        features = collector.features()
        found = search_ties(survey, features).ties
        figures |= {
            f"features {seed}": float(len(features)),
            f"ties {seed}": float(len(found)),
            f"misclosure mm {seed}": 1e3 * float(np.median(np.abs(found.misclosure))),
            f"misclosure/sigma {seed}": rms(found.misclosure / np.sqrt(found.variance)),
        }
        corrected = mlscorr.correct(survey, ties="only")
        figures |= summary(corrected.check, f"check {seed} ")
    return figures


def io(seeds):
    """Figures of the check of a survey, and of its reading."""
    figures = {}
    for seed in seeds:
        folder = written(SHORT, seed)
        checked = mlscorr.check(folder / "survey.toml")
        for name in ("faults", "warnings", "notes", "unchecked"):
            figures[f"{seed} {name}"] = float(len(getattr(checked, name)))
        survey = mlscorr.read_survey(folder)
        chunks = [len(cloud) for cloud in mlscorr.io.clouds.read_chunks(survey.clouds[0])]
        figures[f"{seed} points of a chunk"] = rms(chunks)
    return figures


def effects(seeds):
    """Effect of an error by incidence on the ranges of a survey."""
    effect = {"name": "incidence_bias", "magnitude": 0.005}
    biased = Scenario(**{**SHORT.model_dump(), "effects": [effect]})
    figures = {}
    for seed in seeds:
        before, after = (
            simulate(scenario, np.random.default_rng(seed)).pulses.range
            for scenario in (SHORT, biased)
        )
        figures[f"{seed} mean mm"] = 1e3 * float(after.mean() - before.mean())
        figures[f"{seed} largest mm"] = 1e3 * float(np.abs(after - before).max())
    return figures


def simulated(seeds):
    """Points, intensities, POS errors and their sigmas of a street and a river."""
    figures = {}
    for kind in ("street", "river"):
        scenario = Scenario(**{**SHORT.model_dump(), "scene": {"kind": kind, "reference": True}})
        for seed in seeds:
            made = simulate(scenario, np.random.default_rng(seed))
            error = made.trajectory.position - made.true_trajectory.position
            pulses = made.pulses
            figures |= {
                f"{kind} {seed} points": float(len(pulses)),
                f"{kind} {seed} intensity": float(pulses.intensity.mean()),
                f"{kind} {seed} range": float(pulses.range.mean()),
                f"{kind} {seed} later echoes": float(np.sum(pulses.return_number > 1)),
                f"{kind} {seed} on targets": float(np.sum(made.target >= 0)),
                f"{kind} {seed} triangles": float(len(made.scene.mesh)),
                f"{kind} {seed} POS error m": rms(error),
                f"{kind} {seed} POS sigma m": rms(made.trajectory.position_sigma),
                f"{kind} {seed} attitude sigma": rms(made.trajectory.attitude_sigma),
                f"{kind} {seed} path m": rms(made.true_trajectory.position[::20].std(axis=0)),
            }
    return figures


def baselines(seeds):
    """Check and control RMSE of each method."""
    figures = {}
    for seed in seeds:
        for row in mlscorr.compare(mlscorr.read_survey(written(SHORT, seed))).rows:
            scores = {"check": row["check"], "control": row["control"]}
            figures |= summary(scores, f"{seed} {row['name']} ")
    return figures


def evaluate(seeds):
    """The accuracy stated by a report, and the terms of a datum difference."""
    figures = {}
    for seed in seeds:
        figures |= summary(corrected(seed).accuracy, f"{seed} ")
    for survey in drives(seeds):
        found = datum_differences(survey.matched, survey.recorded, Pos())
        figures[f"terms {len(figures)}"] = float(len(found))
    return figures


def corrected(seed):
    """A CorrectedSurvey of a short street."""
    return mlscorr.correct(mlscorr.read_survey(written(SHORT, seed)))


def correction(seeds):
    """The correction of a short street, and the check before it."""
    figures = io(seeds)
    for seed in seeds:
        result = corrected(seed)
        figures |= summary({"control": result.control, "check": result.check}, f"{seed} ")
    return figures


def project(seeds):
    """The correction of a project of one drive."""
    figures = {}
    for seed in seeds:
        folder = written(SHORT, seed)
        text = f'name = "city"\ncrs = "EPSG:32650"\n\n[control]\nfile = "{folder}/control.csv"\n'
        path = Path(tempfile.mkdtemp()) / "project.toml"
        path.write_text(f'{text}\n[[drive]]\nsurvey = "{folder}"\n')
        result = correct_project(path, path.parent / "out")
        figures |= summary(result.document, f"{seed} ")
    return figures


def report(seeds):
    """Sizes of the page and the pictures of a correction."""
    figures = {}
    for seed in seeds:
        out = Path(tempfile.mkdtemp()) / "out"
        corrected(seed).write(out)
        for path in sorted(out.rglob("*")):
            if path.suffix in (".html", ".png"):
                figures[f"{seed} {path.name} bytes"] = float(path.stat().st_size)
    return figures


def diagnosed(seeds):
    """The document of a diagnosis of a street with a clock error."""
    figures = {}
    for seed in seeds:
        document = mlscorr.diagnose(mlscorr.read_survey(written(LONG, seed))).document
        figures |= summary(document, f"{seed} ")
    return figures


def evidence(seeds):
    """Labels, their probabilities and p-values over feature surveys with and without an effect."""
    figures = {}
    for seed in seeds:
        bed = gap_study.Bed.of(seed)
        for effects_in in ((), ("time_offset",), ("range_bias",), ("position_bump",)):
            rng = np.random.default_rng(seed)
            answer = gap_study.case(bed, rng, "sines", effects_in)
            name = f"{seed} {answer['truth']}"
            figures[f"{name} probability"] = float(answer["probability"].get(answer["truth"], 0.0))
            figures[f"{name} set"] = float(len(answer["set"]))
            figures[f"{name} scores"] = rms(list(answer["score"].values()))
    return figures


def diagnosis_page(seeds):
    """Size of the page of a diagnosis."""
    figures = {}
    for seed in seeds:
        out = Path(tempfile.mkdtemp()) / "out"
        mlscorr.diagnose(mlscorr.read_survey(written(LONG, seed))).write(out)
        figures[f"{seed} bytes"] = float((out / "gap.html").stat().st_size)
    return figures


def plan(seeds):
    """The document of a plan of a survey."""
    figures = {}
    for seed in seeds:
        document = mlscorr.plan(mlscorr.read_survey(written(LONG, seed))).document
        figures |= summary(document, f"{seed} ")
    return figures
