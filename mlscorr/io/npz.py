"""Writing .npz files whose arrays are longer than memory, block by block."""

import zipfile
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

BLOCK = 1 << 20  # bytes


@contextmanager
def npz_writer(path):
    """An NpzWriter for one new file, as np.savez writes it, which appears whole or not at all.

    A zip takes one array after the other, so those that grow lie in files of their own until the
    end, which need as much space again. Raises OSError when the disk refuses.

    >>> import tempfile
    >>> path = tempfile.mkdtemp() + "/truth.npz"
    >>> with npz_writer(path) as writer:
    ...     for start in (0, 3):
    ...         writer.append("number", np.arange(start, start + 3))
    ...     writer.put("unit", np.array("m"))
    >>> {name: array.tolist() for name, array in np.load(path).items()}
    {'number': [0, 1, 2, 3, 4, 5], 'unit': 'm'}
    """
    path = Path(path)
    part = path.with_name(path.name + ".part")
    writer = NpzWriter(path)
    try:
        yield writer
        writer._close()
        with zipfile.ZipFile(part, "w", zipfile.ZIP_STORED) as archive:
            writer._assemble(archive)
        part.replace(path)
    finally:
        writer._close()
        for spool in writer._growing.values():
            spool.path.unlink(missing_ok=True)
        part.unlink(missing_ok=True)


class NpzWriter:
    """Collects named arrays: whole ones, and growing ones of any length.

    ``growing`` is the size of the latter so far, in bytes; ``watch(size)`` is called with the bytes
    of them just copied, when all is put together at the end.
    """

    def __init__(self, path):
        self._path = path
        self._whole = {}
        self._growing = {}
        self._files = ExitStack()
        self.watch = lambda size: None

    @property
    def growing(self):
        return sum(spool.size for spool in self._growing.values())

    def put(self, name, array):
        """A whole array."""
        self._whole[name] = np.asanyarray(array)

    def append(self, name, rows):
        """More rows of a growing array; all of one type and one shape but for their number."""
        rows = np.ascontiguousarray(rows)
        if name not in self._growing:
            path = self._path.with_name(f"{self._path.name}.{name}.part")
            file = self._files.enter_context(path.open("wb"))
            self._growing[name] = _Spool(path, file, rows)
        self._growing[name].append(rows)

    def _close(self):
        self._files.close()

    def _assemble(self, archive):
        for name, spool in self._growing.items():
            header = {
                "descr": np.lib.format.dtype_to_descr(spool.dtype),
                "fortran_order": False,
                "shape": (spool.length, *spool.shape),
            }
            # the date that ZipInfo starts with, so that the same arrays give the same bytes
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array_header_2_0(member, header)
                with open(spool.path, "rb") as rows:
                    while block := rows.read(BLOCK):
                        member.write(block)
                        self.watch(len(block))
            spool.path.unlink()
        for name, array in self._whole.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


class _Spool:
    """Rows of one growing array in a file of their own."""

    def __init__(self, path, file, rows):
        self.path, self.file = path, file
        self.dtype, self.shape, self.length, self.size = rows.dtype, rows.shape[1:], 0, 0

    def append(self, rows):
        if (rows.dtype, rows.shape[1:]) != (self.dtype, self.shape):
            raise ValueError(
                f"Rows of {rows.dtype} {rows.shape[1:]} don't fit those of {self.dtype} "
                f"{self.shape} before them."
            )
        self.file.write(rows)
        self.length += len(rows)
        self.size += rows.nbytes
