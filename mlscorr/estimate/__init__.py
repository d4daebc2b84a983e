"""Misclosures of targets -> the POS error over time -> Correction (Mao et al. 2015, section 2.4.2).

The POS error is a polynomial trend of the position (Eq. 11) plus random signals:

- drift: 3 of the position, with the part of sigma(t) that grows where GNSS is missing;
- jitter: 3 of the position, with the part of sigma(t) that remains while the POS has GNSS;
- bias: 3 of the position, slow, on the same part but of nearly free size, for unstated errors;
- attitude: 3 small rotations about the map axes.

If the POS states no sigma(t), or a constant one, there is only drift, of nearly free size. Without
the split the centimeters of good GNSS would set the correlation time of the meters of an outage.
Scales, correlation times and covariance family are estimated from the control points, and their
remaining uncertainty is included in the stated sigmas.
"""

from mlscorr.estimate._tie_value import tie_value
from mlscorr.estimate._wording import sentences_of
from mlscorr.estimate.added_unknowns import (
    find_mounting_error,
    mounting_warnings,
    scanner_warnings,
    with_scanner_errors,
)
from mlscorr.estimate.adjustment import Adjustment, position_adjustment, with_reacquisitions
from mlscorr.estimate.calibration import (
    MOUNTING_COMPONENTS,
    SCANNER_COMPONENTS,
    Calibration,
    corrected_mounting,
    mounted_corrections,
    sigma_note,
)
from mlscorr.estimate.factors import KINDS, TARGET, TIE, Factor, target_factor, tie_factor
from mlscorr.estimate.guards import COMPONENTS, few_targets, guards_of
from mlscorr.estimate.inputs import check_order, checked_inputs, filled_sigmas
from mlscorr.estimate.mounting import (
    calibration_with_ties,
    control_fault,
    estimate_mounting,
    previewed_mounting,
    prior_mounting,
)
from mlscorr.estimate.outages import with_drift_history
from mlscorr.estimate.placement import NextControl, PlannedAccuracy, place_control, predict_accuracy
from mlscorr.estimate.pos_error import (
    Alternative,
    Estimate,
    estimate_correction,
    previewed_correction,
    prior_correction,
    with_ties,
)
from mlscorr.estimate.posterior import Objective, position_prior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.support import (
    CONSTRAINED,
    DRIFT,
    REASONS,
    Jump,
    Support,
    WeakInterval,
    find_jumps,
    weak_intervals,
)
from mlscorr.estimate.target_tests import TargetTest
from mlscorr.estimate.tied import TieResiduals
