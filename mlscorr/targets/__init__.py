"""Targets in the cloud: candidates -> clusters -> plane and outline -> observations."""

from mlscorr.targets._outline import Outline
from mlscorr.targets.candidates import (
    NO_POINTS,
    Candidates,
    Neighbourhoods,
    collect,
    number_passes,
    search_radius,
)
from mlscorr.targets.extract import PassTarget, as_observations, fit_near_control, search_targets
from mlscorr.targets.fit import FittedTarget, TargetView, distinct, fit_targets, why_useless
from mlscorr.targets.regions import BrightRegion
from mlscorr.targets.scanner_path import ScannerPath
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import BY_EDGES, diameter
