"""Folders of the parts of the project."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"
EXAMPLES = ROOT / "examples"
MLSCORR = Path(sys.executable).with_name("mlscorr")  # the command
