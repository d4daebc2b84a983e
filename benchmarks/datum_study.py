"""Rates at which a scale, turn or tilt of the control is found, with and without one.

python benchmarks/datum_study.py [KIND ...] [--seeds 20] [--points 8] [--good]

Surveys at feature level under each kind of POS that the simulator makes: MEMS and tactical units,
filtered and smoothed, with their stated sigma(t), without any, and with sigmas ten times too small
and too large; under open sky, in outages, and among houses that leave few satellites; the paper's
car and boat; a POS whose GNSS fix comes and goes; and one with short drifts that its sigmas do not
state.

The table has the share of good surveys in which a term is found (false alarms), and of the same
surveys, with their control changed by one term, in which this term is found. With --points, of so
many control points spread over the drive, as ``check`` takes; with --good, of good surveys alone.
"""

import argparse
import sys
import warnings
from dataclasses import replace

import numpy as np
from feature_surveys import feature_survey, scenarios
from pos_study import bumped, unfixed

from mlscorr.evaluate import datum_differences
from mlscorr.simulate.scenario import DriveScenario, PosScenario
from mlscorr.survey import Pos

SKIES = {  # spans (s) without GNSS, and with few satellites
    "open sky": {},
    "outages": {"outages": ((60.0, 40.0), (150.0, 50.0))},
    "few satellites": {"canyons": ((30.0, 60.0), (140.0, 70.0))},
}
STATED = {"": 1.0, ", no sigma": None, ", sigma / 10": 0.1, ", sigma x 10": 10.0}
TURN = np.radians(0.03)
CHANGES = {  # of places about their middle
    "none": np.zeros((3, 3)),
    "scale": np.diag([4e-4, 4e-4, 0.0]),
    "turn": TURN * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    "tilt": 4e-4 * np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.6, 0.8, 0.0]]),
}


def kinds():
    """Functions of a seed by the kind of POS: recorded trajectory and matched control."""
    known = scenarios()
    made = {name: known[name] for name in ("car", "boat")}
    for grade in ("tactical", "mems"):
        for processing in ("smoothed", "filtered"):
            for sky, spans in SKIES.items():
                pos = PosScenario(grade=grade, processing=processing, **spans)
                changes = {"pos": pos, "drive": DriveScenario(duration=240.0, speed=8.0)}
                made[f"{grade} {processing}, {sky}"] = known["motorway"].model_copy(update=changes)
    found = {}
    for name, scenario in made.items():
        is_filtered = "filtered, outages" in name
        for title, factor in STATED.items():
            if is_filtered or factor == 1.0:
                found[name + title] = recorded(scenario, factor)
    found["fixed in turns"] = lambda seed: unfixed(seed)[:2]
    found["drifting for seconds"] = lambda seed: bumped(seed)[:2]
    return found


def recorded(scenario, factor):
    """A function of a seed, with the stated sigma of position times a factor, or without any."""

    def survey(seed):
        made = feature_survey(scenario, seed)
        if factor is None:
            sigma = None
        else:
            sigma = factor * made.recorded.position_sigma
        return replace(made.recorded, position_sigma=sigma), made.matched

    return survey


def changed(matched, matrix):
    """The observed control points, surveyed with a linear change about their mean."""
    place = matched.surveyed.position
    moved = place + (place - place.mean(axis=0)) @ matrix.T
    return replace(matched, surveyed=replace(matched.surveyed, position=moved))


def spread(matched, number):
    """Observations of some control points along the drive."""
    rows = np.rint(np.linspace(0, len(matched) - 1, min(number, len(matched)))).astype(int)
    return matched[np.argsort(matched.gps_time)[rows]]


def terms_found(survey, seed, changes, points):
    """The terms found under each change, and the extent of the control (m)."""
    trajectory, matched = survey(seed)
    matched = matched if points is None else spread(matched, points)
    found = {
        change: [each.term for each in datum_differences(moved, trajectory, Pos())]
        for change in changes
        for moved in [changed(matched, CHANGES[change])]
    }
    place = matched.surveyed.position[:, :2]
    return found, np.sqrt(np.mean(np.sum((place - place.mean(axis=0)) ** 2, axis=1)))


def main():
    """Print the table, each kind of POS as soon as it is done."""
    known = kinds()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(known)}")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--points", type=int, default=None)
    parser.add_argument("--good", action="store_true")
    options = parser.parse_args()
    changes = ["none"] if options.good else [*CHANGES]
    print(f"| kind of POS | surveys | extent (m) | false alarms | {' | '.join(changes[1:])} |")
    print("|---|---|---|---|" + "---|" * (len(changes) - 1))
    for name in options.kinds or known:
        rows = []
        extents = []
        for seed in range(options.seeds):
            with warnings.catch_warnings(action="ignore"):
                found, extent = terms_found(known[name], seed, changes, options.points)
            rows.append(found)
            extents.append(extent)
            if found["none"]:
                print(f"{name}, seed {seed}: {found['none']}", file=sys.stderr, flush=True)
        alarms = sum(bool(row["none"]) for row in rows)
        shares = [sum(change in row[change] for row in rows) for change in changes[1:]]
        cells = [name, len(rows), f"{np.median(extents):.0f}", alarms, *shares]
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()
