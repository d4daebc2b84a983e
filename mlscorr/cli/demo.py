"""Command for new users."""

from pathlib import Path
from typing import Annotated

import typer

from mlscorr.cli.correct import report_result
from mlscorr.cli.terminal import Json, Overwrite, Quiet, Verbose, path_or_url, say
from mlscorr.cli.work import work

EXAMPLES = (
    "mlscorr demo",
    "mlscorr demo -o demo-2 --seed 2",
)


def demo(
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Folder for the results.", parser=path_or_url)
    ] = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated survey.")] = 1,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Make a small simulated survey, correct it, and show the report."""
    with work(out, overwrite) as progress:
        from mlscorr.pipeline import demo

        say("Simulating a street, a drive with two GNSS outages, and a scanner ...")
        report = demo(out, seed, overwrite, progress)
    report_result(report, out / "corrected", as_json)
