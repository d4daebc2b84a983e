"""Command that lists target-like objects."""

import mlscorr
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.terminal import (
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyArgument,
    Verbose,
    say,
    say_results,
)
from mlscorr.cli.work import print_json, work
from mlscorr.wording import counted

EXAMPLES = (
    "mlscorr extract survey.toml",
    "mlscorr extract survey.toml -o targets --json",
)


def extract(
    survey: SurveyArgument,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """List all target-like objects in the cloud of a survey, with or without control points."""
    out = chosen_out(out, survey, "extract")
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey)
        content = mlscorr.extract(recorded, progress=progress).write(out, overwrite)
    print_json(content, as_json)
    targets = content["targets"]
    matched = sum(row["matched"] for row in targets)
    say(f"{counted(len(targets), 'target-like object')} found.")
    if content["surveyed"]:
        points = len({row["name"] for row in targets if row["matched"]})
        say(f"{matched} of them match {points} of the {content['surveyed']} surveyed points.")
    for row in content["unseen"]:
        say(f"No target: {row['name']}: {row['reason']}")
    tables = f"{out / 'targets.csv'} and {out / 'targets.json'}"
    say_results([("Targets", tables), ("Pictures", out / "targets.png")])
