"""Command that calibrates the mounting of a scanner."""

from typing import Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.terminal import Json, Out, Overwrite, Quiet, SurveyArgument, Verbose, say
from mlscorr.cli.work import print_json, work

EXAMPLES = (
    "mlscorr calibrate survey.toml",
    "mlscorr calibrate survey.toml -o calibrated --with-drift --clouds",
)


def calibrate(
    survey: SurveyArgument,
    out: Out = None,
    with_drift: Annotated[
        bool,
        typer.Option("--with-drift", help="Estimate the POS error as well; write trajectory.csv."),
    ] = False,
    no_ties: terminal.NoTies = False,
    clouds: Annotated[
        bool, typer.Option("--clouds", help="Write the clouds with the calibrated mounting.")
    ] = False,
    exclude: terminal.Exclude = (),
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Calibrate lever arm and boresight of a survey's scanners by control points and ties."""
    out = chosen_out(out, survey, "calibrate")
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey).choosing(exclude)
        result = mlscorr.calibrate(recorded, progress=progress, ties=False if no_ties else None)
        content = result.write(out, with_drift, clouds, overwrite, progress)
    print_json(content, as_json)
    terminal.say_statements(content["statements"])
    for name, part in content.get("scanners", {}).items():
        say(f"Scanner {name}")
        terminal.say_statements(part["statements"])
        _print_estimates(part)
    if "scanners" not in content:
        _print_estimates(content)
    terminal.say_results(
        [
            ("Calibration", out / "calibration.json"),
            ("Page", out / "calibration.html"),
            ("Survey", f"{out / 'survey.toml'}, with the calibrated mounting"),
        ]
    )
    if not clouds:
        say(
            "The clouds still use the recorded mounting; --clouds writes them with the "
            "calibrated one."
        )
    if untouched := sum(file["untouched"] for file in content["files"]):
        say(f"{untouched} points outside the trajectory were not changed.")
        raise typer.Exit(terminal.Exit.IN_PART)


def _print_estimates(content):
    """Print the corrections of one scanner's mounting, and their effect on its targets."""
    methods = {"LSC": content["lsc"], "LS": content["ls"]}
    if not content["ls"]["control"]["n"]:  # it uses only control
        del methods["LS"]
    _print_mounting(content, methods)
    _print_misclosures(content, methods)


def _print_mounting(content, methods):
    """Print the recorded mounting, its corrections by each method, and the determined
    components.
    """
    titles = "".join(f"{title:>9s}{'sigma':>8s}" for title in methods)
    say(f"{'Correction to recorded mounting':34s}{titles}  determined")
    for start, part, unit in ((0, "lever_arm", "m"), (3, "boresight", "deg")):
        for axis, name in enumerate(("right", "forward", "up")):
            numbers = "".join(
                f"{method[part]['correction'][axis]:9.4f}{method[part]['sigma'][axis]:8.4f}"
                for method in methods.values()
            )
            about = f"{part.replace('_', ' ')} {'about ' * (start > 0)}{name} ({unit})"
            if content["determined"][start + axis]:
                determined = "yes"
            else:
                determined = "no"
            say(f"{about:34s}{numbers}  {determined}")


def _print_misclosures(content, methods):
    if "with_drift" in content:
        methods = methods | {"LSC with drift": content["with_drift"]}
    rows = [
        (f"{role} points, {title}", method[role], "after")
        for role in ("control", "check")
        for title, method in methods.items()
    ]
    terminal.say_rmse(rows, width=34, decimals=4)
