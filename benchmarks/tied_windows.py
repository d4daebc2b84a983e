"""Gain from ties on the real drift of a POS, on a road there and back.

    python benchmarks/tied_windows.py [--control 0 3 6 12]

Two windows of the real error series, one after the other, are the errors of a drive there and of
the drive back; GNSS was withheld in each, at other places of the road. Control points are seen in
both passes. RMS in 3D of the whole trajectory by control alone (0: as recorded) and with ties, and
the shares within 2 sigma. The window of the shared survey of the same series is skipped. Reads the
series below MLSCORR_SHARED, else ../shared.
"""

import argparse
import os
import warnings
from pathlib import Path

import numpy as np
from feature_surveys import EXTRACTION, FeatureSurvey
from real_windows import EVERY, stated_sigma
from ties_study import feature_ties, measure

from mlscorr.estimate import estimate_correction, prior_correction, with_ties
from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import read_pos_error_series
from mlscorr.survey import ControlPoints, Pos, TargetObservations, Trajectory

LENGTH = EVERY  # s of a pass, in which GNSS was withheld once
FIRST = (358_135.0, 358_360.0, 358_585.0, 358_785.0)  # s: behind the shared survey's window
SPEED = 10.0  # m/s
TARGETS = 24
SURVEYED = 0.003  # m, one sigma
STREET = {"facade": 1000, "road": 500, "cross wall": 170}  # a tie of each for 0.1 to 1 s


def drive(series, first):
    """True and recorded trajectory of a road there and back."""
    start = np.array([532_000.0, 3_374_000.0, 40.0])
    ahead = np.array([0.6, 0.8, 0.0])
    parts = []
    for number, begin in enumerate((first, first + LENGTH)):
        inside = (series.gps_time >= begin + 2 * number) & (series.gps_time < begin + LENGTH)
        time = series.gps_time[inside]
        along = SPEED * (time - begin)
        along = along if number == 0 else SPEED * LENGTH - along
        heading = np.full(len(time), np.arctan2(0.6, 0.8) + number * np.pi)
        angles = np.column_stack([np.zeros((len(time), 2)), heading])
        parts.append((time, start + np.outer(along, ahead), angles, inside))
    time, way, angles, inside = (
        np.concatenate(part)
        for part in zip(*[(t, w, a, np.flatnonzero(i)) for t, w, a, i in parts], strict=True)
    )
    true = Trajectory(time, way, attitude_from_angles(*angles.T))
    wrong = angles + series.attitude[inside]
    recorded = Trajectory(
        time,
        way + series.position[inside],
        attitude_from_angles(*wrong.T),
        stated_sigma(time),
        np.tile(np.radians([0.02, 0.02, 0.1]), (len(time), 1)),
    )
    return true, recorded


def survey_of(true, recorded, number, rng):
    """FeatureSurvey with some control points beside the road, each seen in both passes."""
    (first, last), (begin, end) = true.passes[:2]
    times = np.linspace(first + 4.0, last - 4.0, TARGETS)
    kept = np.unique(np.linspace(0, TARGETS - 1, number).round().astype(int))
    times = times[kept]
    aside = np.resize([-6.0, 9.0, 7.0, -8.0], TARGETS)[kept]
    pose = true.at(times)
    place = pose.position + pose.attitude.apply(
        np.column_stack([aside, np.zeros(len(aside)), np.ones(len(aside))])
    )
    back = (true.gps_time > begin) & (true.gps_time < end)
    away = np.linalg.norm(true.position[back] - place[:, None], axis=2)
    seen = np.concatenate([times, true.gps_time[back][away.argmin(axis=1)]])
    twice = np.concatenate([place, place])
    body = true.at(seen).attitude.inv().apply(twice - true.at(seen).position)
    centre = recorded.at(seen).position + recorded.at(seen).attitude.apply(body)
    centre = centre + EXTRACTION * rng.standard_normal(centre.shape)
    name = tuple(f"T{i:02d}" for i in kept)
    up = np.tile([0.0, 0.0, 1.0], (len(kept), 1))
    shape = ("circle",) * len(kept), np.full(len(kept), 0.6)
    surveyed = place + SURVEYED * rng.standard_normal(place.shape)
    control = ControlPoints(name, surveyed, np.full((len(kept), 3), SURVEYED), *shape, up)
    n = len(seen)
    order = np.argsort(seen)
    observations = TargetObservations(
        name * 2,
        np.repeat([1, 2], len(kept)),
        seen,
        centre,
        np.tile(EXTRACTION**2 * np.eye(3), (n, 1, 1)),
        np.tile(up, (2, 1)),
        shape[0] * 2,
        np.tile(shape[1], 2),
        np.full(n, 300),
    )[order]
    return FeatureSurvey(true, recorded, control, observations, control, observations)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--control", type=int, nargs="+", default=[0, 3, 6, 12])
    parser.add_argument("--wrong", type=float, default=0.05, help="share of wrong ties")
    arguments = parser.parse_args()
    shared = Path(os.environ.get("MLSCORR_SHARED", Path(__file__).parents[2] / "shared"))
    series = read_pos_error_series(shared / "data/real_pos_error/OB_GINS_TXT.err")
    print("control  window   alone  within    ties  within   ratio")
    for number in arguments.control:
        rows = []
        for seed, first in enumerate(FIRST):
            true, recorded = drive(series, first)
            survey = survey_of(true, recorded, max(number, 1), np.random.default_rng(seed))
            with warnings.catch_warnings(action="ignore"):
                if number:
                    estimate = estimate_correction(recorded, survey.matched)
                else:
                    estimate = prior_correction(recorded, Pos())
                ties = feature_ties(survey, seed, STREET, arguments.wrong)
                tied = with_ties(estimate, ties).correction
            alone = measure(survey, estimate.correction)
            after = measure(survey, tied)
            rows.append((alone[0], after[0]))
            print(
                f"{number:7d}{first:9.0f}{alone[0]:8.3f}{alone[1]:8.0%}{after[0]:8.3f}"
                f"{after[1]:8.0%}{after[0] / alone[0]:8.2f}",
                flush=True,
            )
        alone, after = np.median(rows, axis=0)
        print(f"{number:7d}   median{alone:8.3f}        {after:8.3f}")


if __name__ == "__main__":
    main()
