"""Shared frame of all commands: argument checks, progress, JSON output."""

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mlscorr.cli.progress import Progress, progress_bars
from mlscorr.cli.terminal import Exit, deafen, exit_code, say, warn

NAMED = 10  # files in a sentence; more are counted


@contextmanager
def work(
    out: Path,
    overwrite: bool,
    survey: Path | None = None,
    inputs: Sequence[Path] = (),
    planned: bool = False,
) -> Iterator[Progress]:
    """Check the output folder, then show progress; invalid data end with a message and their code.

    Older files in the folder that the command did not overwrite are listed at the end, because they
    may be results of an earlier run.

    Parameters
    ----------
    out : Path
        Folder for the results.
    overwrite : bool
    survey : Path, optional
        survey.toml: the files that it names are inputs.
    inputs : sequence of Path
        Further inputs.
    planned : bool
        True if the survey may have no cloud.

    Yields
    ------
    progress : function
        See progress_bars.
    """
    with exit_code(Exit.USAGE), progress_bars():
        from mlscorr.io.store import announced, check_output, check_unchanged, input_file
        from mlscorr.io.surveys import input_files
        from mlscorr.pipeline import recorded_log

        if survey is not None:
            files = input_files(survey, planned)
        else:
            files = []
        check_output(out, [*files, *inputs], overwrite)
        states = [input_file("input", file) for file in [*files, *inputs]]
        before = _entries(out)
    with (
        exit_code(Exit.BAD_DATA, lambda: _entries(out) != before),
        _noise_said(),
        recorded_log(sys.argv[1:]),
        progress_bars() as progress,
        announced(progress),
    ):
        progress("Reading the survey")
        try:
            yield progress
        except ValueError:
            check_unchanged(states)  # the likelier cause
            raise
    _name_older(out, before or {})
    deafen()


@contextmanager
def _noise_said():
    """Report the number of points omitted as noise, if any, at the end."""
    from mlscorr.io.clouds import counted_noise

    with counted_noise() as noise:
        try:
            yield
        finally:
            if noise.sentence:
                say(noise.sentence)


def _entries(out):
    """Names and states of the files in a folder, None without one, to detect new results."""
    if not out.is_dir():
        return None
    return {
        os.path.relpath(os.path.join(folder, name), out): os.lstat(f"{folder}/{name}").st_ino
        for folder, _, names in os.walk(out)
        for name in names
    }


def _name_older(out, before):
    """List the files of a folder that have not changed."""
    after = _entries(out) or {}
    older = sorted(name for name, number in before.items() if after.get(name) == number)
    if not older:
        return
    if len(older) > NAMED:
        more = f" and {len(older) - NAMED} more"
    else:
        more = ""
    warn(
        f"Left unchanged in {out}, not written by this run: {', '.join(older[:NAMED])}{more}. "
        "Delete them if they are results of an earlier run."
    )


def print_json(content: dict, as_json: bool) -> None:
    """Print a document on stdout, if requested.

    Parameters
    ----------
    content : dict
    as_json : bool
    """
    if as_json:
        print(json.dumps(content))
