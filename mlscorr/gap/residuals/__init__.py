"""What is compared: rows of observed minus simulated, and what each was measured under."""

from mlscorr.gap.residuals.absence import Absence, find_absence
from mlscorr.gap.residuals.channels import beside_seen_noise
from mlscorr.gap.residuals.pairing import Pairing, build_rows
from mlscorr.gap.residuals.patch_search import PatchCollector
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows, background
from mlscorr.gap.residuals.simulated import (
    SimulatedBeams,
    SimulatedClouds,
    rows_against,
    spread_patches,
    without_unpaired,
)
