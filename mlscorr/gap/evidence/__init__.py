"""Inference of the effect that explains the rows: probability, parameters, and location."""

from mlscorr.gap.evidence._noise import detectable_size
from mlscorr.gap.evidence.causes import Cause, CauseParameter, Inference, cause_of, infer_causes
from mlscorr.gap.evidence.decision import OPERATING_POINTS, Costs, calibration_error
from mlscorr.gap.evidence.evidence import ColumnTable, column_table, steady_columns
from mlscorr.gap.evidence.labels import LabelEvidence, weigh_labels
from mlscorr.gap.evidence.measure import (
    UNITS,
    Explanations,
    Predicted,
    gap_kind,
    position_terms,
    scatter_terms,
    signed_root,
    simulated_variance,
)
from mlscorr.gap.evidence.observations import (
    ErrorModel,
    Observations,
    error_models,
    model_likelihood,
    window_growth,
)
from mlscorr.gap.evidence.separability import Separability, compare_signatures, explained_square
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.tails import without_tails
from mlscorr.gap.evidence.unknown import unknown_blocks
from mlscorr.gap.evidence.where import AXES, CHANNELS, NAMES, Split, Where
