"""Correct a survey in Python, and draw its effect on the check point with the largest error.

    python benchmarks/pictures/correct_a_survey.py [SURVEY] [--out FOLDER] [--picture FILE.png]

SURVEY is a survey.toml or its folder. Without it a small survey is simulated: a street, a drive
in which GNSS fails for 11 s in a canyon and for 25 s, and 24 targets, of which 8 are check points.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import mlscorr
from mlscorr.io.clouds import read_chunks

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
REACH = 1.2  # m, drawn about the surveyed target


def main():
    arguments = parse()
    with tempfile.TemporaryDirectory() as scratch:
        path = arguments.survey or simulated(Path(scratch))

        # The whole task takes three lines.
        survey = mlscorr.read_survey(path)
        result = mlscorr.correct(survey)
        report = result.write(arguments.out or Path(scratch) / "corrected")

        for name in ("control", "check"):
            before, after = (
                np.round(report[name][when]["rmse"], 3) for when in ("before", "after")
            )
            print(f"{name}: n = {report[name]['n']}, RMSE E/N/H {before} -> {after} m")
        draw(survey, result, arguments.picture)
        print(f"Picture: {arguments.picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("survey", nargs="?", type=Path)
    parser.add_argument("--out", type=Path, help="keep the results in this folder")
    parser.add_argument("--picture", type=Path, default=PICTURES / "correct_a_survey.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


def simulated(folder):
    """A small simulated survey, the same each time."""
    from mlscorr.simulate import DEMO, simulate

    simulate(DEMO, np.random.default_rng(1)).write(folder)
    return folder


def draw(survey, result, picture):
    """Draw a close-up of one check point before and after, above the correction over time."""
    worst = farthest(survey, result)
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    close_ups = upper.subplots(1, 2, sharex=True, sharey=True)
    cloud = points_near(survey, worst)
    views = ((cloud, "before"), (result.estimate.correction.apply(cloud), "after"))
    for axes, (points, when) in zip(close_ups, views, strict=True):
        draw_target(axes, survey, points, worst, when)
    draw_correction(lower.subplots(), result)
    figure.savefig(picture, dpi=110)


def farthest(survey, result):
    """Row of the target with the largest error; a check point and a circle if there is one."""
    surveyed = survey.surveyed
    kind = dict(zip(surveyed.name, surveyed.kind, strict=True))
    rows = [row for row in result.targets if row.is_observed]
    return max(
        rows,
        key=lambda row: (
            row.role == "check",
            kind[row.name] == "circle",
            np.linalg.norm(row.before),
        ),
    )


def points_near(survey, row):
    """Points of the recorded cloud about a target, at the time of its sighting."""
    reach = REACH + np.linalg.norm(row.before)
    for file in survey.clouds:
        for chunk in read_chunks(file):
            near = np.linalg.norm(chunk.xyz - row.surveyed, axis=1) < reach
            near &= np.abs(chunk.gps_time - row.gps_time) < 2.0
            if near.any():
                return chunk[near]
    raise ValueError(f"No point lies near {row.name}.")


def draw_target(axes, survey, points, row, when):
    """Draw points about a target, and its surveyed outline, in the target's plane."""
    if row.role == "check":
        surveyed = survey.check
    else:
        surveyed = survey.control
    index = surveyed.name.index(row.name)
    normal = surveyed.normal[index]
    if not np.isfinite(normal).all():
        bright = points.xyz[points.intensity > np.percentile(points.intensity, 90)]
        normal = np.linalg.svd(bright - bright.mean(axis=0), full_matrices=False)[2][2]
    across = np.cross([0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [0.0, 1.0, 0.0], normal)
    across /= np.linalg.norm(across)
    local = (points.xyz - row.surveyed) @ np.column_stack([across, np.cross(normal, across)])
    order = np.argsort(points.intensity)
    axes.scatter(*local[order].T, c=points.intensity[order], s=9, cmap="cividis", linewidths=0)
    half = surveyed.size[index] / 2
    turn = np.linspace(0, 2 * np.pi, 200)
    if surveyed.kind[index] == "circle":
        radius = half
    else:
        radius = half / np.maximum(np.abs(np.cos(turn)), np.abs(np.sin(turn)))
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="#d55e00", lw=2, label="surveyed")
    axes.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH), aspect="equal", xlabel="in the plane (m)")
    misclosure = np.linalg.norm(getattr(row, when))
    axes.set_title(f"{when.capitalize()}: {row.role} point {row.name} is {misclosure:.3f} m off")
    axes.legend(loc="lower left")


def draw_correction(axes, result):
    """Draw corrected - recorded position over time, with its sigma band and the control epochs."""
    recorded = result.estimate.correction.recorded
    corrected = result.trajectory
    time = recorded.gps_time - recorded.gps_time[0]
    for axis, color in zip(range(3), ("#0072b2", "#e69f00", "#009e73"), strict=True):
        change = corrected.position[:, axis] - recorded.position[:, axis]
        sigma = corrected.position_sigma[:, axis]
        axes.fill_between(time, change - sigma, change + sigma, color=color, alpha=0.25, lw=0)
        axes.plot(time, change, color=color, label=("east", "north", "height")[axis])
    epochs = result.matched_control.gps_time[result.estimate.used] - recorded.gps_time[0]
    axes.plot(epochs, np.zeros(len(epochs)), "k|", ms=14, label="control point seen")
    axes.set(xlabel="time since the start (s)", ylabel="m", xlim=(time[0], time[-1]))
    axes.set_title("Correction of the POS position over time, with 1 sigma")
    axes.legend(ncols=4, loc="upper left")


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:  # of the input: a sentence says it
        sys.exit(f"Error: {error}")
