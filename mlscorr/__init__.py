"""Correct mobile laser scans with surveyed targets by least squares collocation."""

from importlib import import_module

_PIPELINE = (
    "calibrate",
    "check",
    "compare",
    "correct",
    "diagnose",
    "extract",
    "find_ties",
    "init",
    "plan",
)
_HOMES = {
    "read_simulator": "mlscorr.simulate.simulator_file",
    "read_survey": "mlscorr.io.survey_file",
} | dict.fromkeys(_PIPELINE, "mlscorr.pipeline")
__all__ = [*_PIPELINE, "read_simulator", "read_survey", "simulate"]


def __getattr__(name):
    """Load what is asked for, and the libraries it needs, only then."""
    if name == "simulate":  # the package: mlscorr.simulate.simulate(scenario, rng)
        return import_module("mlscorr.simulate")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'mlscorr' has no attribute '{name}'")


def __dir__():
    return sorted([*globals(), *__all__])
