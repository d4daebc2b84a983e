"""Arrays longer than memory, on disk: records split into groups, and growing .npz files.

Also checks of the disk space that both need.
"""

import errno
import math
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.output import output_file
from mlscorr.io.store.storage import is_remote


class Spool:
    """Groups of records in a file, each contiguous with a length known in advance.

    Parameters
    ----------
    file : binary file
        Open for reading and writing. The records follow its current position.
    counts : (g,) int array
        Number of records of each group.
    record_length : int
        Units: bytes.
    """

    def __init__(self, file: BinaryIO, counts: np.ndarray, record_length: int):
        self._file = file
        self._length = record_length
        self.counts = np.asarray(counts, np.int64)
        self._starts = file.tell() + (np.cumsum(self.counts) - self.counts) * record_length
        self._filled = np.zeros(len(self.counts), np.int64)

    def put(self, records: np.ndarray, group: np.ndarray) -> None:
        """Append records to their groups.

        Parameters
        ----------
        records : (n,) array
        group : (n,) int array
        """
        order = np.argsort(group, kind="stable")
        records, (groups, firsts) = records[order], np.unique(group[order], return_index=True)
        for number, part in zip(groups.tolist(), np.split(records, firsts[1:]), strict=True):
            self._file.seek(int(self._starts[number] + self._filled[number] * self._length))
            self._file.write(part.tobytes())
            self._filled[number] += len(part)

    def blocks(self, group: int, size: int = SETTINGS.chunk_points) -> Iterator[np.ndarray]:
        """Yield records of a group in the order of insertion, some at a time.

        Parameters
        ----------
        group, size : int

        Yields
        ------
        (n,) array of bytes of each record
        """
        for first in range(0, int(self.counts[group]), size):
            count = min(size, int(self.counts[group]) - first)
            self._file.seek(int(self._starts[group]) + first * self._length)
            yield np.frombuffer(self._file.read(count * self._length), f"V{self._length}")

    def get(self, group: int) -> np.ndarray:
        """Return all records of a group: (n,) array of bytes of each.

        Parameters
        ----------
        group : int
        """
        return next(self.blocks(group, int(self.counts[group])))

    def replace(self, group: int, records: np.ndarray) -> None:
        """Replace a group's records by the same ones in another order.

        Parameters
        ----------
        group : int
        records : (n,) array
        """
        self._file.seek(int(self._starts[group]))
        self._file.write(records.tobytes())


class NpzWriter:
    """Writer of named arrays to one new file, as np.savez does, including growing arrays.

    The file is written atomically at the end of a ``with`` block. A zip stores arrays one after
    another, so growing arrays are kept in separate files until the end, which need the same space
    again.

    Parameters
    ----------
    path : path

    Raises
    ------
    OSError
        If the disk refuses.

    Examples
    --------
    >>> import tempfile
    >>> path = tempfile.mkdtemp() + "/truth.npz"
    >>> with NpzWriter(path) as writer:
    ...     for start in (0, 3):
    ...         writer.append("number", np.arange(start, start + 3))
    ...     writer.put("unit", np.array("m"))
    >>> {name: array.tolist() for name, array in np.load(path).items()}
    {'number': [0, 1, 2, 3, 4, 5], 'unit': 'm'}
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._whole: dict[str, np.ndarray] = {}
        self._growing: dict[str, tuple[BinaryIO, np.ndarray]] = {}  # file, empty array of its type
        self._files = ExitStack()
        self.watch: Callable[[int], object] = lambda _: None  # bytes of growing arrays just copied

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            self._files.close()
            if kind is None:
                with (
                    output_file(self._path) as part,
                    zipfile.ZipFile(part, "w", zipfile.ZIP_STORED) as archive,
                ):
                    self._assemble(archive)
        finally:
            for file, _ in self._growing.values():
                Path(file.name).unlink(missing_ok=True)

    @property
    def growing(self) -> int:
        """Current size of the growing arrays. Units: bytes."""
        return sum(file.tell() for file, _ in self._growing.values())

    def put(self, name: str, array: ArrayLike) -> None:
        """Store a complete array."""
        self._whole[name] = np.asanyarray(array)

    def append(self, name: str, rows: ArrayLike) -> None:
        """Append rows to a growing array.

        Parameters
        ----------
        name : str
        rows : (n, ...) array
            All of one type, and of one shape except their number.

        Raises
        ------
        ValueError
            If they do not match the previous ones.
        """
        rows = np.ascontiguousarray(rows)
        if name not in self._growing:
            path = self._path.with_name(f"{self._path.name}.{name}.part")
            self._growing[name] = self._files.enter_context(path.open("wb")), rows[:0].copy()
        file, none = self._growing[name]
        if (rows.dtype, rows.shape[1:]) != (none.dtype, none.shape[1:]):
            raise ValueError(
                f"Rows of {rows.dtype} {rows.shape[1:]} do not match the rows of {none.dtype} "
                f"{none.shape[1:]} before them."
            )
        file.write(rows.data)

    def _assemble(self, archive):
        for name, (file, none) in self._growing.items():
            path = Path(file.name)
            shape = none.shape[1:]
            length = path.stat().st_size // (none.dtype.itemsize * math.prod(shape))
            header = np.lib.format.header_data_from_array_1_0(none) | {"shape": (length, *shape)}
            # the initial date of ZipInfo, so that the same arrays give the same bytes
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array_header_2_0(member, header)
                with open(path, "rb") as rows:
                    while block := rows.read(SETTINGS.copied_bytes):
                        member.write(block)
                        self.watch(len(block))
            path.unlink()
        for name, array in self._whole.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


def check_space(folder: Path, needed: int, what: str) -> None:
    """Refuse early if a disk has too little space.

    Parameters
    ----------
    folder : path
    needed : int
        Units: bytes.
    what : str
        Purpose and remedy; end of a sentence.

    Raises
    ------
    OSError
    """
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            f"{folder} has {free / 1e9:.1f} GB free; {needed / 1e9:.1f} GB are needed {what}"
        )


@contextmanager
def telling_space(folder: Path) -> Iterator[None]:
    """Report which disk is full, and how much space is left, while a project writes.

    Parameters
    ----------
    folder : path

    Raises
    ------
    OSError
    """
    try:
        yield
    except OSError as error:
        if error.errno != errno.ENOSPC or is_remote(folder):
            raise
        free = shutil.disk_usage(folder).free / 1e6
        raise OSError(
            f"{error.strerror}: the disk of {folder} has {free:.1f} MB free. Corrected clouds "
            "need as much space as the input clouds (mlscorr check states how much). Free some "
            "space and continue with --resume."
        ) from error
