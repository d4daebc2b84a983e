"""What every command does around its own work: refuse what can't be meant, watch, print JSON."""

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mlscorr.cli.progress import Progress, progress_bars
from mlscorr.cli.terminal import Exit, deafen, exit_code, say


@contextmanager
def work(
    out: Path, overwrite: bool, survey: Path | None = None, inputs: Sequence[Path] = (),
    planned: bool = False,
) -> Iterator[Progress]:  # fmt: skip
    """Check where results go, then show progress; bad data end with a sentence and their code.

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
        Whether the survey may have no cloud.

    Yields
    ------
    progress : function
        See progress_bars.
    """
    with exit_code(Exit.USAGE):
        from mlscorr.io.inputs import check_unchanged, input_file
        from mlscorr.io.output import check_output
        from mlscorr.io.preparation import announced
        from mlscorr.io.survey_file import input_files

        files = input_files(survey, planned) if survey is not None else []
        check_output(out, [*files, *inputs], overwrite)
        states = [input_file("input", file) for file in [*files, *inputs]]
        before = _entries(out)
    with (
        exit_code(Exit.BAD_DATA, lambda: _entries(out) != before),
        _noise_said(),
        progress_bars() as progress,
        announced(progress),
    ):
        try:
            yield progress
        except ValueError:
            check_unchanged(states)  # the likelier cause
            raise
    deafen()


@contextmanager
def _noise_said():
    """Say in the end how many points were left out as noise, where there were any."""
    from mlscorr.io.noise import counted_noise

    with counted_noise() as noise:
        try:
            yield
        finally:
            if noise.sentence:
                say(noise.sentence)


def _entries(out):
    """Names and numbers of the files in a folder, None without one: whether results were put in."""
    return {e.name: e.inode() for e in os.scandir(out)} if out.is_dir() else None


def print_json(content: dict, as_json: bool) -> None:
    """Print a document on stdout, if asked to.

    Parameters
    ----------
    content : dict
    as_json : bool
    """
    if as_json:
        print(json.dumps(content))
