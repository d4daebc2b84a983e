"""Where loops that were compiled are kept, so that each is compiled once on a machine."""

import os
import tempfile
from pathlib import Path
from typing import Any

# Options of every loop. numba compiles what it offers itself (np.empty, max ...) anew for each set
# of options, so that all loops share one. Division by zero gives infinity, as NumPy has it: each
# check and its message are code. Nobody calls a loop from C.
LOOP: Any = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
# Of those that only other loops call: what would unpack their arguments from Python is left out
INNER: Any = {**LOOP, "no_cpython_wrapper": True}


def choose_folder(*usual: str | Path) -> None:
    """Keep compiled loops in the system's temporary folder where no usual place can be written.

    numba keeps them beside the package or in the user's home, and refuses to load any where it can
    do neither: in most containers, and for users without a home. A folder that somebody else made
    is not trusted, for what lies in it is run. NUMBA_CACHE_DIR, where it is set, stands. It is too
    late where numba was imported before.

    Parameters
    ----------
    *usual : path
        Folders, of which numba needs a single one that can be written.

    Raises
    ------
    OSError
        Where no folder can be written at all.
    """
    if "NUMBA_CACHE_DIR" in os.environ or any(os.access(place, os.W_OK) for place in usual):
        return
    folder = os.path.join(tempfile.gettempdir(), f"mlscorr-{os.getuid()}")
    os.makedirs(folder, 0o700, exist_ok=True)
    is_own = os.lstat(folder).st_uid == os.getuid() and not os.path.islink(folder)
    os.environ["NUMBA_CACHE_DIR"] = folder if is_own else tempfile.mkdtemp()
