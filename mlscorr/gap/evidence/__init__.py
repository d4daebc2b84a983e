"""Which effect explains the rows, with what probability and parameters, and where it shows."""

from mlscorr.gap.evidence.causes import Inference, infer_causes
from mlscorr.gap.evidence.decision import Costs
from mlscorr.gap.evidence.observations import Observations
from mlscorr.gap.evidence.separability import Separability, compare_signatures
