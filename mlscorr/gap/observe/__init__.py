"""What is compared: rows of observed minus simulated, and what each was measured under."""

from mlscorr.gap.observe.absence import Absence, find_absence
from mlscorr.gap.observe.channels import beside_seen_noise
from mlscorr.gap.observe.pairing import Pairing, build_rows
from mlscorr.gap.observe.patch_search import PatchCollector
from mlscorr.gap.observe.patches import Patches
from mlscorr.gap.observe.rows import Rows, background
from mlscorr.gap.observe.simulated import (
    SimulatedBeams,
    SimulatedClouds,
    rows_against,
    spread_patches,
    without_unpaired,
)
