"""Ties of a survey without other information than its POS."""

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
    """Ties that agree, and the refused ones.

    Parameters
    ----------
    ties : Ties
        Weighted by time.
    refused : Ties
        Ties that contradict their neighbors in time.
    correction : (m, 3) array
        Coarse correction of each feature that aligns the passes. Units: m.
    radius : float
        Search radius. Units: m.
    """

    ties: Ties
    refused: Ties
    correction: np.ndarray
    radius: float


def search_ties(survey: Survey, features: TieFeatures) -> TieSearch:
    """Find ties of a survey without control: first coarsely, then within the stated POS sigmas.

    Parameters
    ----------
    survey : Survey
        The search radius is the limit.
    features : TieFeatures
    """
    sigma = feature_sigma(survey, features)
    radius = min(max(widest_gate(sigma), SETTINGS.least_gate), survey.search_radius)
    correction = coarse_correction(features, radius)
    # residuals of the first pairs, of visits, show how near partners are
    for pause in (SETTINGS.pause, least_pause(survey, features)):
        ties = pair_features(features, correction, sigma, radius, pause=pause)
        agree = consistent_ties(ties, correction)
        left = np.abs(residuals(ties[agree], correction))
        is_pole = ties.kind[agree] == "pole"
        of_pole = features.kind == "pole"  # farther along the path than walls show
        for rows, narrowed in ((is_pole, of_pole), (~is_pole, ~of_pole)):
            if rows.any():
                near = 2 * NORMAL_SCATTER * np.median(left[rows])
                sigma = np.where(narrowed, np.minimum(sigma, near), sigma)
    return TieSearch(weigh_by_time(ties[agree]), ties[~agree], correction, radius)


def least_pause(survey: Survey, features: TieFeatures) -> float:
    """Minimum time in s between two views of a feature by one scanner that form a tie.

    It is the time between visits. It is one moment for a single scanner that measures features
    again in most moments of a visit, as a rotating scanner does. A profile scanner repeats features
    only in turns, which gives too little information on its mounting. With several scanners, views
    of other scanners suffice. Sessions without a mounting may have different ones.

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
    """Ties that agree with their neighbors, thinned and weighted.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features. Units: m.
    """
    return weigh_by_time(thinned_ties(ties[consistent_ties(ties, correction)]))


def feature_sigma(survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the positions of features, from the stated position and attitude sigmas. m.

    It is not below the value of the minimum gate, because the POS sigma does not include the
    mounting's error.

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
