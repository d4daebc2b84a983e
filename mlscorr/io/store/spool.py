"""Point records parted into groups on disk, where memory does not hold them."""

import errno
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.storage import is_remote


class Spool:
    """Groups of records in a file, each in one run whose length is known before.

    Parameters
    ----------
    file : binary file
        Open for reading and writing. From its position on it holds the records, as they are.
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
        """Records of a group, in the order in which they were put, so many at a time.

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
        """All records of a group: (n,) array of bytes of each.

        Parameters
        ----------
        group : int
        """
        return next(self.blocks(group, int(self.counts[group])))

    def replace(self, group: int, records: np.ndarray) -> None:
        """Put a group's records in another order.

        Parameters
        ----------
        group : int
        records : (n,) array
        """
        self._file.seek(int(self._starts[group]))
        self._file.write(records.tobytes())


def check_space(folder: Path, needed: int, what: str) -> None:
    """Refuse at once what a disk will not hold hours later.

    Parameters
    ----------
    folder : path
    needed : int
        Units: bytes.
    what : str
        Why, and what to do about it: ends a sentence.

    Raises
    ------
    OSError
    """
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            f"{folder} has {free / 1e9:.1f} GB free of {needed / 1e9:.1f} GB that are needed {what}"
        )


@contextmanager
def telling_space(folder: Path) -> Iterator[None]:
    """Where a project writes: of a full disk it is said which, and how much is left.

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
            f"{error.strerror}: the disk of {folder} has {free:.1f} MB free. Corrected clouds take "
            "as much as those they are made of (mlscorr check tells how much). Make room, and "
            "--resume goes on."
        ) from error
