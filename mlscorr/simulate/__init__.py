"""Simulated surveys: a street, a drive, scanners, a POS, and their errors."""

from importlib import import_module

from mlscorr.simulate.scenario import DEMO, Scenario

__all__ = ["DEMO", "Scenario", "SimulatedSurvey", "read_scenario", "simulate"]
_HOMES = {
    "SimulatedSurvey": "mlscorr.simulate.survey",
    "read_scenario": "mlscorr.simulate.scenario_file",
    "simulate": "mlscorr.simulate.survey",
}


def __getattr__(name):
    """Load what is asked for, and the libraries it needs, only then."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'mlscorr.simulate' has no attribute '{name}'")
