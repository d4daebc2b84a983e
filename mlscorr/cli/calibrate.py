"""The command that calibrates the mounting of a scanner."""

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
)


def calibrate(
    survey: SurveyFile,
    out: Out,
    with_drift: Annotated[
        bool, typer.Option("--with-drift", help="Estimate the POS error too; write trajectory.csv.")
    ] = False,
    clouds: Annotated[
        bool, typer.Option("--clouds", help="Write the clouds as the calibration puts them.")
    ] = False,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Calibrate lever arm and boresight of a survey's scanner with its control points."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files, read_survey

        check_output(out, input_files(survey), overwrite)
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        recorded = read_survey(survey)
        from mlscorr.pipeline import calibrate

        result = calibrate(recorded, progress=progress)
        content = result.write(out, with_drift, clouds, overwrite, progress)
    if as_json:
        print(json.dumps(content))
    _tell_mounting(content)
    _tell_misclosures(content)
    say(f"Calibration: {out / 'calibration.json'}")
    say(f"Survey:      {out / 'survey.toml'}, with the calibrated mounting")
    if not clouds:
        say("Its clouds are still as the recorded mounting put them; --clouds writes them anew.")


def _tell_mounting(content):
    """Recorded mounting, what it lacks by both methods, and what the site determines."""
    say(f"{'What the recorded mounting lacks':34s}{'LSC':>9s}{'sigma':>8s}"
        f"{'LS':>9s}{'sigma':>8s}  determined")  # fmt: skip
    for start, part, unit in ((0, "lever_arm", "m"), (3, "boresight", "deg")):
        for axis, name in enumerate(("right", "forward", "up")):
            numbers = [
                content[method][part][kind][axis]
                for method in ("lsc", "ls")
                for kind in ("correction", "sigma")
            ]
            about = f"{part.replace('_', ' ')} {'about ' * (start > 0)}{name} ({unit})"
            told = "yes" if content["determined"][start + axis] else "no"
            say(f"{about:34s}" + "{:9.4f}{:8.4f}{:9.4f}{:8.4f}".format(*numbers) + f"  {told}")


def _tell_misclosures(content):
    say(f"{'RMSE of misclosures (m)':34s}{'n':>4s}{'E before':>11s}{'N':>8s}{'H':>8s}"
        f"{'E after':>10s}{'N':>8s}{'H':>8s}")  # fmt: skip
    methods = [("LSC", content["lsc"]), ("LS", content["ls"])]
    if "with_drift" in content:
        methods.append(("LSC with drift", content["with_drift"]))
    for role in ("control", "check"):
        for title, method in methods:
            group = method[role]
            title = f"{role} points, {title}"
            if group["n"] == 0:
                say(f"{title:34s}   0  none")
                continue
            numbers = [*group["before"]["rmse"], *group["after"]["rmse"]]
            say(f"{title:34s}{group['n']:4d}" + "{:11.4f}{:8.4f}{:8.4f}{:10.4f}{:8.4f}{:8.4f}"
                .format(*numbers))  # fmt: skip
    for target in content["targets"]:
        if not target["used"] and target["reason"] != "check point":
            say(f"Not used: {target['name']}: {target['reason']}")
