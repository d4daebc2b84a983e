"""Misclosures of targets -> the POS error over time -> Correction (Mao et al. 2015, section 2.4.2).

The POS error is a polynomial trend of the position (Eq. 11) plus random signals:

- drift: 3 of the position, with the part of sigma(t) that grows where GNSS is missing;
- jitter: 3 of the position, with the part of sigma(t) that stays while GNSS holds the POS;
- attitude: 3 small rotations about the map axes.

Where the POS states no sigma(t), or a constant one, there is only drift. Without the split the
centimetres of good GNSS would set the correlation time of the metres of an outage.
"""

from mlscorr.correction.estimate import ORDER, Estimate, estimate_correction
from mlscorr.correction.model import Parameters
from mlscorr.correction.outliers import Outlier

__all__ = ["ORDER", "Estimate", "Outlier", "Parameters", "estimate_correction"]
