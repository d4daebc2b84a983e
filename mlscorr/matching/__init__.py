"""Which observation is which surveyed target: all of them decided together."""

from mlscorr.matching.joint import Matches, match
from mlscorr.matching.pairs import LARGEST_GATE, LEAST_GATE
from mlscorr.matching.reasons import Refusal

__all__ = ["LARGEST_GATE", "LEAST_GATE", "Matches", "Refusal", "match"]
