"""Commands: reading, calling the pipeline, and writing; nothing else."""

import logging
import os
import warnings
from importlib import import_module
from importlib.metadata import version
from typing import Annotated

import typer

from mlscorr.cli.blind import blind
from mlscorr.cli.project import STATUS_EXAMPLES, status
from mlscorr.cli.terminal import as_epilog, deafen, listen, warn

COMMANDS = (  # one module each, in the order of the overview
    *("init", "check", "correct", "extract", "ties", "calibrate", "compare", "render", "demo"),
    *("simulate", "diagnose", "apply", "plan", "doctor"),
)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for name in COMMANDS:
    module = import_module(f"mlscorr.cli.{name}")
    app.command(epilog=as_epilog(module.EXAMPLES))(getattr(module, name))
app.command(epilog=as_epilog(STATUS_EXAMPLES))(status)
app.add_typer(blind, name="blind")


def _show_version(is_asked):
    if is_asked:
        print(version("mlscorr"))
        raise typer.Exit


@app.callback()
def options(
    is_version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Correct mobile laser scans with surveyed targets by least squares collocation."""


def main() -> None:
    """Entry point of the command line."""
    listen()
    os.environ["RUST_BACKTRACE"] = "0"  # of a decoder with a damaged file
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # of a home without space for its cache
    warnings.showwarning = lambda message, *_, **__: warn(f"Warning: {message}")
    try:
        app()
    finally:
        deafen()
