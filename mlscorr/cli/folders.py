"""Folders of results, by default next to the input, and folders of files as surveys."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from mlscorr.cli.terminal import Exit, exit_code, say


def chosen_out(out: Path | None, source: Path, command: str, is_by_name: bool = False) -> Path:
    """Return the folder for the results; by default FOLDER-COMMAND next to the input's FOLDER.

    Parameters
    ----------
    out : Path or None
        Given by the user.
    source : Path
        survey.toml or another file, or its folder.
    command : str
        Name of the command.
    is_by_name : bool
        True to use the file's own name instead of its folder's, because a folder may contain
        several.

    Raises
    ------
    typer.Exit
        If the input is a URL, next to which nothing is written.
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
    """Return True for a file, a URL, or a folder with any TOML file, for which nothing is inferred.

    Parameters
    ----------
    folder : Path
    """
    from mlscorr.io.store import is_remote

    if is_remote(folder) or not folder.is_dir():
        return True
    return any(folder.glob("*.toml"))


class InferredSurvey(NamedTuple):
    """survey.toml that was made for a folder without one.

    Attributes
    ----------
    path : Path
        Path of a temporary file, in the same position relative to the clouds as the one with the
        results.
    text : str
    """

    path: Path
    text: str


@contextmanager
def inferred_survey(folder: Path, out: Path | None) -> Iterator[InferredSurvey]:
    """Make a survey.toml of the files in a folder, without changing it.

    Parameters
    ----------
    folder : Path
    out : Path or None
        Folder of the results, next to which the temporary file is made; None to use the system's
        temporary folder, if nothing is written.

    Yields
    ------
    InferredSurvey

    Raises
    ------
    ValueError
        If files are missing or do not match, or the user has to answer a question.
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
