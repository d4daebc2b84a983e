"""Points that fill a cube evenly, in place of random ones: the same cloud gives the same fit."""

from functools import cache

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc


@cache
def quasi_random(count: int, dimensions: int, block: int = 0) -> np.ndarray:
    """Points in the open unit cube.

    Parameters
    ----------
    count, dimensions : int
    block : int
        Number of the block of so many points, each unlike the others.

    Returns
    -------
    (count, dimensions) array
        Of the Halton sequence (Halton 1960).
    """
    sequence = qmc.Halton(dimensions, scramble=False)
    sequence.fast_forward(1 + block * count)  # the first point is a corner
    return sequence.random(count)


@cache
def quasi_normal(count: int, dimensions: int, block: int = 0) -> np.ndarray:
    """Points (count, dimensions) of a standard normal distribution.

    Parameters
    ----------
    count, dimensions, block : int
        As of quasi_random.
    """
    return ndtri(quasi_random(count, dimensions, block))
