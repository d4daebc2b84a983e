"""Files that hold the same as another one."""

from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from mlscorr.io.identity import FileIdentity
from mlscorr.io.las_checks import read_layout
from mlscorr.io.storage import file_state, is_remote


def find_copies(paths: Iterable[Path]) -> dict[Path, Path]:
    """Files that hold the same as one before them, each with that one.

    Only those of one size are opened, and told by their heads and tails. Those without points that
    can be read count nothing twice, and are refused where they are read.

    Parameters
    ----------
    paths : iterable of Path
    """
    there = [path for path in paths if is_remote(path) or path.is_file()]
    sizes = {path: file_state(path)[0] for path in there}
    count, firsts, copies = Counter(sizes.values()), {}, {}
    for path in (path for path, size in sizes.items() if size and count[size] > 1):
        with suppress(OSError, ValueError):
            first = firsts.setdefault(FileIdentity.of(path).content, path)
            if first != path and read_layout(path).points:
                copies[path] = first
    return copies
