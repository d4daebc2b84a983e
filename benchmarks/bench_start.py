"""Time until a user sees the first output, compared with the start of Python and numpy.

    python benchmarks/bench_start.py

Commands run in turn, and medians count. The disk is warm; the first start after an installation
also compiles bytecode.
"""

import argparse
import subprocess
import sys
from statistics import median
from time import perf_counter

from rich.console import Console
from rich.table import Table

ROUNDS = 9
COMMANDS = {
    "python": ["-c", "pass"],
    "import numpy": ["-c", "import numpy"],
    "import mlscorr": ["-c", "import mlscorr"],
    "mlscorr --version": ["-m", "mlscorr", "--version"],
    "mlscorr correct nosuch": ["-m", "mlscorr", "correct", "nosuch", "-o", "nothing"],
}
GOALS = {"import mlscorr": "< 0.3 s", "mlscorr correct nosuch": "<= 1.0 s"}


def main():
    seconds = {name: [] for name in COMMANDS}
    for _ in range(ROUNDS):
        for name, command in COMMANDS.items():
            start = perf_counter()
            subprocess.run([sys.executable, *command], check=False, capture_output=True)
            seconds[name].append(perf_counter() - start)
    table = Table("until the first word", "s", "times import numpy", "goal")
    unit = median(seconds["import numpy"])
    for name, values in seconds.items():
        middle = median(values)
        table.add_row(name, f"{middle:.2f}", f"{middle / unit:.1f}", GOALS.get(name, ""))
    Console(width=100).print(table)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
