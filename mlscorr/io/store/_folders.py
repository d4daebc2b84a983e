"""Folders that take another's place."""

import ctypes
import os
import shutil
import tempfile
from pathlib import Path


def take_along(out: Path, part: Path) -> None:
    """Link into part what out holds beside it, so that part can take its place."""
    for path in sorted(out.rglob("*")):
        twin = part / path.relative_to(out)
        is_folder = path.is_dir() and not path.is_symlink()
        if os.path.lexists(twin):
            if is_folder != twin.is_dir():
                raise IsADirectoryError(f"{path} is a folder, where a file belongs.")
        elif is_folder:
            twin.mkdir()
        else:
            try:
                os.link(path, twin, follow_symlinks=False)
            except OSError:  # a disk that knows no links, or files of another user
                shutil.copy2(path, twin, follow_symlinks=False)


def exchange(out: Path, part: Path) -> None:
    """Exchange two folders, at once where the system can."""
    if os.name == "nt":
        library = None
    else:
        library = ctypes.CDLL(None, use_errno=True)
    rename = getattr(library, "renameat2", None)
    # AT_FDCWD and RENAME_EXCHANGE of linux/fs.h
    here = -100
    swap = 2
    if rename is None or rename(here, os.fsencode(part), here, os.fsencode(out), swap):
        move_into(out, part)


def move_into(out: Path, part: Path) -> None:
    """Move the files of part into out file by file; on failure what they replace is put back."""
    files = [path.relative_to(part) for path in sorted(part.rglob("*")) if path.is_file()]
    replaced = Path(tempfile.mkdtemp(dir=part))
    made = []
    try:
        for file in files:
            if not (out / file).parent.exists():
                (out / file).parent.mkdir()
                made.append(file.parent)
            if (out / file).is_dir():
                raise IsADirectoryError(f"{out / file} is a folder, where a file belongs.")
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
    """Remove a folder, also when an impatient user interrupts once more."""
    while folder.exists():
        try:
            shutil.rmtree(folder, ignore_errors=True)
            return
        except KeyboardInterrupt:
            continue
