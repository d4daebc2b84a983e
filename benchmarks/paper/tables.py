"""Arguments, simulated surveys and comparison tables shared by the scripts of this folder.

The paper is Mao et al. 2015, Remote Sensing 7(6), 7402-7424, doi:10.3390/rs70607402.
"""

import argparse
import sys
import warnings
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "examples" / "scenarios"
AXES = ("East", "North", "Height")
INTERVAL = (50.0, 16.0, 84.0)  # percentiles: median, and one sigma to each side
sys.path.append(str(ROOT / "benchmarks"))  # where surveys are simulated without a cloud


def parse(arguments, description, picture):
    """Arguments of the scripts: number of seeds, and path of the picture."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20, help="simulated surveys (default: 20)")
    parser.add_argument("--picture", type=Path, default=ROOT / "build" / "pictures" / picture)
    given = parser.parse_args(arguments)
    given.picture.parent.mkdir(parents=True, exist_ok=True)
    return given


@cache
def survey_of(name, seed):
    """FeatureSurvey of a scenario of this project: target centers with noise, and the truth."""
    from feature_surveys import feature_survey

    from mlscorr.simulate import read_scenario

    return feature_survey(read_scenario(SCENARIOS / f"{name}.toml"), seed)


def quietly(function, *arguments, **options):
    """Call a function without its warnings, because few control points are intended here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*arguments, **options)


def rms(residuals):
    """Root mean square (3,) of residuals (n, 3)."""
    return np.sqrt(np.mean(np.square(residuals), axis=0))


def middle(values):
    """Median over the seeds: the first axis."""
    return np.median(values, axis=0)


def told(values, digits=4, factor=1.0):
    """Median and 16-84 % interval of one number over the seeds, as text."""
    median, low, high = factor * np.percentile(values, INTERVAL)
    return f"{median:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def paper_numbers(numbers, digits=4):
    """Numbers of the paper as one cell."""
    return " ".join(f"{number:.{digits}f}" for number in np.atleast_1d(numbers))


def told_axes(values):
    """Medians of E, N, H (seeds, 3) in one cell, and the interval of the length of all three."""
    length = np.sqrt(np.sum(np.square(values), axis=1))
    _, low, high = np.percentile(length, INTERVAL)
    return f"{paper_numbers(middle(values))} |{low:.3f}-{high:.3f}|"


def show(title, head, rows, note=""):
    """Print a table of text with columns as wide as their longest cell."""
    table = [head, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(head))]
    print(f"\n{title}")
    for row in table:
        print(
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        )
    if note:
        print(note)


def introduce(what, seeds):
    """Print a note on the source of each number."""
    print(
        f"{what}: {seeds} seeds of a simulated clone, not the paper's data. Columns headed 'paper' "
        "are printed\nin Mao et al. 2015; all others are measured here: medians over the seeds, "
        "[16 %, 84 %] of one number,\n|16 %-84 %| of the length of the E, N, H vector. RMS in m."
    )
