"""Whether intensity tells bright from dark at all."""

import numpy as np

from mlscorr.targets.settings import SETTINGS


def why_useless(intensity: np.ndarray) -> str | None:
    """Sentence for intensities that tell no bright target; None where they can.

    Parameters
    ----------
    intensity : (n,) array
        8 bits in 16 are no reason: only ratios count.

    >>> import numpy as np
    >>> why_useless(np.zeros(1000))
    'The intensity of all points is 0.'
    >>> why_useless(np.r_[np.full(900, 20), np.arange(50, 150)]) is None
    True
    """
    values = np.unique(intensity)
    if len(values) <= 1:
        return f"The intensity of all points is {f'{values[0]:g}' if len(values) else 'missing'}."
    if len(values) < SETTINGS.smallest_levels:
        return f"The intensity takes only {len(values)} values."
    return None
