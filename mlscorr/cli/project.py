"""What commands do with a project of several drives, and the one that tells how far it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mlscorr.cli.terminal import (
    Exit,
    Json,
    Quiet,
    deafen,
    exit_code,
    path_or_url,
    say,
    say_statements,
    warn,
)
from mlscorr.cli.work import print_json

if TYPE_CHECKING:
    from mlscorr.evaluate.quality import Gate
    from mlscorr.pipeline.project import Options

RESUMPTION = "what was done stays, and the same command with --resume goes on"


def correct_drives(
    project: Path, out: Path, options: Options, gates: list[Gate], as_json: bool
) -> None:
    """Correct all drives of a project and tell what became of them.

    Parameters
    ----------
    project : Path
        project.toml, or its folder.
    out : Path
    options : Options
    gates : list of Gate
        Each drive has to pass them.
    as_json : bool

    Raises
    ------
    typer.Exit
        Where something failed.
    """
    from mlscorr.evaluate.quality import failures
    from mlscorr.io.project_file import read_project_file
    from mlscorr.pipeline.project import check_engine, correct_project

    with exit_code(Exit.USAGE):
        read_project_file(project)
        check_engine(options.workers, options.scheduler)
    with exit_code(Exit.BAD_DATA, lambda: RESUMPTION):
        result = correct_project(project, out, options, tell)
        deafen()
    print_json(result.document, as_json)
    say_statements(result.document["statements"])
    for row in result.document["drives"]:
        say(f"{row['name']}: {row['headline']}")
    if options.page:
        say(f"Project:   {out / 'project.html'}")
    failed = [
        f"{name}: {sentence}"
        for name, report in result.reports.items()
        for sentence in failures(gates, report)
    ]
    for sentence in failed:
        warn(f"Quality gate failed: {sentence}")
    if failed or not result.is_whole:
        raise typer.Exit(Exit.QUALITY_GATE if failed else Exit.IN_PART)


def tell(sentence: str) -> None:
    """Say a sentence on the way; warnings and failures in any case.

    Parameters
    ----------
    sentence : str
    """
    speak = warn if sentence.startswith(("Warning:", "Failed:")) else say
    speak(sentence)


def status(
    out: Annotated[Path, typer.Argument(help="Folder of a project's results.", parser=path_or_url)],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell how far the correction of a project has come, while it runs or afterwards."""
    with exit_code(Exit.USAGE):
        from mlscorr.pipeline.project import project_status

        content = project_status(out)
    print_json(content, as_json)
    for row in content["drives"]:
        stages = [
            f"{stage['title'].lower()} {stage['done']} of {stage['tasks']}"
            for stage in row["stages"]
        ]
        say(f"{row['name']}: {', '.join(stages)}")
    shares = [f"{stage['title'].lower()} {stage['share']:.0%}" for stage in content["all"]]
    say(f"All: {', '.join(shares)}")
    for line in content["failures"]:
        warn(line)
    say(f"Last: {content['log']}")
