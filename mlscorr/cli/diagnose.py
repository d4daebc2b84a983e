"""Command that diagnoses the gap between a survey and its simulation."""

from pathlib import Path
from typing import Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.work import print_json, work
from mlscorr.wording import signed

EXAMPLES = (
    "mlscorr diagnose survey.toml",
    "mlscorr diagnose survey.toml -o gap --simulated my-clouds",
)


def diagnose(
    survey: terminal.SurveyArgument,
    out: terminal.Out = None,
    simulator: Annotated[
        Path | None,
        typer.Option(
            "--simulator",
            help="simulator.toml with the errors known so far, as an earlier run wrote it.",
        ),
    ] = None,
    simulated: Annotated[
        list[Path],
        typer.Option(
            help="Clouds of this survey from your own simulator: a survey folder, a folder of "
            "LAS or LAZ files, or a file. If given twice, the second is the next run of "
            "the simulator and shows how much the gap decreases."
        ),
    ] = (),
    effects: terminal.Effects = None,
    until_none: Annotated[
        bool,
        typer.Option(
            "--until-none",
            help="Add what is found to the simulator and repeat until nothing more is found.",
        ),
    ] = False,
    costs: Annotated[
        str,
        typer.Option(
            help="Costs of mistakes: careful, default or sensitive; or three numbers for a "
            "false alarm, a miss and unknown, relative to a wrong name (1). Default: "
            "4,1,0.9."
        ),
    ] = "default",
    overwrite: terminal.Overwrite = False,
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
    verbose: terminal.Verbose = 0,
) -> None:
    """Find differences between survey and simulation, their cause, and how much it explains."""
    out = chosen_out(out, survey, "diagnose")
    with terminal.exit_code(terminal.Exit.USAGE), progress_bars():
        from mlscorr.simulate import read_simulator

        assumed = read_simulator(simulator) if simulator else None
        chosen = _costs(costs)
        if len(simulated) > 2:
            raise ValueError(
                f"--simulated was given {len(simulated)} times. Give the clouds of one run, or "
                "of one run and the next."
            )
        if simulated and until_none:
            raise ValueError(
                "--until-none repeats the built-in simulator and --simulated uses your own. "
                "Give only one of them."
            )
        inputs = [path for path in (simulator, effects, *simulated) if path is not None]
    with work(out, overwrite, survey, [path for path in inputs if path.is_file()]) as progress:
        recorded = mlscorr.read_survey(survey)
        if until_none:
            from mlscorr.pipeline import diagnose_until_none

            diagnosed = diagnose_until_none(recorded, assumed, progress=progress, costs=chosen)
        else:
            diagnosed = mlscorr.diagnose(
                recorded, assumed, progress=progress, simulated=tuple(simulated), costs=chosen
            )
        content = diagnosed.write(out, overwrite)
    print_json(content, as_json)
    _print(content)
    terminal.say_results(
        [
            ("Page", out / "gap.html"),
            ("Numbers", out / "gap.json"),
            ("Simulator", out / "simulator.toml"),
        ]
    )


def _costs(text):
    """Costs from the name of an operating point, or from three numbers."""
    from mlscorr.gap.evidence import OPERATING_POINTS, Costs

    if text in OPERATING_POINTS:
        return OPERATING_POINTS[text]
    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(0 <= number < float("inf") for number in numbers):
        raise ValueError(
            f"--costs {text} is neither {', '.join(OPERATING_POINTS)} nor three numbers of 0 or "
            "more. The numbers are the costs of a false alarm, a miss and unknown, relative to "
            "a wrong name (1), as 4,1,0.9."
        )
    return Costs(*numbers)


def _print(content):
    """Print the first screen, and the advice."""
    for sentence in content["warnings"]:
        terminal.warn(f"Warning: {sentence}")
    terminal.say_statements(content["statements"])
    for number, sentence in enumerate(content["advice"], start=1):
        terminal.say(f"{number}. {sentence}")
    if "ablation" in content:
        _print_rounds(content["ablation"])


def _print_rounds(ablation):
    """Print the gap with each single effect, and after each round."""
    from mlscorr.effects import title

    terminal.say(f"{'In the simulator':34s}{'gap before':>12s}{'after':>10s}")
    for row in ablation["alone"]:
        words = f"{title(row['effect'])} alone"
        terminal.say(f"{words:34s}{row['before']:9.1f} mm{row['after']:7.1f} mm")
    for row in ablation["rounds"]:
        words = f"round {row['round']}: {title(row['label'])}"
        unit = row["unit"]
        before, after = (signed(row[when], unit) for when in ("before", "after"))
        terminal.say(f"{words:34s}{before:>12s}{after:>10s}")
    terminal.say(ablation["ended"])
