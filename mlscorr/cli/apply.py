"""Command that removes known errors from a survey."""

from typing import Annotated

import typer

import mlscorr
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import (
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyArgument,
    Verbose,
    exit_code,
    say_results,
)
from mlscorr.cli.work import print_json, work

EXAMPLES = (
    "mlscorr apply survey.toml gap/gap.json",
    "mlscorr apply survey.toml time_offset=0.005 -o moved",
)


def apply(
    survey: SurveyArgument,
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="EFFECT",
            help="gap.json or calibration.json, or NAME=SIZE: time_offset=0.005 (s), "
            "lever_arm=0,0.1,0 (m: right,forward,up), boresight=0.1,0,0 (deg), "
            "horizontal_datum=0.2,-0.1 (m: E,N), vertical_datum=15.3 (m).",
        ),
    ],
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Remove a clock offset, datum or mounting error that was found from clouds and trajectory."""
    out = chosen_out(out, survey, "apply")
    with exit_code(Exit.USAGE), progress_bars():
        import numpy as np

        from mlscorr.pipeline import read_effects

        effects = [read_effects(source) for source in sources]
    with work(out, overwrite, survey) as progress:
        applied = mlscorr.apply(mlscorr.read_survey(survey), effects)
        content = applied.write(out, overwrite, progress)
    print_json(content, as_json)
    results = []
    for effect in applied.effects:
        sizes = ", ".join(f"{size:.4g}" for size in np.atleast_1d(effect.magnitude))
        unit = effect.quantities()["magnitude"].unit
        results.append(("Removed", f"{effect.name} {sizes} {unit}"))
    results.append(("Survey", f"{out / 'survey.toml'} and its clouds"))
    say_results(results)
    if any(file["untouched"] for file in content["files"]):
        raise typer.Exit(Exit.IN_PART)
