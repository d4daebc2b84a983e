"""Command that simulates a survey."""

from pathlib import Path
from typing import Annotated

import typer

from mlscorr.cli.folders import chosen_out
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import (
    Effects,
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    Verbose,
    exit_code,
    say,
    say_results,
)
from mlscorr.cli.work import print_json, work
from mlscorr.wording import counted

EXAMPLES = (
    "mlscorr simulate examples/scenarios/car.toml",
    "mlscorr simulate car.toml -o car --seed 2",
)


def simulate(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario as a TOML file, such as those in examples/scenarios.")
    ],
    out: Out = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives identical files.")] = 1,
    effects: Effects = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Simulate a survey from a scenario: a survey folder with its truth."""
    out = chosen_out(out, scenario, "simulate", is_by_name=True)
    with exit_code(Exit.USAGE), progress_bars():
        from mlscorr.simulate import read_scenario, scenario_files

        inputs = [scenario, *scenario_files(read_scenario(scenario))]
    with work(out, overwrite, inputs=inputs) as progress:
        from mlscorr.pipeline import simulate_survey

        made = simulate_survey(scenario, out, seed, overwrite, progress)
    print_json(made, as_json)
    points = sum(file["points"] for file in made["files"])
    say(
        f"Simulated {made['name']}: {points} points in {counted(len(made['files']), 'file')}, "
        f"{made['control']} control and {counted(made['check'], 'check point')}, "
        f"{counted(made['passes'], 'pass')} in {made['end'] - made['start']:.0f} s."
    )
    truth = f"{out / 'truth.json'} and {out / 'truth.npz'}"
    say_results([("Survey", out / "survey.toml"), ("Truth", truth)])
