"""What is compared: rows of observed minus simulated, and what each was measured under."""

from mlscorr.gap.residuals._assemble import assemble, sample_pulses
from mlscorr.gap.residuals._covariates import covariates, poses_about, scanner_origin
from mlscorr.gap.residuals.absence import Absence, find_absence
from mlscorr.gap.residuals.channels import (
    beside_seen_noise,
    log_roughness,
    rounding_sigma,
    with_loss_variance,
)
from mlscorr.gap.residuals.pairing import Pairing, build_rows
from mlscorr.gap.residuals.patch_search import PatchCollector, find_patches, moments_before
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.plane_fit import (
    block_chance,
    cell_corner,
    chance,
    freedom,
    moments,
    place_key,
)
from mlscorr.gap.residuals.rows import Background, Rows, background
from mlscorr.gap.residuals.selection import gate
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.gap.residuals.simulated import (
    SimulatedBeams,
    SimulatedClouds,
    rows_against,
    spread_patches,
    without_unpaired,
)
