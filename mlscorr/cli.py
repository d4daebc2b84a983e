"""The commands: read, call, write; nothing else. What they do is told by pipeline.py."""

import json
import signal
import sys
import warnings
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    help="Correct mobile laser scans with surveyed targets by least squares collocation.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
SurveyFile = Annotated[Path, typer.Argument(help="survey.toml, or the folder that holds it.")]
Out = Annotated[Path, typer.Option("-o", "--out", help="Folder for the results.")]
Overwrite = Annotated[bool, typer.Option(help="Replace files of the same name in the folder.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


class Exit(IntEnum):
    """Exit codes of the commands."""

    DONE = 0
    USAGE = 2
    BAD_DATA = 3
    IN_PART = 4
    READ_OR_WRITE = 5
    LIBRARY_MISSING = 7
    INTERRUPTED = 130


@app.command()
def correct(
    survey: SurveyFile,
    out: Out,
    order: Annotated[
        int, typer.Option(min=0, max=9, help="Order of the polynomial trend of the position.")
    ] = 1,
    overwrite: Overwrite = False,
    as_json: Json = False,
):
    """Correct the cloud of a survey with its control points, and report on it."""
    with _exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files, read_survey

        check_output(out, input_files(survey), overwrite)
    with _exit_code(Exit.BAD_DATA), _progress() as progress:
        recorded = read_survey(survey)
        from mlscorr.pipeline import correct

        result = correct(recorded, order, progress=progress)
        report = result.write(out, overwrite, progress)
    _tell(report, out, as_json)
    outside = report["coverage"]["points_outside_trajectory"]
    if outside:
        total = sum(file["points"] for file in report["files"])
        _say(
            f"{outside} of {total} points lie outside the trajectory or in its gaps "
            f"[{recorded.trajectory.gps_time[0]:.3f}, {recorded.trajectory.gps_time[-1]:.3f}] s "
            "and were left as they were."
        )
        raise typer.Exit(Exit.IN_PART)


@app.command()
def demo(
    out: Out = Path("demo"),
    seed: Annotated[int, typer.Option(help="Of the simulated survey.")] = 1,
    overwrite: Overwrite = False,
    as_json: Json = False,
):
    """Make a small simulated survey, correct it, and show the report."""
    with _exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output

        check_output(out, [], overwrite)
    with _exit_code(Exit.BAD_DATA), _progress() as progress:
        from mlscorr.pipeline import demo

        _say("Simulating a street, a drive with a GNSS outage, and a scanner ...")
        report = demo(out, seed, overwrite, progress)
    _tell(report, out / "corrected", as_json)


@app.command()
def simulate(
    scenario: Annotated[Path, typer.Argument(help="TOML file, as those in examples/scenarios.")],
    out: Out,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same bytes.")] = 1,
    overwrite: Overwrite = False,
    as_json: Json = False,
):
    """Simulate a survey from a scenario: a survey folder, and the truth beside it."""
    with _exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.simulate.scenario_file import read_scenario, scenario_files

        check_output(out, [scenario, *scenario_files(read_scenario(scenario))], overwrite)
    with _exit_code(Exit.BAD_DATA), _progress() as progress:
        from mlscorr.pipeline import simulate_survey

        made = simulate_survey(scenario, out, seed, overwrite, progress)
    if as_json:
        print(json.dumps(made))
    points = sum(file["points"] for file in made["files"])
    _say(
        f"Simulated {made['name']}: {points} points in {len(made['files'])} files, "
        f"{made['control']} control and {made['check']} check points, "
        f"{made['passes']} passes in {made['end'] - made['start']:.0f} s."
    )
    _say(f"Survey:  {out / 'survey.toml'}")
    _say(f"Truth:   {out / 'truth.json'} and {out / 'truth.npz'}")


@app.command()
def doctor(as_json: Json = False):
    """Tell what is installed, what is missing, and the line that installs it."""
    from mlscorr.doctor import examine, remedy
    from mlscorr.io.output import document

    findings = examine()
    for finding in findings:
        mark = "ok     " if finding.ok else "MISSING" if finding.needed else "without"
        _say(f"{mark} {finding.name}: {finding.found}")
    for line in remedy(findings):
        _say(f"To install what is missing:  {line}")
    if as_json:
        rows = [vars(finding) for finding in findings]
        print(json.dumps(document("doctor", {"findings": rows})))
    if any(finding.needed and not finding.ok for finding in findings):
        raise typer.Exit(Exit.LIBRARY_MISSING)


def main():
    """Entry point of the command line."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, _interrupt)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # as it is under nohup
        signal.signal(signal.SIGHUP, _interrupt)
    warnings.showwarning = lambda message, *_, **__: _say(f"Warning: {message}")
    app()


def _interrupt(number, frame):
    """Raise KeyboardInterrupt, and again after a second where a library swallowed it."""
    signal.setitimer(signal.ITIMER_REAL, 1.0)
    raise KeyboardInterrupt


@contextmanager
def _exit_code(code):
    """End with one sentence and an exit code where the user's input or the system is at fault."""
    try:
        yield
    except KeyboardInterrupt:
        _stop()
    except OSError as error:
        if isinstance(error, FileNotFoundError) and error.errno is None:  # survey.toml names it
            _fail(error, Exit.USAGE)
        _fail(f"Reading or writing failed: {error}", Exit.READ_OR_WRITE)
    except ImportError as error:
        if signal.getitimer(signal.ITIMER_REAL)[0]:  # it was the import that was interrupted
            _stop()
        _fail(f"{error}. Run mlscorr doctor to see what is missing.", Exit.LIBRARY_MISSING)
    except ValueError as error:
        _fail(error, code)


def _fail(message, code):
    _say(f"Error: {message}")
    raise typer.Exit(code) from None


def _stop():
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    _say("Interrupted; nothing was written.")
    raise typer.Exit(Exit.INTERRUPTED) from None


def _say(text):
    print(text, file=sys.stderr)


@contextmanager
def _progress():
    """Bars on stderr, on a terminal: progress(title, total) gives a function of points done."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as bars:

        def progress(title, total):
            task = bars.add_task(title, total=total)
            return lambda points: bars.advance(task, points)

        yield progress


def _tell(report, out, as_json):
    """The misclosures' RMSE before and after, and where the results lie."""
    if as_json:
        print(json.dumps(report))
    _say(f"{'RMSE of misclosures (m)':24s}{'n':>4s}  {'E before':>9s}{'N':>8s}{'H':>8s}"
         f"  {'E after':>9s}{'N':>8s}{'H':>8s}")  # fmt: skip
    rows = [
        ("control points", report["control"], "after"),
        ("  each left out in turn", report["control"], "leave_one_out"),
        ("check points", report["check"], "after"),
    ]
    for title, group, after in rows:
        if group["before"]["rmse"] is None or group[after]["rmse"] is None:
            _say(f"{title:24s}{group['n']:4d}  none")
            continue
        numbers = [*group["before"]["rmse"], *group[after]["rmse"]]
        text = "".join(
            f"{'  ' * (i % 3 == 0)}{v:{9 - (i % 3 > 0)}.3f}" for i, v in enumerate(numbers)
        )
        _say(f"{title:24s}{group['n']:4d}{text}")
    for target in report["targets"]:
        if not target["used"] and target["reason"] != "check point":
            _say(f"Not used: {target['name']}: {target['reason']}")
    _say(f"Report:    {out / 'report.html'}")
    _say(f"Pictures:  {out / 'pictures'}")
    _say(f"Corrected: {', '.join(str(out / file['name']) for file in report['files'])}")


if __name__ == "__main__":
    main()
