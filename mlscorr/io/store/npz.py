"""Writing .npz files whose arrays are longer than memory, block by block."""

import math
import zipfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.output import output_file


class NpzWriter:
    """Collects named arrays for one new file, as np.savez writes it: whole and growing ones.

    The file appears at the end of a ``with`` block, whole or not at all. A zip takes one array
    after the other, so those that grow lie in files of their own until the end, which need as
    much space again.

    Parameters
    ----------
    path : path

    Raises
    ------
    OSError
        When the disk refuses.

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
        self._growing: dict[str, tuple[BinaryIO, np.ndarray]] = {}  # file, and no rows as in it
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
        """Size of the growing arrays so far. Units: bytes."""
        return sum(file.tell() for file, _ in self._growing.values())

    def put(self, name: str, array: ArrayLike) -> None:
        """Take a whole array."""
        self._whole[name] = np.asanyarray(array)

    def append(self, name: str, rows: ArrayLike) -> None:
        """Take more rows of a growing array.

        Parameters
        ----------
        name : str
        rows : (n, ...) array
            All of one type and one shape but for their number.

        Raises
        ------
        ValueError
            When they don't fit those before them.
        """
        rows = np.ascontiguousarray(rows)
        if name not in self._growing:
            path = self._path.with_name(f"{self._path.name}.{name}.part")
            self._growing[name] = self._files.enter_context(path.open("wb")), rows[:0].copy()
        file, none = self._growing[name]
        if (rows.dtype, rows.shape[1:]) != (none.dtype, none.shape[1:]):
            raise ValueError(
                f"Rows of {rows.dtype} {rows.shape[1:]} don't fit those of {none.dtype} "
                f"{none.shape[1:]} before them."
            )
        file.write(rows.data)

    def _assemble(self, archive):
        for name, (file, none) in self._growing.items():
            path = Path(file.name)
            shape = none.shape[1:]
            length = path.stat().st_size // (none.dtype.itemsize * math.prod(shape))
            header = np.lib.format.header_data_from_array_1_0(none) | {"shape": (length, *shape)}
            # the date that ZipInfo starts with, so that the same arrays give the same bytes
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
