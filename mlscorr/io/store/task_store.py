"""Results of tasks as files, each named by the hash of its inputs."""

import hashlib
import io
import os
import pickle
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.io.store import publishing
from mlscorr.io.store.output import PART, fcntl, remove
from mlscorr.io.store.storage import is_remote, is_there, read_bytes

SUFFIX = ".result"
LOCK = "lock"
KINDS = (str, int, float, Path, np.generic)  # types of values identified by their text
ROOMS = ("mlscorr", "numpy", "scipy", "pathlib", "upath")  # modules of classes in results
MAKERS = {  # functions that construct values; no others are called while a result is loaded
    ("mlscorr.estimate.posterior", "drifting_prior"),
    ("mlscorr.estimate.posterior", "position_prior"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"),
    ("numpy.core.numeric", "_frombuffer"),
    ("upath.core", "_make_instance"),
}
PLAIN = ("complex", "frozenset", "range", "set", "slice")  # of Python itself


def digest(*values: object) -> str:
    """SHA-256 of values: numbers, texts, arrays, dataclasses and collections of these.

    Parameters
    ----------
    *values : object

    Raises
    ------
    TypeError
        For a value of another kind.

    Examples
    --------
    >>> digest(1, "a") == digest(1, "a"), digest(1, "a") == digest(1.0, "a")
    (True, False)
    """
    hashed = hashlib.sha256()
    for value in values:
        _feed(hashed.update, value)
    return hashed.hexdigest()


def _feed(update: Callable[[bytes], object], value: Any) -> None:
    """Feed a hash with a value and its kind."""
    update(f"({type(value).__name__}".encode())
    if isinstance(value, np.ndarray):
        update(f"{value.dtype}{value.shape}".encode())
        update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Rotation):
        _feed(update, value.as_quat())
    elif is_dataclass(value):
        for field in fields(value):
            _feed(update, getattr(value, field.name))
    elif isinstance(value, dict):
        for pair in sorted(value.items()):
            _feed(update, pair)
    elif isinstance(value, tuple | list):
        for item in value:
            _feed(update, item)
    elif value is None or isinstance(value, KINDS) or is_remote(value):
        update(repr(value).encode())
    else:
        raise TypeError(f"A {type(value).__name__} has no digest.")
    update(b")")


class _Unpickler(pickle.Unpickler):
    """Unpickler of known classes only, so that results cannot run foreign code."""

    def find_class(self, module: str, name: str) -> Any:
        value = super().find_class(module, name)
        is_class = isinstance(value, type) and value.__module__.partition(".")[0] in ROOMS
        is_plain = module == "builtins" and name in PLAIN
        if is_class or is_plain or (module, name) in MAKERS:
            return value
        raise pickle.UnpicklingError(f"{module}.{name} is no value of a result")


@dataclass(frozen=True)
class TaskStore:
    """Folder of results, each written atomically.

    Parameters
    ----------
    folder : Path
    """

    folder: Path

    @property
    def plan(self) -> Path:
        """Path of the list of tasks, which marks the folder of a run."""
        return self.folder / "plan.json"

    def is_begun(self) -> bool:
        """True if a run has started here, possibly with only its lock, before it writes the
        plan.
        """
        names = {*publishing.names_in(self.folder)}
        return self.plan.name in names or {LOCK} <= names <= {LOCK, self.plan.name + PART}

    def is_locked(self) -> bool | None:
        """True if a run is active; None if this is unknown.

        A lock in a store may belong to a killed run, and Windows has none.
        """
        lock = self.folder / LOCK
        if not is_there(lock):
            return False
        if is_remote(lock) or fcntl is None:
            return None
        with open(lock, "rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def clear(self) -> None:
        """Remove all results; other contents of the folder are kept."""
        publishing.remove_files(self.folder, f"*/{'[0-9a-f]' * len(digest())}{SUFFIX}")

    def path(self, kind: str, key: str) -> Path:
        """Path of a result, existing or not.

        Parameters
        ----------
        kind : str
            Kind of the task.
        key : str
            Digest of its inputs.
        """
        return self.folder / kind / f"{key}{SUFFIX}"

    def keys(self, kind: str) -> set[str]:
        """Keys of the existing results.

        Parameters
        ----------
        kind : str
        """
        return {name.removesuffix(SUFFIX) for name in publishing.names_in(self.folder / kind)}

    def put(self, kind: str, key: str, value: object) -> None:
        """Store a result, preceded by a checksum.

        Parameters
        ----------
        kind, key : str
        value : object
            Dataclasses of this package, arrays, and Python's built-in types.

        Raises
        ------
        OSError
            If the disk refuses.
        """
        content = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
        path = self.path(kind, key)
        publishing.make_folder(path.parent)
        with self.part() as part:
            with open(part, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
                file.flush()
                os.fsync(file.fileno())
            publishing.publish(part, path)

    def get(self, kind: str, key: str) -> Any:
        """Load a result.

        Parameters
        ----------
        kind, key : str

        Raises
        ------
        KeyError
            If it is missing or damaged.
        OSError
            If a store does not respond.
        """
        try:
            content = read_bytes(self.path(kind, key))
        except OSError as error:
            if is_remote(self.folder) and not isinstance(error, FileNotFoundError):
                raise  # it may well exist
            raise KeyError(key) from None
        size = hashlib.sha256().digest_size
        if hashlib.sha256(content[size:]).digest() != content[:size]:
            raise KeyError(key)
        try:
            return _Unpickler(io.BytesIO(content[size:])).load()
        except (pickle.UnpicklingError, AttributeError, ImportError):  # of another version
            raise KeyError(key) from None

    @contextmanager
    def part(self, suffix: str = "") -> Iterator[Path]:
        """Yield a path for an incomplete result on the same disk; leftovers there are removed.

        For a store it is among the temporary files.

        Parameters
        ----------
        suffix : str
            Suffix of its name.
        """
        if is_remote(self.folder):
            with publishing.scratch_folder() as folder:
                yield folder / f"part{suffix}"
            return
        folder = self.folder / f"part.{secrets.token_hex(8)}"
        folder.mkdir(parents=True)
        path = folder / f"part{suffix}"
        try:
            yield path
        finally:
            for left in (path, path.with_name(path.name + PART)):
                left.unlink(missing_ok=True)
            with suppress(OSError):
                folder.rmdir()

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock out other runs, and remove incomplete results of killed ones.

        Raises
        ------
        ValueError
            If another run is at work.
        """
        if is_remote(self.folder):
            with publishing.locked_in_store(self.folder / LOCK):
                yield
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        with open(self.folder / LOCK, "a") as lock:
            try:
                if fcntl is not None:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise ValueError(
                    f"Another run is active in {self.folder.parent}. Wait until it ends, or stop "
                    "it first; mlscorr status shows its progress."
                ) from None
            for folder in self.folder.glob("part.*"):
                remove(folder)
            yield
