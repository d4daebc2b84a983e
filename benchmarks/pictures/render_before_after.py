"""Draw a survey before and after its correction, and combine three of the pictures.

    python benchmarks/pictures/render_before_after.py [SURVEY] [--out FOLDER] [--picture FILE.png]

SURVEY is a survey.toml or its folder. Without it the survey wuhan_drive is taken where it is at
hand (in ../shared/surveys or $MLSCORR_SHARED/surveys), else a small one is simulated.
"""

import argparse
import os
import sys
import tempfile
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread

import mlscorr
from mlscorr.report.render import PictureOptions, draw, panel_size

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("MLSCORR_SHARED") or ROOT.parent / "shared")
PAGE = (1600, 900)  # pixels


def main():
    arguments = parse()
    with tempfile.TemporaryDirectory() as scratch:
        path = arguments.survey or at_hand() or simulated(Path(scratch))
        survey = mlscorr.read_survey(path)
        result = mlscorr.correct(survey)
        targets = result.targets
        options = PictureOptions(panel_size(PAGE), panel_size(PAGE, stacked=True))
        pictures = list(draw(survey, result.estimate.correction, targets, options))
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        for picture in pictures:
            (arguments.out / f"{picture.name}.png").write_bytes(picture.page(PAGE))
    chosen = [p for p in pictures if p.name in ("overview", "section", farthest(targets))]
    for picture in chosen:
        print(picture.view.title)
    together(chosen, arguments.picture)
    print(f"Picture: {arguments.picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("survey", nargs="?", type=Path)
    parser.add_argument("--out", type=Path, help="write every picture into this folder")
    parser.add_argument(
        "--picture", type=Path, default=ROOT / "build/pictures/render_before_after.png"
    )
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


def at_hand():
    """A recorded survey, if there is one."""
    path = SHARED / "surveys" / "wuhan_drive"
    if path.exists():
        return path
    return None


def simulated(folder):
    """A small simulated survey, the same each time."""
    from mlscorr.simulate import DEMO, simulate

    simulate(DEMO, np.random.default_rng(1)).write(folder)
    return folder


def farthest(targets):
    """Name of the picture of the check point with the largest error."""
    observed = [row for row in targets if row.is_observed]
    worst = max(observed, key=lambda row: (row.role == "check", np.linalg.norm(row.before)))
    return f"target-{worst.name}"


def together(pictures, path):
    """Stack the pages of some pictures in one PNG."""
    width, height = PAGE
    figure = Figure(figsize=(width / 100, len(pictures) * height / 100), dpi=100)
    for k, picture in enumerate(pictures):
        page = imread(BytesIO(picture.page(PAGE)))
        figure.figimage(page, 0, (len(pictures) - 1 - k) * height)
    figure.savefig(path, dpi=100, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:  # of the input: a sentence says it
        sys.exit(f"Error: {error}")
