"""Results: a folder that appears whole or not at all, and JSON documents."""

import errno
import glob
import json
import math
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from mlscorr.io.store._folders import exchange, move_into, remove, take_along
from mlscorr.io.store.inputs import check_unchanged
from mlscorr.io.store.publishing import check_contents, publish, scratch_folder
from mlscorr.io.store.storage import as_path, is_remote
from mlscorr.survey import InputFile

try:
    import fcntl
except ImportError:  # Windows: no folder or run has a lock, and what killed runs leave stays
    fcntl = None

PART = ".part"  # ends the name of what isn't whole yet


def check_output(
    out: str | Path,
    inputs: Iterable[str | Path],
    overwrite: bool = False,
    folders: Iterable[str] = (),
) -> None:
    """Refuse an output folder that holds an input, or anything that may not be replaced.

    Parameters
    ----------
    out : path
    inputs : iterable of path
        Files that must stay as they are.
    overwrite : bool
        Whether files of the same name may be replaced.
    folders : iterable of str
        Names of folders in it that get results, too.

    Raises
    ------
    ValueError
        For a folder that can't be meant.
    OSError
        When it can't be written.
    """
    if is_remote(out):
        raise ValueError(
            f"{out} is a URL, and these results go to a folder of a disk. Those of a project.toml "
            'may go to a store, and two lines make one: [[drive]] and survey = "survey.toml".'
        )
    out = Path(out)
    for path in (out, *out.parents):
        if path.is_symlink() and not path.exists():
            raise ValueError(
                f"{path} is a link to {os.readlink(path)}, which does not exist. Make that folder, "
                "or choose another name."
            )
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; the results need a folder. Choose another name.")
    files = [Path(path) for path in inputs if not is_remote(path)]
    # a link to an input counts where it stands and where it leads
    places = [(path.resolve().parent, path.parent.resolve()) for path in files]
    own = {(out / name).resolve(): Path(name) for name in (*folders, "")}
    pairs = zip(files, places, strict=True)
    held = [str(own[where] / path.name) for path, two in pairs for where in two if where in own]
    check_contents(out, held, [] if overwrite else _entries(out))
    _place(out)


def _entries(out):
    """Names in a folder, but those of results that aren't whole yet."""
    if out.is_dir():
        names = sorted(path.name for path in out.iterdir())
    else:
        names = []
    return [n for n in names if not (n.startswith(_prefix(out)) and n.endswith(PART))]


def _prefix(out):
    return f".{out.resolve().name}."


def _place(out):
    """The folder for what isn't whole yet: beside out, or inside where that is another disk.

    A folder is made there, moved into out if there is one, and removed: what can't be written is
    told early.
    """
    above = next(path for path in out.resolve().absolute().parents if path.exists())
    probe = _part(out, above)
    inside = out.resolve() / probe.name
    try:
        probe.mkdir()
        if out.is_dir():
            probe.rename(inside)
    except OSError as error:
        if out.is_dir() and os.access(out, os.W_OK):
            return out.resolve()
        refusing, cause = (out, "not writable") if probe.exists() else (above, error.strerror)
        lacks = "used" if out.is_dir() else "made"
        raise OSError(
            f"the output folder {out} can't be {lacks}: {refusing} takes no folder ({cause}). "
            "Choose another place."
        ) from None
    finally:  # wherever an interruption left it
        for folder in (probe, inside):
            with suppress(OSError):  # not there, or on a disk that can only be read
                folder.rmdir()
    return out.resolve().parent


def _part(out, place):
    """A name for what isn't whole yet, known before it is made, so that it can be removed."""
    return place / f"{_prefix(out)}{secrets.token_hex(8)}{PART}"


@contextmanager
def output_file(path: str | Path) -> Iterator[Path]:
    """A file to write into, which takes its name only when all went well.

    It stands beside the path until then. A file there is replaced.

    Parameters
    ----------
    path : path

    Yields
    ------
    Path
        The file to write into.
    """
    path = as_path(path)
    if is_remote(path):
        with scratch_folder() as folder:
            yield folder / path.name
            publish(folder / path.name, path)
        return
    part = path.with_name(path.name + PART)
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def output_folder(
    out: str | Path,
    inputs: Sequence[InputFile] = (),
    overwrite: bool = False,
    folders: Iterable[str] = (),
) -> Iterator[Path]:
    """A folder to write into, which takes its name only when all went well.

    It stands beside its place until then, locked by this process. What processes left there that
    were killed is removed.

    Parameters
    ----------
    out : path
    inputs : sequence of InputFile
        Files that must stay as they are, and be what they were when they were read.
    overwrite : bool
        Whether files of the same name are replaced; others stay.
    folders : iterable of str
        As of check_output.

    Yields
    ------
    Path
        The folder to write into.

    Raises
    ------
    ValueError
        As check_output.
    OSError
        When an input has changed, another run has written into the folder, or the disk refuses.
    """
    check_output(out, [file.path for file in inputs], overwrite, folders)
    check_unchanged(inputs)
    out = Path(out).resolve()
    out.parent.mkdir(parents=True, exist_ok=True)
    place = _place(out)
    _remove_abandoned(out, place)
    part = _part(out, place)
    with _locked(part):
        yield part
        check_unchanged(inputs)
        _finish(part, out, overwrite)


@contextmanager
def _locked(part):
    """Make a folder, hold its lock, which ends with the process, and remove what is left of it."""
    with ExitStack() as ends:
        ends.callback(remove, part)
        while not part.exists():  # at first, and where another run took it for an abandoned one
            part.mkdir()
            if fcntl is None:
                break
            lock = os.open(part, os.O_RDONLY)
            ends.callback(os.close, lock)
            with suppress(OSError):  # a disk that knows no locks
                fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _remove_abandoned(out, place):
    """Remove what runs into the same folder left that were killed: nobody holds its lock."""
    if fcntl is None:
        return
    for part in place.glob(f"{glob.escape(_prefix(out))}*{PART}"):
        with suppress(OSError):
            lock = os.open(part, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                remove(part)
            finally:
                os.close(lock)


def _finish(part, out, overwrite):
    """Give the folder its name, all at once where out is on the disk of its parent."""
    is_inside = part.parent == out
    try:
        if not is_inside:
            if out.is_dir():
                shutil.copymode(out, part)
            os.rename(part, out)  # new or empty
            return
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
    if not overwrite and (present := _entries(out)):
        raise FileExistsError(
            f"another run wrote {len(present)} entries into {out} meanwhile (first: {present[0]}). "
            "They were left as they are, and nothing of this run was kept. Choose another folder."
        )
    if is_inside:
        move_into(out, part)
    else:
        take_along(out, part)
        exchange(out, part)


def document(name: str, content: dict) -> dict:
    """A JSON document with its schema first; values that are not finite become None.

    Parameters
    ----------
    name : str
        Of the schema.
    content : dict

    Returns
    -------
    dict
    """
    return {"schema": f"mlscorr.{name}/1", **_finite(content)}


def _finite(value):
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_json(path: str | Path, content: dict) -> None:
    """Write a document as JSON, whole or not at all.

    Parameters
    ----------
    path : path
    content : dict
        Without numbers that are not finite.
    """
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    with output_file(path) as part:
        part.write_text(text + "\n", encoding="utf-8")
