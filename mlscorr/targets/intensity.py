"""Whether intensity tells bright from dark at all."""

import numpy as np

FEWEST_LEVELS = 4  # different values; fewer are a flag or a class, not an intensity


def why_useless(intensity):
    """Why no bright target can be told by these intensities (n,); None where it can.

    8 bits in 16 are no reason: only ratios count.

    >>> import numpy as np
    >>> why_useless(np.zeros(1000))
    'The intensity of all 1000 points is 0.'
    >>> why_useless(np.r_[np.full(900, 20), np.arange(50, 150)]) is None
    True
    """
    values = np.unique(intensity)
    if len(values) <= 1:
        value = f"{values[0]:g}" if len(values) else "missing"
        return f"The intensity of all {len(intensity)} points is {value}."
    if len(values) < FEWEST_LEVELS:
        return f"The intensity of {len(intensity)} points takes only {len(values)} values."
    return None
