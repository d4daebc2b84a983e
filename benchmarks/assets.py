"""Redraw the pictures of README.md and docs, and report which ones have changed.

    python benchmarks/assets.py [NAME ...] [--write]

By default only pictures that need no external data are drawn, which takes some minutes; others can
be named: those of the paper and of decision costs take hours, those of real data need the files
that their scripts name. The same code draws the same file, byte for byte, on one machine; letters
and the last figure of a sum may differ on another. So a picture has changed where its size has, or
where more than 1 % of its pixels differ by more than 16 of 255 in a channel: a moved letter is
less, a moved curve more. --write keeps the new ones; without it the exit code is 1 where one has
changed.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
ASSETS = ROOT / "assets"
SCRIPTS = {  # picture: (script, whether it is drawn without being named)
    "correct_a_survey": ("benchmarks/pictures/correct_a_survey.py", True),
    "compare_methods": ("benchmarks/pictures/compare_methods.py", True),
    "render_before_after": ("benchmarks/pictures/render_before_after.py", True),
    "calibrate_mounting": ("benchmarks/pictures/calibrate_mounting.py", True),
    "diagnose": ("benchmarks/pictures/diagnose_gap.py", True),
    "decision_costs": ("benchmarks/decision_costs.py", False),
    "control_sigma": ("benchmarks/pictures/control_sigma.py", True),
    "ties_gain": ("benchmarks/pictures/ties_gain.py", True),
    "plan": ("benchmarks/pictures/plan.py", True),
    "targets": ("benchmarks/pictures/targets.py", True),
    "certificate": ("benchmarks/pictures/certificate.py", True),
    "pos_error": ("benchmarks/pictures/pos_error.py", False),
    "paper_car": ("benchmarks/paper/car.py", False),
    "paper_boat": ("benchmarks/paper/boat.py", False),
    "paper_calibration": ("benchmarks/paper/calibration.py", False),
    "real_pos_gap": ("benchmarks/real/pos_gap.py", False),
    "two_pass_gap": ("benchmarks/real/two_pass_gap.py", False),
}
DIAGRAMS = (  # drawn by one script, which the name of the picture tells what to draw
    *("commands", "folder", "install", "workflow", "stages", "frames", "north", "two_scanners"),
    *("overlap", "city", "cluster", "object_store", "control_list", "clouds", "ground_scale"),
    *("own_simulator", "blind", "atomic"),
)
SCRIPTS |= dict.fromkeys(DIAGRAMS, ("benchmarks/pictures/diagrams.py", True))
# of 255, of the pixels: see above
CHANNEL = 16
SHARE = 0.01


def share_changed(old: Path, new: Path) -> float:
    """Share of the pixels that differ between two pictures; one if their sizes differ."""
    pixels = [np.asarray(Image.open(path).convert("RGB"), dtype=int) for path in (old, new)]
    if pixels[0].shape != pixels[1].shape:
        return 1.0
    return float((np.abs(pixels[0] - pixels[1]).max(axis=2) > CHANNEL).mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SCRIPTS))
    parser.add_argument("--write", action="store_true", help="keep those that have changed")
    arguments = parser.parse_args()
    if unknown := set(arguments.names) - set(SCRIPTS):
        parser.error(f"{', '.join(sorted(unknown))}: none of {', '.join(SCRIPTS)}")
    names = arguments.names or [name for name, (_, usual) in SCRIPTS.items() if usual]
    with tempfile.TemporaryDirectory() as folder:
        changed = [draw(name, Path(folder), arguments.write) for name in names]
    sys.exit(any(changed) and not arguments.write)


def draw(name, folder, write):
    """Draw a picture and compare it with the old one; return True if it has changed."""
    new = folder / f"{name}.png"
    old = ASSETS / f"{name}.png"
    command = [sys.executable, ROOT / SCRIPTS[name][0], "--picture", new]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    share = share_changed(old, new)
    word = "has changed" if share > SHARE else "looks the same"
    print(f"{name}: {word} ({100 * share:.2f} % of its pixels)", flush=True)
    if write and share > SHARE:
        old.write_bytes(new.read_bytes())
    return share > SHARE


if __name__ == "__main__":
    main()
