"""Compilation and storage of loops, so that each is compiled once on a machine."""

import os
import tempfile
from collections.abc import Callable
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any

PACKAGE = Path(__file__).parent
VERSIONS = 4  # stored sets of compiled loops, about 10 MB each: branches, environments

# numba compiles its own functions (np.empty, max ...) for each set of options, so all loops share
# one set. Division by zero gives infinity, as in NumPy, because each check and its message add
# code. No loop is called from C.
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def loop(function: Callable | None = None, **options: Any) -> Any:
    """Compile a function of loops over arrays when it is first called (decorator).

    Parameters
    ----------
    function : function
    **options
        Options of numba.njit that override the shared ones.
    """
    if function is None:
        return partial(loop, **options)
    return _njit()(**{**OPTIONS, **options})(function)


@cache
def _njit():
    """Import numba and return its decorator, with this package's loops stored by _key.

    By default numba stores them by the path of their module, so that a second environment compiles
    all again and may load modules that have moved.
    """
    from numba import njit
    from numba.core import caching

    class Locator:
        def __init__(self, folder, line):
            self._folder = folder
            self._line = line

        @classmethod
        def from_function(cls, function, file):
            if not Path(file).is_relative_to(PACKAGE):
                return None  # numba continues with its own locations
            part = Path(file).relative_to(PACKAGE).parent
            return cls(_folder() / part, function.__code__.co_firstlineno)

        def ensure_cache_path(self):
            self._folder.mkdir(parents=True, exist_ok=True)

        def get_cache_path(self):
            return str(self._folder)

        def get_source_stamp(self):
            return _key()

        def get_disambiguator(self):
            return str(self._line)

    # the list shared by all caches; numba has no setting for the loops of one package
    caching.CompileResultCacheImpl._locator_classes.insert(0, Locator)  # noqa: SLF001
    return njit


@cache
def _key() -> str:
    """Short hash of numba's version and of all modules with loops, which call each other."""
    from numba import __version__

    digest = sha256(__version__.encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        if b"compiled_loops" in text:
            digest.update(str(path.relative_to(PACKAGE)).encode() + text)
    return digest.hexdigest()[:16]


@cache
def _folder() -> Path:
    """Folder of the compiled loops of this version; the oldest others are removed."""
    from numba.misc.appdirs import AppDirs

    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        place = Path(named) / "mlscorr"
    else:
        place = Path(AppDirs("mlscorr", appauthor=False).user_cache_dir) / "loops"
    home = writable_folder(place)
    folder = home / _key()
    if not folder.exists():
        others = sorted(home.iterdir(), key=os.path.getmtime)
        for other in others[: max(len(others) - VERSIONS + 1, 0)]:
            rmtree(other, ignore_errors=True)
        folder.mkdir(exist_ok=True)
    return folder


def writable_folder(*places: Path) -> Path:
    """Return the first writable folder, made if it is missing.

    If none is writable, as in many containers and for users without a home, it is in the system's
    temporary folder. A folder there that another user made is not trusted, because its contents are
    executed.

    Parameters
    ----------
    *places : Path

    Raises
    ------
    OSError
        If no folder is writable.
    """
    for place in places:
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(place, os.W_OK):
            return place
    if os.name == "nt":  # each user has a temporary folder
        return Path(tempfile.mkdtemp(prefix="mlscorr-"))
    folder = Path(tempfile.gettempdir(), f"mlscorr-{os.getuid()}")
    folder.mkdir(0o700, exist_ok=True)
    if folder.lstat().st_uid == os.getuid() and not folder.is_symlink():
        return folder
    return Path(tempfile.mkdtemp())
