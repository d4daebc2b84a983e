"""Effects of one's own, from a Python file that registers them."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from mlscorr.effects.catalogue import known_effects
from mlscorr.effects.effect import Effect


def run_file(path: Path) -> ModuleType:
    """Run a Python file of the user's; the module that it makes.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        Names the file, and what it raised.
    """
    spec = spec_from_file_location(f"user.{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path} is no Python file: its name must end in .py.")
    module = sys.modules[spec.name] = module_from_spec(spec)  # where dataclasses look for it
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        if isinstance(error, SyntaxError) and error.lineno:
            line = f" (line {error.lineno})"
        else:
            line = ""
        raise ValueError(f"{path} can't be run{line}: {type(error).__name__}: {error}") from error
    return module


def register_file(path: Path | str) -> tuple[type[Effect], ...]:
    """Run a file that registers effects; they are known from then on.

    Parameters
    ----------
    path : path
        Of Python code, which runs as it is: take none that you wouldn't start yourself.

    Returns
    -------
    tuple of Effect classes
        Those that it registered.

    Raises
    ------
    ValueError
        For a file that can't be run, or registers nothing.
    FileNotFoundError
        Where there is none.
    """
    path = Path(path)
    before = set(known_effects())
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist; give a file that registers effects.")
    run_file(path)
    effects = tuple(kind for kind in known_effects() if kind not in before)
    if not effects:
        raise ValueError(
            f"{path} registers no effect: call mlscorr.effects.register with a class of yours, as "
            "docs/own-simulator.md shows."
        )
    return effects
