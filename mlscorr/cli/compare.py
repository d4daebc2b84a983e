"""The command that compares all methods on one survey."""

from typing import Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.work import print_json, work


def compare(
    survey: terminal.SurveyArgument,
    out: terminal.Out,
    clouds: Annotated[
        list[str],
        typer.Option(
            metavar="METHOD",
            help="Write the cloud as this method corrects it into a folder of its name; may be "
            "given several times.",
        ),
    ] = (),
    overwrite: terminal.Overwrite = False,
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
) -> None:
    """Correct a survey by every method, and score them by the same check points."""
    with terminal.exit_code(terminal.Exit.USAGE):
        from mlscorr.pipeline import method_named

        clouds = list(dict.fromkeys(method_named(name).name for name in clouds))
    with work(out, overwrite, survey) as progress:
        result = mlscorr.compare(mlscorr.read_survey(survey), progress=progress)
        report = result.write(out, clouds, overwrite, progress)
    print_json(report, as_json)
    _tell(report, out)
    left = [file for file in report["files"] if file["points_outside_trajectory"]]
    for file in left:
        terminal.warn(
            f"{file['points_outside_trajectory']} of {file['points']} points of {file['name']} lie "
            "outside the trajectory or in its gaps and were left as they were."
        )
    if left:
        raise typer.Exit(terminal.Exit.IN_PART)


def _tell(report, out):
    """What stands first, the table of scores, and where the results lie."""
    by = report["scored_by"]
    terminal.say_statements(report["statements"])
    terminal.say(f"{'RMSE (m)':16s}{'E':>8s}{'N':>8s}{'H':>8s}{'3D':>9s}{'fit, 3D':>9s}")
    scored = [row for row in report["methods"] if row[by]["rmse"] is not None]
    for row in sorted(scored, key=lambda row: row[by]["rmse_3d"]):
        axes = "".join(f"{value:8.3f}" for value in row[by]["rmse"])
        terminal.say(
            f"{row['name']:16s}{axes}{row[by]['rmse_3d']:9.3f}{row['control']['rmse_3d']:9.3f}"
        )
    clouds = [("Cloud", out / file["name"]) for file in report["files"]]
    terminal.say_results([("Report", out / "compare.html"), *clouds])
