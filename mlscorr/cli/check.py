"""The command that tells what is wrong with a survey before it is corrected."""

from collections.abc import Sequence
from shlex import quote

import typer

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Quiet, SurveyArgument, Verbose, exit_code, say, warn
from mlscorr.wording import counted, thousands

CODES = {"survey.toml": Exit.USAGE, "data": Exit.BAD_DATA, "system": Exit.READ_OR_WRITE}


def check(survey: SurveyArgument, quiet: Quiet = False, verbose: Verbose = 0) -> None:
    """Tell in seconds all that is wrong with a survey or project, and what correcting it takes."""
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        from mlscorr.io.surveys import is_project

        if is_project(survey):
            from mlscorr.pipeline.project import check_project

            progress("Checking the project")
            checked = check_project(survey)
        else:
            from mlscorr.pipeline import check as check_survey

            progress("Checking the survey")
            checked = check_survey(survey)
    amounts = {"Read": checked.read, "Written": checked.written, "Needed": checked.needed}
    for title, those in amounts.items():
        _list(title, [_amount(amount) for amount in those])
    _list("Worked out", checked.notes)
    _list("Not checked", checked.unchecked)
    for sentence in checked.warnings:
        warn(f"Warning: {sentence}")
    for fault in checked.faults:
        warn(f"Error: {fault.sentence}")
    if checked.faults:
        warn(counted(sum(fault.number for fault in checked.faults), "fault"))
        raise typer.Exit(CODES[checked.faults[0].where])
    following = f"mlscorr correct {quote(str(survey))} -o OUT"
    number = counted(len(checked.warnings), "warning")
    if checked.is_searched:
        say(f"No fault, {number}. Next: {following}")
    else:
        say(f"No fault in what was checked, {number}; no control point was found, see Not checked.")


def _list(title: str, lines: Sequence[str]) -> None:
    """Say some lines below a title, where there are any."""
    if lines:
        say("\n".join([title, *(f"  {line}" for line in lines)]))


def _amount(amount):
    """An Amount in one line."""
    if amount.number >= 10 or amount.number == int(amount.number):
        digits = 0
    else:
        digits = 1
    number = thousands(amount.number, digits)
    return f"{amount.what}: {number}{' ' * bool(amount.unit)}{amount.unit} ({amount.source})"
