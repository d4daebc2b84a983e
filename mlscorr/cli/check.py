"""Command that reports the faults of a survey before its correction."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import typer

import mlscorr
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Quiet, SurveyArgument, Verbose, exit_code, say, warn
from mlscorr.wording import counted, thousands

if TYPE_CHECKING:
    from mlscorr.pipeline import CheckedSurvey

CODES = {"survey.toml": Exit.USAGE, "data": Exit.BAD_DATA, "system": Exit.READ_OR_WRITE}

EXAMPLES = (
    "mlscorr check street",
    "mlscorr check project.toml",
)


def check(survey: SurveyArgument, quiet: Quiet = False, verbose: Verbose = 0) -> None:
    """Report in seconds all faults of a survey or project, and the cost of correcting it."""
    checked = _checked(survey)
    say_checked(checked)
    following = f"mlscorr correct {quote(str(survey))}"
    number = counted(len(checked.warnings), "warning")
    if checked.is_searched:
        say(f"No fault, {number}. Next: {following}")
    else:
        say(f"No fault in what was checked, {number}; no control point was found, see Not checked.")


def say_checked(checked: CheckedSurvey, with_amounts: bool = True) -> None:
    """Print the result of a check, and end with its exit code if there is a fault.

    Parameters
    ----------
    checked : CheckedSurvey
    with_amounts : bool
        True to print what is read, written and needed, too; else warnings and faults only.

    Raises
    ------
    typer.Exit
        With the code of the first fault.
    """
    if with_amounts:
        amounts = {"Read": checked.read, "Written": checked.written, "Needed": checked.needed}
        for title, those in amounts.items():
            _list(title, [_amount(amount) for amount in those])
        _list("Determined", checked.notes)
        _list("Not checked", checked.unchecked)
    for sentence in checked.warnings:
        warn(f"Warning: {sentence}")
    for fault in checked.faults:
        warn(f"Error: {fault.sentence}")
    if checked.faults:
        warn(counted(sum(fault.number for fault in checked.faults), "fault"))
        raise typer.Exit(CODES[checked.faults[0].where])


def _list(title: str, lines: Sequence[str]) -> None:
    """Print lines below a title, if there are any."""
    if lines:
        say("\n".join([title, *(f"  {line}" for line in lines)]))


def _amount(amount):
    """Format an Amount in one line."""
    if amount.number >= 10 or amount.number == int(amount.number):
        digits = 0
    else:
        digits = 1
    number = thousands(amount.number, digits)
    return f"{amount.what}: {number}{' ' * bool(amount.unit)}{amount.unit} ({amount.source})"


def check_first(survey: Path) -> None:
    """Check a survey before the work, and print the result and end if there is a fault.

    Parameters
    ----------
    survey : Path
        survey.toml.

    Raises
    ------
    typer.Exit
        See say_checked.
    """
    checked = _checked(survey)
    say_checked(checked, with_amounts=False)
    say(f"Checked: no fault, {counted(len(checked.warnings), 'warning')}.")


def _checked(survey):
    """Check a survey or project."""
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.io.surveys import is_project

        if is_project(survey):
            from mlscorr.pipeline.project import check_project

            progress("Checking the project")
            return check_project(survey)
        from mlscorr.pipeline import check as check_survey

        progress("Checking the survey")
        return check_survey(survey)


def say_dry_run(
    survey: Path,
    out: Path,
    written: Sequence[str],
    chosen: Mapping[str, Collection[str]] | None = None,
    overwrite: bool = False,
) -> None:
    """Print inputs, outputs and faults of a correction without running it.

    Parameters
    ----------
    survey : Path
        survey.toml or project.toml.
    out : Path
        Folder of the results.
    written : sequence of str
        Names of the files in it; empty for a project.
    chosen : mapping, optional
        Names to exclude and include.
    overwrite : bool

    Raises
    ------
    typer.Exit
        See say_checked.
    """
    with exit_code(Exit.USAGE):
        from mlscorr.io.store import check_output
        from mlscorr.io.surveys import input_files, is_project

        if not is_project(survey):
            files = input_files(survey)
            check_output(out, files, overwrite)
            _list("Would be read", [_with_size(file) for file in files])
    _list(f"Would be written into {out}", written)
    checked = _checked(survey)
    if not checked.faults and chosen:
        with exit_code(Exit.USAGE):
            _check_choice(survey, chosen)
    say_checked(checked)
    say(f"No fault, {counted(len(checked.warnings), 'warning')}. Nothing was written.")


def _check_choice(survey, chosen):
    """Refuse names of control points that a survey or project does not have."""
    from mlscorr.io.surveys import is_project, read_project
    from mlscorr.survey import choosing

    if is_project(survey):
        recording = read_project(survey)
    else:
        recording = mlscorr.read_survey(survey)
    choosing(recording, **chosen)


def _with_size(file):
    """Name of a file with its size, unless it is a URL."""
    from mlscorr.io.store import is_remote

    if is_remote(file):
        return str(file)
    return f"{file.resolve()} ({thousands(file.stat().st_size / 1e6, 1)} MB)"
