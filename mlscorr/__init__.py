"""Correct mobile laser scans with surveyed targets by least squares collocation.

Commands take a Survey and return a result with a ``write`` method. The stages of ``correct`` are
public, too: read_cloud, find_targets, match_targets, find_ties, estimate_pos_error, score.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for editors and type checkers; at run time these names are loaded when used
    # imported under their own names, which makes them public for a type checker
    from mlscorr import simulate as simulate
    from mlscorr.correction import Correction as Correction
    from mlscorr.io.clouds import read_cloud as read_cloud
    from mlscorr.io.surveys import read_survey as read_survey
    from mlscorr.pipeline import apply as apply
    from mlscorr.pipeline import calibrate as calibrate
    from mlscorr.pipeline import check as check
    from mlscorr.pipeline import compare as compare
    from mlscorr.pipeline import compare_results as compare_results
    from mlscorr.pipeline import correct as correct
    from mlscorr.pipeline import diagnose as diagnose
    from mlscorr.pipeline import doctor as doctor
    from mlscorr.pipeline import estimate_pos_error as estimate_pos_error
    from mlscorr.pipeline import extract as extract
    from mlscorr.pipeline import find_targets as find_targets
    from mlscorr.pipeline import find_ties as find_ties
    from mlscorr.pipeline import init as init
    from mlscorr.pipeline import match_targets as match_targets
    from mlscorr.pipeline import plan as plan
    from mlscorr.pipeline import render as render
    from mlscorr.pipeline import score as score
    from mlscorr.report import show as show
    from mlscorr.simulate import read_simulator as read_simulator
    from mlscorr.survey import ControlPoints as ControlPoints
    from mlscorr.survey import Mounting as Mounting
    from mlscorr.survey import PointCloud as PointCloud
    from mlscorr.survey import Pos as Pos
    from mlscorr.survey import Scanner as Scanner
    from mlscorr.survey import Survey as Survey
    from mlscorr.survey import Trajectory as Trajectory

_HOMES = {
    "mlscorr.correction": ["Correction"],
    "mlscorr.io.clouds": ["read_cloud"],
    "mlscorr.io.surveys": ["read_survey"],
    "mlscorr.pipeline": [
        "apply",
        "calibrate",
        "check",
        "compare",
        "compare_results",
        "correct",
        "diagnose",
        "doctor",
        "estimate_pos_error",
        "extract",
        "find_targets",
        "find_ties",
        "init",
        "match_targets",
        "plan",
        "render",
        "score",
    ],
    "mlscorr.report": ["show"],
    "mlscorr.simulate": ["read_simulator"],
    "mlscorr.survey": [
        "ControlPoints",
        "Mounting",
        "PointCloud",
        "Pos",
        "Scanner",
        "Survey",
        "Trajectory",
    ],
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
__all__ = [*_HOME_OF, "simulate"]


def __getattr__(name: str) -> Any:
    """Load a requested name, and the libraries it needs, on first use."""
    if name == "simulate":  # the package: mlscorr.simulate.simulate(scenario, rng)
        return import_module("mlscorr.simulate")
    if name == "__version__":
        from importlib.metadata import version

        return version("mlscorr")
    if name in _HOME_OF:
        return getattr(import_module(_HOME_OF[name]), name)
    raise AttributeError(f"module 'mlscorr' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
