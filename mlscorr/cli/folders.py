"""Folders of results: beside the input by default, and a folder of files as a survey."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from mlscorr.cli.terminal import Exit, exit_code, say


def chosen_out(out: Path | None, source: Path, command: str, is_by_name: bool = False) -> Path:
    """The folder for the results; by default FOLDER-COMMAND beside the FOLDER of the input.

    Parameters
    ----------
    out : Path or None
        As the user gives it.
    source : Path
        survey.toml or another file, or the folder that holds it.
    command : str
        Name of the command.
    is_by_name : bool
        Take the file's own name, as a folder may hold several, in place of its folder's.

    Raises
    ------
    typer.Exit
        Where the input is a URL, beside which nothing is written.
    """
    if out is not None:
        return out
    with exit_code(Exit.USAGE):
        from mlscorr.io.store import is_remote

        if is_remote(source):
            raise ValueError(f"{source} is a URL. Give a folder for the results with -o OUT.")
    folder = source.absolute()
    if is_by_name:
        folder = folder.with_suffix("")
    elif not folder.is_dir():
        folder = folder.parent
    chosen = folder.parent / f"{folder.name or 'survey'}-{command}"
    say(f"Results: {chosen} (-o chooses another folder).")
    return chosen


def has_toml(folder: Path) -> bool:
    """Return True for a file, a URL, or a folder with any TOML file: nothing is inferred then.

    Parameters
    ----------
    folder : Path
    """
    from mlscorr.io.store import is_remote

    if is_remote(folder) or not folder.is_dir():
        return True
    return any(folder.glob("*.toml"))


class InferredSurvey(NamedTuple):
    """The survey.toml that was made of a folder without one.

    Attributes
    ----------
    path : Path
        Of a temporary file, which is as far from the clouds as the one beside the results.
    text : str
    """

    path: Path
    text: str


@contextmanager
def inferred_survey(folder: Path, out: Path | None) -> Iterator[InferredSurvey]:
    """Make a survey.toml of the files in a folder, which stays as it is.

    Parameters
    ----------
    folder : Path
    out : Path or None
        Folder of the results, beside which the file is for the time being; None where nothing is
        written, and it is in the system's temporary folder.

    Yields
    ------
    InferredSurvey

    Raises
    ------
    ValueError
        Where files are missing or do not fit, or the user has to answer a question.
    """
    import mlscorr

    with ExitStack() as ends:
        place = None
        prefix = "mlscorr-"
        if out is not None:
            place = out.absolute().parent
            place.mkdir(parents=True, exist_ok=True)
            prefix = f".{out.name}.init-"
        temporary = Path(ends.enter_context(tempfile.TemporaryDirectory(prefix=prefix, dir=place)))
        started = mlscorr.init(folder, temporary / "survey.toml")
        if started.places:
            options = " ".join(spot.option for spot in started.places)
            raise ValueError(
                f"{' '.join(started.questions)} Answer in a survey.toml, with your values: "
                f"mlscorr init {folder} {options}"
            )
        for role in started.roles:
            if role.role not in ("none", "table"):
                say(f"{role.role}: {role.path.name} ({role.reason})")
        yield InferredSurvey(started.write(), started.text)
