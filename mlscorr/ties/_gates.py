"""Gates of ties: the distance of two views of one thing, by stated sigmas, then by residuals."""

import numpy as np

from mlscorr.correction import Correction, PointSigma
from mlscorr.survey import Survey, TieFeatures, Ties
from mlscorr.ties.agreement import NORMAL_SCATTER, residuals
from mlscorr.ties.settings import SETTINGS


def placed_sigma(correction: Correction, survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the places of features along any axis, after a correction. Units: m.

    Parameters
    ----------
    correction : Correction
    survey : Survey
        Its mountings with the covariance of what is open in them.
    features : TieFeatures
    """
    sigma = np.empty(len(features))
    for part, rows in survey.rows_by_scanner(features.scanner):
        of_part = PointSigma.of(correction, part.scanner, part.mounting)
        sigma[rows] = of_part.at(features.centre[rows], features.gps_time[rows]).max(axis=1)
    return sigma


def widest_gate(sigma: np.ndarray) -> float:
    """Largest distance of two features whose places have sigmas (n,). Units: m.

    Parameters
    ----------
    sigma : (n,) array
        Units: m.
    """
    return float(np.sqrt(2) * SETTINGS.gate_sigmas * sigma.max(initial=0.0))


def narrowest_gate(ties: Ties, moved: np.ndarray) -> float:
    """Largest distance of two features by the scatter of residuals of ties. Units: m.

    Parameters
    ----------
    ties : Ties
    moved : (m, 3) array
        What the correction adds to each feature. Units: m.
    """
    scatter = NORMAL_SCATTER * float(np.median(np.abs(residuals(ties, moved))))
    return SETTINGS.gate_sigmas * max(scatter, SETTINGS.best_second)
