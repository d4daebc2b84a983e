"""Files on a disk by a pattern, of which ``**`` stands for all folders, each entered once.

Python's glob follows a link each time that it meets it: two folders that link to each other are
entered in every order, some 2^40 times before the system refuses.
"""

import glob
import math
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

ALL_FOLDERS = "**"


def names_like(folder: Path, pattern: str) -> set[str]:
    """Names of files and folders by a pattern, from a folder.

    Parameters
    ----------
    folder : Path
    pattern : str
        As of Python's glob: ``**`` between slashes stands for any number of folders, hidden ones
        left out.
    """
    parts = re.split(r"[\\/]" if os.sep == "\\" else "/", pattern)
    if ALL_FOLDERS not in parts:
        return set(glob.glob(pattern, root_dir=folder))
    place = parts.index(ALL_FOLDERS)
    before = "/".join([*parts[:place], ""])
    behind = "/".join(parts[place + 1 :]) or "*"
    names = set()
    for top in glob.glob(before, root_dir=folder) if before else [""]:
        for below in folders_below(folder / top):
            name = Path(top) / below.relative_to(folder / top)
            names |= {str(name / file) for file in names_like(below, behind)}
    return names


def folders_below(
    folder: Path, depth: float = math.inf, is_wanted: Callable[[Path], bool] = lambda _: True
) -> Iterator[Path]:
    """A folder and those within it that are not hidden; links are followed, each folder comes once.

    Folders themselves come before links to them. A link to a folder that holds the link, or the
    first folder, is not followed.

    Parameters
    ----------
    folder : Path
    depth : float
        Number of levels below the folder.
    is_wanted : function of a Path
        Whether one of the folders within it is entered.

    Yields
    ------
    Path
    """
    top = os.path.realpath(folder)
    entered = set()
    waiting = [(folder, 0)]
    links: list[tuple[Path, int]] = []
    while waiting or links:
        here, level = waiting.pop() if waiting else links.pop(0)
        real = os.path.realpath(here)
        if real in entered:
            continue
        entered.add(real)
        if level and not is_wanted(here):
            continue
        yield here
        for path in _folders_in(here) if level < depth else ():
            if not path.is_symlink():
                waiting.append((path, level + 1))
            elif not any(_holds(os.path.realpath(path), inner) for inner in (real, top)):
                links.append((path, level + 1))


def _folders_in(folder):
    """Folders in a folder, links to folders among them; none in one that may not be read."""
    try:
        names = sorted(os.listdir(folder), reverse=True)
    except OSError:
        return []
    return [folder / name for name in names if name[0] != "." and (folder / name).is_dir()]


def _holds(folder, inner):
    """Return True if a real path is that of a folder, or lies below it."""
    return inner == folder or inner.startswith(os.path.join(folder, ""))
