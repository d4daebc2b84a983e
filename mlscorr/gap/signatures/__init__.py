"""What each effect does to the rows."""

from mlscorr.gap.signatures.expectation import curvature, expected, without_effects
from mlscorr.gap.signatures.signatures import Signature, select, signatures
from mlscorr.gap.signatures.simulators import as_believed, with_cause
