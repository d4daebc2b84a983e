"""Difference between stated probabilities and how often they are right."""

from __future__ import annotations

import numpy as np

BINS = 5  # of the stated probability: 300 cases of a blind check fill no more


def calibration_error(stated: np.ndarray, hit: np.ndarray) -> float:
    """Mean distance of stated probabilities from how often they were right, over bins of them.

    Parameters
    ----------
    stated : (n,) array
    hit : (n,) array
        One where it was right, else zero.
    """
    bins = np.clip((stated * BINS).astype(int), 0, BINS - 1)
    return float(
        sum(abs(np.sum(stated[bins == b] - hit[bins == b])) for b in range(BINS)) / len(stated)
    )
