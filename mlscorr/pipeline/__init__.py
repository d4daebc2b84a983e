"""The story from files to files, one module a command, each loaded when it is used."""

from importlib import import_module
from typing import Any

_OFFERED = {
    "applying": ("AppliedSurvey", "apply"),
    "calibration": ("CalibratedScanners", "CalibratedSurvey", "calibrate"),
    "checking": ("CheckedSurvey", "check"), "compared_survey": ("ComparedSurvey",),
    "comparison": ("compare",), "corrected_survey": ("CorrectedSurvey",),
    "correction": ("correct",), "diagnosis": ("DiagnosedSurvey", "diagnose"),
    "extraction": ("ExtractedSurvey", "extract"), "installation": ("Installation", "doctor"),
    "planning": ("PlannedSurvey", "plan"), "rendering": ("render",),
    "simulation": ("demo", "simulate_survey"), "starting": ("StartedSurvey", "init"),
    "ties": ("TiedSurvey", "find_ties"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Load the module that offers a name, and the libraries it needs, only then."""
    for module, names in _OFFERED.items():
        if name in names:
            return getattr(import_module(f"mlscorr.pipeline.{module}"), name)
    raise AttributeError(f"module 'mlscorr.pipeline' has no attribute '{name}'")
