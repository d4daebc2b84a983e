"""Corrections of points: each point moves by its own time stamp, and has a sigma from it."""

from mlscorr.correction.pair import Correction, increments_by_scanner, require_fit
from mlscorr.correction.point_sigma import PointSigma
