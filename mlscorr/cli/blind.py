"""Commands for a blind check of the diagnosis: make surveys, diagnose, score."""

from pathlib import Path
from typing import Annotated

import typer

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Effects, Exit, Json, Quiet, Verbose, as_epilog, exit_code, say
from mlscorr.cli.work import print_json

Check = Annotated[Path, typer.Argument(metavar="OUT", help="Folder of the blind check.")]
Workers = Annotated[int, typer.Option(min=1, help="Number of parallel processes.")]

blind = typer.Typer(
    help="Check the diagnosis on simulated surveys with sealed labels.", no_args_is_help=True
)


@blind.command(epilog=as_epilog(["mlscorr blind make blind --cases 50 --workers 2"]))
def make(
    out: Check,
    cases: Annotated[int, typer.Option(min=1, help="Number of surveys.")] = 300,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same surveys.")] = 1,
    mechanisms: Annotated[
        Path | None,
        typer.Option(
            help="Python file with your own mechanisms, used instead of the built-in ones."
        ),
    ] = None,
    effects: Effects = None,
    workers: Workers = 2,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Create surveys and store their sealed labels in key.json. Continues an interrupted run."""
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.pipeline import make_blind

        made = make_blind(out, cases, seed, workers, mechanisms, progress, effects)
    say(f"{made} surveys written to {out / 'cases'}, their seals to {out / 'seals.json'}.")


@blind.command(epilog=as_epilog(["mlscorr blind run blind --workers 2"]))
def run(
    out: Check,
    effects: Effects = None,
    workers: Workers = 2,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Diagnose each survey without an answer, from its folder alone."""
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.pipeline import run_blind

        answered, failed = run_blind(out, workers, progress, effects)
    say(f"{answered} surveys diagnosed ({failed} failed): {out / 'answers'}.")


@blind.command(
    name="score",
    epilog=as_epilog(["mlscorr blind score blind", "mlscorr blind score blind --json"]),
)
def score_(
    out: Check,
    effects: Effects = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Verify the seals and compare answers with labels."""
    with exit_code(Exit.BAD_DATA):
        from mlscorr.pipeline import score_blind

        score = score_blind(out)
    print_json(score, as_json)
    for line in _table(score["rows"]):
        say(line)
    say(f"{score['answered']} of {score['cases']} cases answered, {len(score['failed'])} failed.")
    for case in score["wrong"]:
        size = f" of {case['mdb']:.1f} MDB" if case["mdb"] else ""
        say(
            f"{case['case']} {case['kind']}: {case['truth']}{size}, diagnosed as {case['said']} "
            f"({case['probability']:.2f}){': ' + case['lead'] if case['lead'] else ''}"
        )
    say(f"Score:  {out / 'score.json'}")


def _table(rows):
    """Lines of the table of rates and figures."""
    yield f"{'':44}{'cases':>6}{'value':>8}  {'95 % interval':16}{'goal':14}"
    for row in rows:
        low, high = row["interval"]
        reached = {None: "", True: "reached", False: "missed"}[row["reached"]]
        yield (
            f"{row['name']:44}{row['cases']:6}{row['value']:8.3f}  "
            f"{f'{low:.3f} to {high:.3f}':16}{_goal(*row['goal']):14}{reached}"
        )


def _goal(low, high):
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    if low is not None:
        return f">= {low:g}"
    if high is not None:
        return f"<= {high:g}"
    return ""
