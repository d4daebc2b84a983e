"""Simulated surveys: a street, a drive, a scanner, a POS and its errors."""

from mlscorr.simulate.scenario import DEMO, Scenario
from mlscorr.simulate.survey import SimulatedSurvey, simulate

__all__ = ["DEMO", "Scenario", "SimulatedSurvey", "simulate"]
