"""The command that calibrates the mounting of a scanner."""

from typing import Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.terminal import Json, Out, Overwrite, Quiet, SurveyArgument, say
from mlscorr.cli.work import print_json, work


def calibrate(
    survey: SurveyArgument,
    out: Out,
    with_drift: Annotated[
        bool, typer.Option("--with-drift", help="Estimate the POS error too; write trajectory.csv.")
    ] = False,
    no_ties: terminal.NoTies = False,
    clouds: Annotated[
        bool, typer.Option("--clouds", help="Write the clouds as the calibration puts them.")
    ] = False,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate lever arm and boresight of a survey's scanners by control points and ties."""
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey)
        result = mlscorr.calibrate(recorded, progress=progress, ties=False if no_ties else None)
        content = result.write(out, with_drift, clouds, overwrite, progress)
    print_json(content, as_json)
    terminal.say_statements(content["statements"])
    if "scanners" in content:
        _tell_scanners(content["scanners"])
    else:
        _tell_mounting(content)
        _tell_misclosures(content)
    say(f"Calibration: {out / 'calibration.json'}")
    say(f"Page:        {out / 'calibration.html'}")
    say(f"Survey:      {out / 'survey.toml'}, with the calibrated mounting")
    if not clouds:
        say("Its clouds are still as the recorded mounting put them; --clouds writes them anew.")


def _tell_scanners(scanners):
    """What the recorded mounting of each scanner lacks, a line each."""
    for name, content in scanners.items():
        lacks = [
            " ".join(
                f"{value:.4f} ± {sigma:.4f}"
                for value, sigma in zip(part["correction"], part["sigma"], strict=True)
            )
            for part in (content["lsc"][key] for key in ("lever_arm", "boresight"))
        ]
        say(
            f"Scanner {name} lacks right, forward, up: lever arm {lacks[0]} m, boresight "
            f"{lacks[1]} deg; determined: {sum(content['determined'])} of 6"
        )


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
            determined = "yes" if content["determined"][start + axis] else "no"
            say(
                f"{about:34s}" + "{:9.4f}{:8.4f}{:9.4f}{:8.4f}".format(*numbers) + f"  {determined}"
            )


def _tell_misclosures(content):
    methods = {"LSC": content["lsc"], "LS": content["ls"]}
    if "with_drift" in content:
        methods["LSC with drift"] = content["with_drift"]
    rows = [
        (f"{role} points, {title}", method[role], "after")
        for role in ("control", "check")
        for title, method in methods.items()
    ]
    terminal.say_rmse(rows, width=34, decimals=4)
