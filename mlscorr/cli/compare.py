"""The command that compares all methods on one survey."""

import json
from typing import Annotated

import typer

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import (
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyFile,
    exit_code,
    say,
    warn,
)


def compare(
    survey: SurveyFile,
    out: Out,
    clouds: Annotated[
        list[str],
        typer.Option(
            metavar="METHOD",
            help="Write the cloud as this method corrects it into a folder of its name; may be "
            "given several times.",
        ),
    ] = (),
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Correct a survey by every method, and score them by the same check points."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files, read_survey
        from mlscorr.pipeline.methods import method_named

        clouds = list(dict.fromkeys(method_named(name).name for name in clouds))
        check_output(out, input_files(survey), overwrite)
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        recorded = read_survey(survey)
        from mlscorr.pipeline import compare

        result = compare(recorded, progress=progress)
        report = result.write(out, clouds, overwrite, progress)
    tell(report, out, as_json)
    left = [file for file in report["files"] if file["points_outside_trajectory"]]
    for file in left:
        warn(
            f"{file['points_outside_trajectory']} of {file['points']} points of {file['name']} lie "
            "outside the trajectory or in its gaps and were left as they were."
        )
    if left:
        raise typer.Exit(Exit.IN_PART)


def tell(report, out, as_json):
    """The table of scores, the verdict, and where the results lie."""
    if as_json:
        print(json.dumps(report))
    by = report["scored_by"]
    say(report["basis"])
    say(f"{'RMSE (m)':16s}{'E':>8s}{'N':>8s}{'H':>8s}{'3D':>9s}{'fit, 3D':>9s}")
    scored = [row for row in report["methods"] if row[by]["rmse"] is not None]
    for row in sorted(scored, key=lambda row: row[by]["rmse_3d"]):
        axes = "".join(f"{value:8.3f}" for value in row[by]["rmse"])
        say(f"{row['name']:16s}{axes}{row[by]['rmse_3d']:9.3f}{row['control']['rmse_3d']:9.3f}")
    for row in report["methods"]:
        if row[by]["rmse"] is None:
            say(f"{row['name']:16s}not determined: {row['why'] or row[by].get('why') or ''}")
    for sentence in report["verdict"]:
        say(sentence)
    say(f"Report: {out / 'compare.html'}")
    for file in report["files"]:
        say(f"Cloud:  {out / file['name']}")
