"""Evaluation of a correction.

- rows: typed rows of report.json: statistics, scores, targets
- scores: misclosures before and after a correction, and a row for every surveyed point and pass
- model: sections of the report on the estimate and its ties
- datum, beams: control and clouds that do not match the survey
- accuracy: the ASPRS standard
- check_sigmas: test of the stated sigmas by check points
- quality: gates that make a command fail
- wording: the sentences on these results
"""

from mlscorr.evaluate.beams import BeamCheck, outside_warnings
from mlscorr.evaluate.check_sigmas import CheckSigmas
from mlscorr.evaluate.datum import DatumDifference, datum_differences
from mlscorr.evaluate.model import (
    largest_sigma,
    misclosure_statistics,
    model_section,
    tie_residual_section,
    tie_section,
)
from mlscorr.evaluate.quality import Gate, failures, read_gate
from mlscorr.evaluate.rows import SEEN_BY_OTHERS, PointCounts, Score, Statistics, TargetRow
from mlscorr.evaluate.scores import (
    accuracy,
    misclosures,
    score,
    surveyed_rows,
    target_rows,
    unseen_rows,
)
from mlscorr.evaluate.wording import reason_in_words
