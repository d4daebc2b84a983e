"""The command that diagnoses the gap between a survey and its simulation."""

import json
from pathlib import Path
from typing import Annotated

import typer

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Json, Out, Overwrite, Quiet, SurveyFile, exit_code, say


def diagnose(
    survey: SurveyFile,
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
):
    """Find where reality and simulation differ, why, and how far the gap can be closed."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files
        from mlscorr.simulate.beliefs import read_simulator

        check_output(out, [*input_files(survey), *([simulator] if simulator else [])], overwrite)
        believed = read_simulator(simulator) if simulator else None
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.io.survey_file import read_survey

        recorded = read_survey(survey)
        from mlscorr.pipeline import diagnose

        content = diagnose(recorded, believed, progress=progress).write(out, overwrite)
    if as_json:
        print(json.dumps(content))
    _tell(content)
    say(f"Page:      {out / 'gap.html'}")
    say(f"Numbers:   {out / 'gap.json'}")
    say(f"Simulator: {out / 'simulator.toml'}")


def _tell(content):
    """Verdict, where, how far, and what to do."""
    verdict, closure = content["verdict"], content["closure"]
    say(verdict["sentence"])
    if verdict["same"]:
        say(f"This survey can't tell it from: {', '.join(verdict['same'])}.")
    say(content["headline"])
    if closure["effect"] != "none":
        low, high = closure["interval"]
        say(
            f"With {closure['effect']} in the simulator the gap goes from {closure['before']:.2f} "
            f"to {closure['after']:.2f} {closure['unit']} on data not used to find it: "
            f"{100 * closure['shrink']:.0f} % of its square ({100 * low:.0f} to {100 * high:.0f})."
        )
    for number, sentence in enumerate(content["advice"], start=1):
        say(f"{number}. {sentence}")
