"""The command that lists target-like objects."""

import json

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Json, Out, Overwrite, Quiet, SurveyFile, exit_code, say


def extract(
    survey: SurveyFile,
    out: Out,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """List all target-like objects in the cloud of a survey, with or without control points."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files, read_survey

        check_output(out, input_files(survey), overwrite)
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        recorded = read_survey(survey)
        from mlscorr.pipeline import extract

        found = extract(recorded, progress=progress).write(out, overwrite)
    if as_json:
        print(json.dumps(found))
    _tell(found, out)


def _tell(found, out):
    """How many objects were found and matched, and where the results lie."""
    targets = found["targets"]
    matched = sum(row["matched"] for row in targets)
    say(f"{len(targets)} target-like objects in {len({row['pass'] for row in targets})} passes.")
    if found["surveyed"]:
        points = len({row["name"] for row in targets if row["matched"]})
        say(
            f"{matched} of them are observations of {points} of the {found['surveyed']} surveyed "
            "points."
        )
    for row in found["unseen"]:
        say(f"Not found: {row['name']}: {row['reason']}")
    say(f"Targets:  {out / 'targets.csv'} and {out / 'targets.json'}")
    say(f"Pictures: {out / 'targets.png'}")
