"""Signatures: the change of the rows by each effect."""

from mlscorr.gap.signatures._displacements import displacements
from mlscorr.gap.signatures._signatures import (
    Signature,
    curvature,
    expected,
    select,
    signature,
    signatures,
    without_effects,
)
from mlscorr.gap.signatures.changes import Bench, check_mounting
from mlscorr.gap.signatures.settings import SETTINGS
from mlscorr.gap.signatures.simulators import as_assumed, joined, with_cause
