"""Command that makes a survey.toml for the files in a folder."""

import json
import tomllib
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

import mlscorr
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import Exit, Quiet, Verbose, exit_code, say, warn
from mlscorr.wording import counted

NAMES = {"none": "not used", "table": "not used", "reference": "mesh"}

EXAMPLES = (
    "mlscorr init street",
    "mlscorr init street --set 'control.size = 0.6' --set 'crs = \"EPSG:32650\"'",
)


def init(
    folder: Annotated[Path, typer.Argument(help="Folder with clouds, trajectory and control.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write. Default: FOLDER/survey.toml.")
    ] = None,
    given: Annotated[
        list[str],
        typer.Option("--set", help="Value to write into survey.toml, as 'control.size = 0.6'."),
    ] = (),
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Write a survey.toml for the files in a folder, with the role of each file and the reason.

    Values that only you know are marked in it, and the exit code is 4.
    """
    with exit_code(Exit.USAGE), progress_bars() as progress:
        progress("Identifying the files of the folder")
        started = mlscorr.init(folder, out, _document(given))
        started.write()
    for role in started.roles:
        say(f"{NAMES.get(role.role, role.role)}: {role.path.relative_to(folder)} ({role.reason})")
    for note in started.notes:
        say(note)
    check = f"mlscorr check {quote(str(started.path))}"
    if not started.places:
        say(f"Written: {started.path}. Next: {check}")
        return
    for question in started.questions:
        warn(f"Question: {question}")
    for place in started.places:
        warn(f"Open: {place.key} ({place})")

    number = counted(len(started.places), "open place")
    warn(f'Written: {started.path}, with {number}. Replace each "?" in it, then run {check}')
    raise typer.Exit(Exit.IN_PART)


def _document(given):
    """Tables of lines such as control.size = 0.6; values that are not TOML become text."""
    lines = []
    for line in given:
        key, _, value = line.partition("=")
        try:
            tomllib.loads(f"value = {value}")
        except tomllib.TOMLDecodeError:
            value = json.dumps(value.strip())
        lines.append(f"{key} = {value}")
    try:
        return tomllib.loads("\n".join(lines))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(
            f"--set needs a key and a value, as 'control.size = 0.6': {error}."
        ) from None
