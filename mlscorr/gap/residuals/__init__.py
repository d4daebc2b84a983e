"""Compared data: rows of observed minus simulated, and their circumstances."""

from mlscorr.gap.residuals._surfaces import gate
from mlscorr.gap.residuals.absence import Absence, find_absence
from mlscorr.gap.residuals.channels import (
    limited_noise,
    log_roughness,
    rounding_sigma,
    with_loss_variance,
)
from mlscorr.gap.residuals.pairing import Pairing, build_rows
from mlscorr.gap.residuals.patches import PatchCollector, Patches, find_patches
from mlscorr.gap.residuals.rows import (
    Background,
    Rows,
    assemble,
    background,
    covariates,
    poses_about,
    sample_pulses,
    scanner_origin,
)
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.gap.residuals.simulated import (
    SimulatedBeams,
    SimulatedClouds,
    rows_against,
    spread_patches,
    without_unpaired,
)
