"""Tie features in overlaps: pairs of features, their agreement, and the resulting correction.

Pairing and correction alternate: the correction from the first pairs shows which further pairs are
valid.
"""

from mlscorr.ties._tied_mounting import coarse_mounting, remounted, tie_mounting
from mlscorr.ties._tied_passes import tie_passes
from mlscorr.ties.agreement import (
    consistent_ties,
    group_by_time,
    information,
    residuals,
    unconstrained_directions,
    unconstrained_sentence,
    weigh_by_time,
)
from mlscorr.ties.coarse import coarse_correction
from mlscorr.ties.pairing import pair_features
from mlscorr.ties.search import TieSearch, feature_sigma, least_pause, search_ties
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import thinned_ties
