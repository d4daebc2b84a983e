"""What two passes both saw: features of each, pairs of them, and which of these agree."""

from mlscorr.ties._coarse_mounting import coarse_mounting, remounted, turned_directions
from mlscorr.ties.agreement import (
    NORMAL_SCATTER,
    consistent_ties,
    group_by_time,
    information,
    residuals,
    unheld_directions,
    unheld_sentence,
    weigh_by_time,
)
from mlscorr.ties.coarse import coarse_correction
from mlscorr.ties.collector import TieCollector, join_features
from mlscorr.ties.pairing import pair_features
from mlscorr.ties.search import TieSearch, agreeing_ties, feature_sigma, least_pause, search_ties
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import integer_hash, thinned_ties
