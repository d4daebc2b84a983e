"""The story from files to files, one module a command."""

from mlscorr.pipeline.correction import CorrectedSurvey, correct
from mlscorr.pipeline.extraction import ExtractedSurvey, extract
from mlscorr.pipeline.finding import find_targets
from mlscorr.pipeline.simulation import demo, simulate_survey

__all__ = [
    "CorrectedSurvey",
    "ExtractedSurvey",
    "correct",
    "demo",
    "extract",
    "find_targets",
    "simulate_survey",
]
