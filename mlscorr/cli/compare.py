"""Command that compares all methods on one survey, or two of its results."""

from pathlib import Path
from typing import Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.work import print_json, work

RESULT_FILES = ("report.json", "trajectory.csv")  # files read from a result

EXAMPLES = (
    "mlscorr compare survey.toml",
    "mlscorr compare survey.toml -o compared --clouds affine",
    "mlscorr compare corrected-1 corrected-2 -o compared",
)


def compare(
    survey: Annotated[
        Path,
        typer.Argument(
            help="survey.toml or its folder, or the first of two folders written by mlscorr "
            "correct.",
            parser=terminal.path_or_url,
        ),
    ],
    second: Annotated[
        Path | None,
        typer.Argument(
            help="Second result, compared with the first.",
            parser=terminal.path_or_url,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="Folder for the results. Default: FOLDER-compare next to the survey's FOLDER; "
            "for two results, nothing is written.",
            parser=terminal.path_or_url,
        ),
    ] = None,
    clouds: Annotated[
        list[str],
        typer.Option(
            metavar="METHOD",
            help="Write the cloud corrected by this method, into a folder named after the "
            "method. May be repeated.",
        ),
    ] = (),
    exclude: terminal.Exclude = (),
    overwrite: terminal.Overwrite = False,
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
    verbose: terminal.Verbose = 0,
) -> None:
    """Correct a survey with every method and compare their RMSE at the same check points.

    Two folders written by mlscorr correct are compared with each other instead:
    mlscorr compare corrected-1 corrected-2 -o compared
    """
    with terminal.exit_code(terminal.Exit.USAGE), progress_bars():
        _check_arguments(survey, second, clouds, exclude)
    if second is not None:
        _compare_results(survey, second, out, overwrite, as_json)
        return
    out = chosen_out(out, survey, "compare")
    with terminal.exit_code(terminal.Exit.USAGE), progress_bars():
        from mlscorr.pipeline import method_named

        clouds = list(dict.fromkeys(method_named(name).name for name in clouds))
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey).choosing(exclude)
        result = mlscorr.compare(recorded, progress=progress)
        report = result.write(out, clouds, overwrite, progress)
    print_json(report, as_json)
    _print(report, out)
    left = [file for file in report["files"] if file["points_outside_trajectory"]]
    for file in left:
        terminal.warn(
            f"{file['points_outside_trajectory']} of {file['points']} points of {file['name']} "
            "lie outside the trajectory or in its gaps and were not corrected."
        )
    if left:
        raise typer.Exit(terminal.Exit.IN_PART)


def _check_arguments(survey, second, clouds, exclude):
    """Refuse arguments that are neither one survey nor two results."""
    from mlscorr.pipeline import is_result

    if second is None:
        if is_result(survey):
            raise ValueError(
                f"{survey} is a single result of mlscorr correct; a comparison needs two. Add "
                f"the second one: mlscorr compare {survey} OTHER -o compared."
            )
        return
    for path in (survey, second):
        if not is_result(path):
            raise ValueError(
                f"{path} is not a result of mlscorr correct: it has no report.json. Give two "
                "folders written by mlscorr correct -o, or one survey.toml."
            )
    if exclude:
        raise ValueError(
            "--exclude applies to one survey only; two results already have their points."
        )
    if clouds:
        raise ValueError("--clouds applies to the methods on one survey only, not to two results.")


def _compare_results(first, second, out, overwrite, as_json):
    """Compare two results, and write the differences if a folder is given."""
    if out is None:
        with terminal.exit_code(terminal.Exit.BAD_DATA):
            result = mlscorr.compare_results(first, second)
            document = result.document
    else:
        read = [folder / name for folder in (first, second) for name in RESULT_FILES]
        with work(out, overwrite, inputs=read):
            result = mlscorr.compare_results(first, second)
            document = result.write(out, overwrite)
    print_json(document, as_json)
    for side in ("first", "second"):
        terminal.say(f"{side.capitalize()}: {document[side]['folder']}")
    terminal.say_statements(document["statements"])
    terminal.say(result)
    if out is not None:
        terminal.say_results([("Report", out / "compare_results.html")])


def _print(report, out):
    """Print the first screen, the table of scores, and the location of the results."""
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
