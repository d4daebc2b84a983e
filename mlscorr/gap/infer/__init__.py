"""Which effect explains the rows, with what probability and parameters, and where it shows."""

from mlscorr.gap.infer.causes import Inference, infer_causes
from mlscorr.gap.infer.decision import Costs
from mlscorr.gap.infer.observations import Observations
from mlscorr.gap.infer.separability import Separability, compare_signatures
