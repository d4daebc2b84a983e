"""Simulated surveys: a street, a drive, scanners, a POS, and their errors."""

from mlscorr.simulate.scenario import DEMO, Scenario

__all__ = ["DEMO", "Scenario", "SimulatedSurvey", "simulate"]


def __getattr__(name):
    if name in ("SimulatedSurvey", "simulate"):
        import mlscorr.simulate.survey

        return getattr(mlscorr.simulate.survey, name)
    raise AttributeError(name)
