"""Commands on a project of several drives, and the one that shows its progress."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mlscorr.cli import terminal
from mlscorr.cli.work import print_json
from mlscorr.wording import percent

if TYPE_CHECKING:
    from mlscorr.evaluate import Gate
    from mlscorr.pipeline.project import Options
    from mlscorr.survey import Statement

STATUS_EXAMPLES = ("mlscorr status city", "mlscorr status city --json")
RESUMPTION = "finished work is kept; continue with the same command and --resume"


def correct_drives(
    project: Path,
    out: Path,
    options: Options,
    gates: list[Gate],
    as_json: bool,
    chosen: Mapping[str, Collection[str]],
) -> None:
    """Correct all drives of a project, and print the results.

    Parameters
    ----------
    project : Path
        project.toml, or its folder.
    out : Path
    options : Options
    gates : list of Gate
        Gates that each drive must pass.
    as_json : bool
    chosen : mapping
        Names of control points to exclude and to include.

    Raises
    ------
    typer.Exit
        If something failed.
    """
    from mlscorr.evaluate import failures
    from mlscorr.io.surveys import read_project, stated_project
    from mlscorr.pipeline.project import check_engine, check_project_output, correct_project
    from mlscorr.survey import choosing

    with terminal.exit_code(terminal.Exit.USAGE):
        stated = stated_project(project)
        check_engine(options.workers, options.scheduler)
    with terminal.exit_code(terminal.Exit.BAD_DATA):
        parts = read_project(stated)
    with terminal.exit_code(terminal.Exit.USAGE):
        parts = choosing(parts, **chosen)
        check_project_output(parts, out, options)
    with terminal.exit_code(terminal.Exit.BAD_DATA, lambda: RESUMPTION):
        result = correct_project(parts, out, options, print_statement)
        terminal.deafen()
    print_json(result.document, as_json)
    terminal.say_statements(result.document["statements"])
    for row in result.document["drives"]:
        terminal.say(f"{row['name']}: {row['headline']}")
    if options.page:
        terminal.say_results([("Project", out / "project.html")])
    reports = result.reports.items()
    failed = [f"{name}: {text}" for name, own in reports for text in failures(gates, own)]
    terminal.end(failed, result.is_whole)


def print_statement(statement: Statement) -> None:
    """Print a progress statement; warnings and failures even in quiet mode.

    Parameters
    ----------
    statement : Statement
    """
    from mlscorr.pipeline.project import progress_sentence

    sentence = progress_sentence(statement)
    if statement.severity == "note":
        terminal.say(sentence)
    else:
        terminal.warn(sentence)


def status(
    out: Annotated[
        Path,
        typer.Argument(help="Folder with the results of a project.", parser=terminal.path_or_url),
    ],
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
    verbose: terminal.Verbose = 0,
) -> None:
    """Show the progress of the correction of a project, during the run or afterwards."""
    with terminal.exit_code(terminal.Exit.USAGE):
        from mlscorr.pipeline.project import project_status

        content = project_status(out)
    print_json(content, as_json)
    for row in content["drives"]:
        stages = [f"{s['title'].lower()} {s['done']} of {s['tasks']}" for s in row["stages"]]
        terminal.say(f"{row['name']}: {', '.join(stages)}")
    shares = [f"{stage['title'].lower()} {percent(stage['share'])}" for stage in content["all"]]
    terminal.say(f"All: {', '.join(shares)}")
    for line in content["failures"]:
        terminal.warn(line)
    if content["is_running"] is not False:
        terminal.say(f"Running: {content['progress']}")
    terminal.say(f"Last: {content['log']}")
    if content["is_running"] is False:
        is_done = {stage["stage"]: stage["share"] == 1 for stage in content["all"]}
        is_whole = is_done.get("reports") and all(is_done.values())
        if is_whole:
            rest = "everything is done"
        else:
            rest = "continue with the same command and --resume"
        terminal.say(f"Not running: {rest}.")
