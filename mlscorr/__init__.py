"""Correct mobile laser scans with surveyed targets by least squares collocation."""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

from mlscorr.compiled_loops import choose_folder

if TYPE_CHECKING:  # what editors and type checkers see of the names that are loaded when used
    from mlscorr import simulate
    from mlscorr.io.surveys import read_survey
    from mlscorr.pipeline import (
        apply,
        calibrate,
        check,
        compare,
        correct,
        diagnose,
        doctor,
        extract,
        find_ties,
        init,
        plan,
        render,
    )
    from mlscorr.simulate import read_simulator

__all__ = [
    "apply",
    "calibrate",
    "check",
    "compare",
    "correct",
    "diagnose",
    "doctor",
    "extract",
    "find_ties",
    "init",
    "plan",
    "read_simulator",
    "read_survey",
    "render",
    "simulate",
]
_READERS = {
    "read_simulator": "mlscorr.simulate.simulator_file",
    "read_survey": "mlscorr.io.surveys.survey_file",
}

_HOME = os.path.expanduser("~")
choose_folder(__path__[0], _HOME, os.environ.get("XDG_CACHE_HOME", os.path.join(_HOME, ".cache")))


def __getattr__(name: str) -> Any:
    """Load what is asked for, and the libraries it needs, only then."""
    if name == "simulate":  # the package: mlscorr.simulate.simulate(scenario, rng)
        return import_module("mlscorr.simulate")
    if name in __all__:
        return getattr(import_module(_READERS.get(name, "mlscorr.pipeline")), name)
    raise AttributeError(f"module 'mlscorr' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
