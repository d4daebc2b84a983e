"""Results: folders written atomically, single files, and JSON documents.

Incomplete results are next to their destination, locked by the process that writes them.
"""

import ctypes
import errno
import glob
import json
import math
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from mlscorr.io.store.inputs import check_unchanged
from mlscorr.io.store.publishing import check_contents, publish, scratch_folder
from mlscorr.io.store.storage import as_path, is_remote
from mlscorr.survey import InputFile

try:
    import fcntl
except ImportError:  # Windows: no locks on folders or runs, and leftovers of killed runs remain
    fcntl = None
PART = ".part"  # suffix of names of incomplete results


def check_output(
    out: str | Path,
    inputs: Iterable[str | Path],
    overwrite: bool = False,
    folders: Iterable[str] = (),
) -> None:
    """Refuse an output folder that contains an input, or anything that must not be replaced.

    Parameters
    ----------
    out : path
    inputs : iterable of path
        Files that must not change.
    overwrite : bool
        True if files of the same name may be replaced.
    folders : iterable of str
        Names of subfolders that also receive results.

    Raises
    ------
    ValueError
        If the folder is unsuitable.
    OSError
        If it can't be written.
    """
    if is_remote(out):
        raise ValueError(
            f"{out} is a URL, but these results need a folder on a disk. Results of a "
            "project.toml can go to a store, and two lines make one: [[drive]] and survey = "
            '"survey.toml".'
        )
    out = Path(out)
    for path in (out, *out.parents):
        if path.is_symlink() and not path.exists():
            raise ValueError(
                f"{path} is a link to {os.readlink(path)}, which does not exist. Create that "
                "folder, or choose another name."
            )
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file, but the results need a folder. Choose another name.")
    files = [Path(path) for path in inputs if not is_remote(path)]
    # a link to an input counts at both ends
    places = [(path.resolve().parent, path.parent.resolve()) for path in files]
    own = {(out / name).resolve(): Path(name) for name in (*folders, "")}
    pairs = zip(files, places, strict=True)
    inside = [str(own[where] / path.name) for path, two in pairs for where in two if where in own]
    present = [] if overwrite else _entries(out)
    check_contents(out, inside, present)
    _place(out)


def _entries(out):
    """Names in a folder, except those of incomplete results."""
    if not out.is_dir():
        return []
    names = sorted(path.name for path in out.iterdir())
    return [n for n in names if not (n.startswith(_prefix(out)) and n.endswith(PART))]


def _prefix(out):
    return f".{out.resolve().name}."


def _place(out):
    """Folder for incomplete results: next to out, or inside it if that is another disk.

    A folder is created there, moved into out if it exists, and removed, so that missing permissions
    are reported early.
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
        lacks = "used" if out.is_dir() else "created"
        if probe.exists():
            refusal = f"{out} is not writable"
        else:
            refusal = f"no folder can be created in {above} ({error.strerror})"
        raise OSError(
            f"the output folder {out} can't be {lacks}: {refusal}. Choose another place."
        ) from None
    finally:  # at any stage of an interruption
        for folder in (probe, inside):
            with suppress(OSError):  # missing, or on a read-only disk
                folder.rmdir()
    return out.resolve().parent


def _part(out, place):
    """Name for an incomplete result, known in advance so that it can be removed."""
    return place / f"{_prefix(out)}{secrets.token_hex(8)}{PART}"


@contextmanager
def output_folder(
    out: str | Path,
    inputs: Sequence[InputFile] = (),
    overwrite: bool = False,
    folders: Iterable[str] = (),
) -> Iterator[Path]:
    """Open a folder to write into, which gets its name only on success.

    Until then it is next to its destination, locked by this process. Leftovers of killed processes
    are removed.

    Parameters
    ----------
    out : path
    inputs : sequence of InputFile
        Files that must not change, and must be unchanged since they were read.
    overwrite : bool
        True to replace files of the same name; others are kept.
    folders : iterable of str
        See ``check_output``.

    Yields
    ------
    Path
        The folder to write into.

    Raises
    ------
    ValueError
        See ``check_output``.
    OSError
        If an input has changed, another run has written into the folder, or the disk refuses.
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
    """Create a folder with a lock that ends with the process, and remove its remains."""
    with ExitStack() as ends:
        ends.callback(remove, part)
        while not part.exists():  # first time, or another run removed it as abandoned
            part.mkdir()
            if fcntl is None:
                break
            lock = os.open(part, os.O_RDONLY)
            ends.callback(os.close, lock)
            with suppress(OSError):  # a disk without locks
                fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _remove_abandoned(out, place):
    """Remove leftovers of killed runs in the same folder: their locks are free."""
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
    """Give the folder its name, atomically if out is on the disk of its parent."""
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
            f"another run wrote {len(present)} entries into {out} in the meantime (first: "
            f"{present[0]}). They were not changed, and nothing of this run was kept. Choose "
            "another folder."
        )
    if is_inside:
        _move_into(out, part)
    else:
        _take_along(out, part)
        _exchange(out, part)


def _take_along(out: Path, part: Path) -> None:
    """Link other contents of out into part, so that part can replace it."""
    for path in sorted(out.rglob("*")):
        twin = part / path.relative_to(out)
        is_folder = path.is_dir() and not path.is_symlink()
        if os.path.lexists(twin):
            if is_folder != twin.is_dir():
                raise IsADirectoryError(f"{path} is a folder, but a file is needed there.")
        elif is_folder:
            twin.mkdir()
        else:
            try:
                os.link(path, twin, follow_symlinks=False)
            except OSError:  # a disk without links, or files of another user
                shutil.copy2(path, twin, follow_symlinks=False)


def _exchange(out: Path, part: Path) -> None:
    """Exchange two folders, atomically if the system can."""
    rename = None
    if os.name != "nt":
        rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    # AT_FDCWD and RENAME_EXCHANGE of linux/fs.h
    here = -100
    swap = 2
    if rename is None or rename(here, os.fsencode(part), here, os.fsencode(out), swap):
        _move_into(out, part)


def _move_into(out: Path, part: Path) -> None:
    """Move the files of part into out one by one; on failure, replaced files are restored."""
    files = [path.relative_to(part) for path in sorted(part.rglob("*")) if path.is_file()]
    replaced = Path(tempfile.mkdtemp(dir=part))
    made = []
    try:
        for file in files:
            if not (out / file).parent.exists():
                (out / file).parent.mkdir()
                made.append(file.parent)
            if (out / file).is_dir():
                raise IsADirectoryError(f"{out / file} is a folder, but a file is needed there.")
            if (out / file).exists():
                (replaced / file).parent.mkdir(exist_ok=True)
                os.replace(out / file, replaced / file)
            os.replace(part / file, out / file)
    except BaseException:
        for file in files:
            if not (part / file).exists():
                (out / file).unlink(missing_ok=True)
            if (replaced / file).exists():
                os.replace(replaced / file, out / file)
        for folder in made:
            (out / folder).rmdir()
        raise


def remove(folder: Path) -> None:
    """Remove a folder, even if the user interrupts again."""
    while folder.exists():
        try:
            shutil.rmtree(folder, ignore_errors=True)
            return
        except KeyboardInterrupt:
            continue


@contextmanager
def output_file(path: str | Path) -> Iterator[Path]:
    """Open a file to write into, which gets its name only on success.

    Until then it is next to the path. An existing file is replaced.

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


def document(name: str, content: dict) -> dict:
    """Make a JSON document with its schema first; non-finite values become None.

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
    """Write a document as JSON, atomically.

    Parameters
    ----------
    path : path
    content : dict
        Without numbers that are not finite.
    """
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    with output_file(path) as part:
        part.write_text(text + "\n", encoding="utf-8")
