"""Which observation is which surveyed target: all of them decided together."""

from mlscorr.matching._wording import REASONS
from mlscorr.matching.association import Matches, match
from mlscorr.matching.decision import log_share
from mlscorr.matching.reasons import Refusal
from mlscorr.matching.settings import SETTINGS
