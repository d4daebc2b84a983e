"""The command that a new user runs first."""

from pathlib import Path
from typing import Annotated

import typer

from mlscorr.cli.correct import tell
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Json, Out, Overwrite, Quiet, exit_code, say


def demo(
    out: Out = Path("demo"),
    seed: Annotated[int, typer.Option(help="Of the simulated survey.")] = 1,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Make a small simulated survey, correct it, and show the report."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output

        check_output(out, [], overwrite)
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.pipeline import demo

        say("Simulating a street, a drive with a GNSS outage, and a scanner ...")
        report = demo(out, seed, overwrite, progress)
    tell(report, out / "corrected", as_json)
