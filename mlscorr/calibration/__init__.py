"""Misclosures of targets -> lever arm and boresight (Mao et al. 2015, section 2.4.3, Eq. 16-18).

The mounting is the trend, and the POS error is the signal: 3 of the position and 3 small
rotations about the map axes, each with the sigma(t) that the POS states. Plain least squares,
which takes the POS to be free of error, stands beside it.
"""

from mlscorr.calibration.equations import Parameters
from mlscorr.calibration.estimate import (
    COMPONENTS,
    Calibration,
    MountingEstimate,
    Outlier,
    estimate_mounting,
)

__all__ = [
    "COMPONENTS",
    "Calibration",
    "MountingEstimate",
    "Outlier",
    "Parameters",
    "estimate_mounting",
]
