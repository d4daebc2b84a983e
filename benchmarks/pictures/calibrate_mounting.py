"""Calibrate lever arm and boresight in Python, and draw their effect on the check points.

    python benchmarks/pictures/calibrate_mounting.py [SURVEY] [--out FOLDER] [--picture FILE.png]

SURVEY is a survey.toml or its folder, with a [mounting]. Without it a small survey is simulated:
two passes in opposite directions past 24 targets, of which 12 are check points, with the wrong
mounting that Mao et al. (2015) found in their Table 6.
"""

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import mlscorr
from mlscorr.estimate import MOUNTING_COMPONENTS as COMPONENTS
from mlscorr.evaluate import misclosures

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
WRONG = (
    {"name": "lever_arm", "magnitude": [0.0004, 0.0145, -0.0642]},  # m: right, forward, up
    {"name": "boresight", "magnitude": [-0.0307, -0.0561, 0.2077]},  # deg
)
BLACK = "#000000"
ORANGE = "#e69f00"
BLUE = "#0072b2"
GREEN = "#009e73"


def main():
    arguments = parse()
    with tempfile.TemporaryDirectory() as scratch:
        path = arguments.survey or simulated(Path(scratch))

        # The whole task takes three lines.
        survey = mlscorr.read_survey(path)
        result = mlscorr.calibrate(survey)
        content = result.write(arguments.out or Path(scratch) / "calibrated")

        lsc = content["lsc"]
        for part, unit in (("lever_arm", "m"), ("boresight", "deg")):
            numbers = np.round([lsc[part]["correction"], lsc[part]["sigma"]], 4)
            print(f"{part} lacks {numbers[0]} {unit}, sigma {numbers[1]} {unit}")
        before, after = (np.round(lsc["check"][when]["rmse"], 4) for when in ("before", "after"))
        print(f"check: n = {lsc['check']['n']}, RMSE E/N/H {before} -> {after} m")
        draw(survey, result, None if arguments.survey else WRONG, arguments.picture)
        print(f"Picture: {arguments.picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("survey", nargs="?", type=Path)
    parser.add_argument("--out", type=Path, help="keep the results in this folder")
    parser.add_argument("--picture", type=Path, default=PICTURES / "calibrate_mounting.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


def simulated(folder):
    """A small simulated survey, the same each time."""
    from mlscorr.simulate import Scenario, simulate

    scenario = Scenario(
        drive={"duration": 30.0, "speed": 4.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 12, "check": 12, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        effects=WRONG,
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)
    return folder


def draw(survey, result, truth, picture):
    """The components with their sigmas, and the check points before and after."""
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.1))
    calibration = result.calibration
    scales = (1e3, 180 / np.pi)
    units = ("mm", "deg")
    for part, axes in enumerate(upper.subplots(1, 2)):
        rows = slice(3 * part, 3 * part + 3)
        draw_components(axes, calibration, rows, scales[part], truth and truth[part]["magnitude"])
        axes.set_ylabel(f"correction of the recorded mounting ({units[part]})")
        axes.set_title(("Lever arm", "Boresight")[part])
        axes.grid(axis="y", color="#e4e4e4")
        axes.set_axisbelow(True)
    draw_misclosures(lower.subplots(1, 3, sharey=True), survey, result)
    figure.savefig(picture, dpi=110)


def draw_components(axes, calibration, rows, scale, truth):
    """Draw three components by both methods with 2 sigma, and the truth if known."""
    place = np.arange(3)
    for method, color, aside in (("ls", ORANGE, -0.12), ("lsc", BLUE, 0.12)):
        estimate = getattr(calibration, method)
        title = {"ls": "least squares", "lsc": "collocation"}[method]
        axes.errorbar(
            place + aside,
            scale * estimate.correction[rows],
            2 * scale * estimate.sigma[rows],
            fmt="o",
            capsize=4,
            color=color,
            label=f"{title}, with 2 sigma",
        )
    if truth is not None:
        known = np.multiply(truth, 1e3 if rows.start == 0 else 1.0)
        axes.hlines(known, place - 0.3, place + 0.3, BLACK, "dashed", label="truth")
    names = [name.split()[-1] for name in COMPONENTS[rows]]
    told = calibration.determined[rows]
    about = "" if rows.start == 0 else "about "
    labels = [
        f"{about}{name}" + ("" if yes else "\nnot determined\nby this geometry")
        for name, yes in zip(names, told, strict=True)
    ]
    axes.set_xticks(place, labels)
    axes.set_xlim(-0.5, 2.5)
    axes.legend(loc="best", fontsize=8)


def draw_misclosures(axes, survey, result):
    """Draw check points in body axes, in which a wrong mounting appears as one shift."""
    matched = result.matched_check
    role = "Check points"
    if len(matched) == 0:
        matched = result.matched_control
        role = "Control points"
    to_body = survey.trajectory.at(matched.gps_time).attitude.inv()
    before = to_body.apply(matched.misclosure)
    after = to_body.apply(misclosures(matched, result.calibration.correction()))
    time = matched.gps_time - survey.trajectory.gps_time[0]
    for axis, name in enumerate(("right", "forward", "up")):
        axes[axis].axhline(0.0, color=BLACK, lw=0.8)
        axes[axis].plot(time, 1e3 * before[:, axis], "o", color=ORANGE, ms=4, label="before")
        axes[axis].plot(time, 1e3 * after[:, axis], "o", color=GREEN, ms=4, label="after")
        rmse = [np.sqrt(np.mean(values[:, axis] ** 2)) * 1e3 for values in (before, after)]
        axes[axis].set_title(f"{role}, {name}: RMSE {rmse[0]:.0f} to {rmse[1]:.0f} mm")
        axes[axis].set_xlabel("time since the start (s)")
    axes[0].set_ylabel("surveyed - observed (mm)")
    axes[0].legend(loc="best", fontsize=8)


if __name__ == "__main__":
    try:
        with warnings.catch_warnings(action="ignore"):  # the picture says what isn't determined
            main()
    except (ValueError, OSError) as error:  # of the input: a sentence says it
        sys.exit(f"Error: {error}")
