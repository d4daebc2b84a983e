"""Joint matching of all observations with surveyed targets."""

from mlscorr.matching._wording import REASONS
from mlscorr.matching.association import Matches, match
from mlscorr.matching.decision import log_share
from mlscorr.matching.reasons import Refusal
from mlscorr.matching.settings import SETTINGS
