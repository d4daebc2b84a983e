"""The command that diagnoses the gap between a survey and its simulation."""

from pathlib import Path
from typing import Annotated

import typer

import mlscorr
from mlscorr.cli.terminal import (
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyArgument,
    exit_code,
    say,
    say_statements,
)
from mlscorr.cli.work import print_json, work


def diagnose(
    survey: SurveyArgument,
    out: Out,
    simulator: Annotated[
        Path | None,
        typer.Option(
            "--simulator",
            help="simulator.toml: what is believed already, as an earlier run wrote it.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find where reality and simulation differ, why, and how far the gap can be closed."""
    with exit_code(Exit.USAGE):
        from mlscorr.simulate.simulator_file import read_simulator

        believed = read_simulator(simulator) if simulator else None
    with work(out, overwrite, survey, [simulator] if simulator else []) as progress:
        recorded = mlscorr.read_survey(survey)
        content = mlscorr.diagnose(recorded, believed, progress=progress).write(out, overwrite)
    print_json(content, as_json)
    _tell(content)
    say(f"Page:      {out / 'gap.html'}")
    say(f"Numbers:   {out / 'gap.json'}")
    say(f"Simulator: {out / 'simulator.toml'}")


def _tell(content):
    """What stands first, and what to do."""
    say_statements(content["statements"])
    for number, sentence in enumerate(content["advice"], start=1):
        say(f"{number}. {sentence}")
