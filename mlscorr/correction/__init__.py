"""Misclosures of targets -> the POS error over time -> Correction (Mao et al. 2015, section 2.4.2).

The POS error is a polynomial trend of the position (Eq. 11) plus random signals:

- drift: 3 of the position, with the part of sigma(t) that grows where GNSS is missing;
- jitter: 3 of the position, with the part of sigma(t) that stays while GNSS holds the POS;
- bias: 3 of the position, slow, on the same part but of nearly free size: what is not stated;
- attitude: 3 small rotations about the map axes.

Where the POS states no sigma(t), or a constant one, there is only drift, of nearly free size.
Without the split the centimetres of good GNSS would set the correlation time of the metres of an
outage. Scales, correlation times and covariance family are estimated from the control points, and
what they leave open of them is a part of the stated sigmas.
"""

from mlscorr.correction.estimate import ORDER, Estimate, estimate_correction
from mlscorr.correction.guards import COMPONENTS
from mlscorr.correction.model import Parameters
from mlscorr.correction.outliers import Outlier

__all__ = ["COMPONENTS", "ORDER", "Estimate", "Outlier", "Parameters", "estimate_correction"]
