"""Ties of a survey of which nothing is known but what its POS states."""

from dataclasses import dataclass

import numpy as np

from mlscorr.pos import PosErrors
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import Survey, TieFeatures, Ties, time_spans
from mlscorr.ties.agreement import (
    NORMAL_SCATTER,
    consistent_ties,
    residuals,
    weigh_by_time,
    widest_gate,
)
from mlscorr.ties.coarse import coarse_correction
from mlscorr.ties.pairing import pair_features, visit_number
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import thinned_ties


@dataclass(frozen=True)
class TieSearch:
    """Ties that agree, and what was left of the rest.

    Parameters
    ----------
    ties : Ties
        Weighed by time.
    refused : Ties
        Those that contradict their neighbours in time.
    correction : (m, 3) array
        Of each feature, that puts the passes coarsely on each other. Units: m.
    radius : float
        Of the search. Units: m.
    """

    ties: Ties
    refused: Ties
    correction: np.ndarray
    radius: float


def search_ties(survey: Survey, features: TieFeatures) -> TieSearch:
    """Ties of a survey without control: coarsely first, then by what the POS states.

    Parameters
    ----------
    survey : Survey
        Its search radius is the limit.
    features : TieFeatures
    """
    sigma = feature_sigma(survey, features)
    radius = min(max(widest_gate(sigma), SETTINGS.least_gate), survey.search_radius)
    correction = coarse_correction(features, radius)
    # what the first pairs, of visits, leave tells how near partners are
    for pause in (SETTINGS.pause, least_pause(survey, features)):
        ties = pair_features(features, correction, sigma, radius, pause=pause)
        agree = consistent_ties(ties, correction)
        left = np.abs(residuals(ties[agree], correction))
        is_pole = ties.kind[agree] == "pole"
        of_pole = features.kind == "pole"  # farther apart along the way than walls tell
        for rows, narrowed in ((is_pole, of_pole), (~is_pole, ~of_pole)):
            if rows.any():
                near = 2 * NORMAL_SCATTER * np.median(left[rows])
                sigma = np.where(narrowed, np.minimum(sigma, near), sigma)
    return TieSearch(weigh_by_time(ties[agree]), ties[~agree], correction, radius)


def least_pause(survey: Survey, features: TieFeatures) -> float:
    """Seconds between two views of a thing by one scanner, from which on they are a tie.

    Those between visits; but a moment where the only scanner sees things again at a visit, in most
    moments of it, as one that spins does. A profile scanner does so where it turns alone, which
    tells too little of what its mounting lacks; several see what others saw; and of sessions
    without a mounting nobody knows that they have the same.

    Parameters
    ----------
    survey : Survey
    features : TieFeatures
    """
    cells = np.column_stack([np.floor(features.centre / SURFACES.cell), visit_number(features)])
    cell = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    first, last = time_spans(cell, features.gps_time)
    began, ended = (survey.trajectory.at(time).position for time in (first, last))
    # a slow profile takes longer for a cell than a moment, too, but has hardly left it then
    is_left = np.linalg.norm(ended - began, axis=1) > SURFACES.cell
    is_again = (is_left & (last - first > SURFACES.moment))[cell]
    moments = np.floor(features.gps_time / SURFACES.moment)
    is_most = 2 * len(np.unique(moments[is_again])) > len(np.unique(moments))
    is_known = survey.mounting is not None or survey.trajectory.session is None
    if is_most and is_known and not survey.scanners:
        return SURFACES.moment
    return SETTINGS.pause


def agreeing_ties(ties: Ties, correction: np.ndarray) -> Ties:
    """Those that agree with their neighbours, as many as are believed, with their weights.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features. Units: m.
    """
    return weigh_by_time(thinned_ties(ties[consistent_ties(ties, correction)]))


def feature_sigma(survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the place of features, as the POS states it of position and attitude. m.

    Not below what makes the least gate: the mounting's error is not in the POS's sigma.

    Parameters
    ----------
    survey : Survey
    features : TieFeatures
    """
    pose = survey.trajectory.at(features.gps_time)
    distance = np.linalg.norm(features.centre - pose.position, axis=1)
    errors = PosErrors.stated(survey.trajectory, survey.pos)
    sigma = errors.point_sigma(features.gps_time, distance)
    return np.maximum(sigma, SETTINGS.least_gate / (np.sqrt(2) * SETTINGS.gate_sigmas))
