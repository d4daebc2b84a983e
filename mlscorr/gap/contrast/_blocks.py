"""Figures of bins with honest sigmas: what lies in one block of the ground goes together."""

from collections.abc import Callable

import numpy as np
from scipy.stats import t

from mlscorr.gap.contrast._settings import SETTINGS


def block_of(place: np.ndarray) -> np.ndarray:
    """Number (n,) of the block of the ground that each place is in, from 0.

    Parameters
    ----------
    place : (n, 3) array
        Units: m.
    """
    corner = np.floor(place[:, :2] / SETTINGS.bootstrap_block)
    return np.unique(corner, axis=0, return_inverse=True)[1].reshape(len(place))


def sums_by_block(block: np.ndarray, number: np.ndarray, bins: int, columns: list) -> np.ndarray:
    """Sums (b, bins, k) of k columns (n,) over blocks and bins.

    Parameters
    ----------
    block : (n,) int array
    number : (n,) int array
        The bin of each; -1 for none.
    bins : int
    columns : list of k (n,) arrays
    """
    sums = np.zeros((int(block.max(initial=-1)) + 1, bins, len(columns)))
    kept = number >= 0
    for column, values in enumerate(columns):
        np.add.at(sums[..., column], (block[kept], number[kept]), values[kept])
    return sums


def effective(weight: np.ndarray) -> np.ndarray:
    """Number of blocks (...) as if all weighed alike, of weights (b, ...).

    Parameters
    ----------
    weight : (b, ...) array
    """
    return weight.sum(axis=0) ** 2 / np.maximum((weight**2).sum(axis=0), 1e-300)


def joined_bins(weight: np.ndarray) -> list[slice]:
    """Bins of finer ones, so joined that each has blocks enough; none before and after all data.

    Parameters
    ----------
    weight : (b, bins) array
        Of each block in each of the finer bins.
    """
    filled = np.flatnonzero(weight.sum(axis=0) > 0)
    if len(filled) == 0:
        return [slice(0, weight.shape[1])]
    bins = []
    start = filled[0]
    stop = filled[-1] + 1
    for end in range(filled[0] + 1, stop + 1):
        if effective(weight[:, start:end].sum(axis=1)) >= SETTINGS.least_blocks:
            bins.append(slice(start, end))
            start = end
    if start < stop:
        bins.append(slice(bins.pop().start if bins else start, stop))
    return bins


def weights_of(blocks: int, rng: np.random.Generator) -> np.ndarray:
    """How often each block is drawn (replicas, blocks) by the bootstrap.

    Parameters
    ----------
    blocks : int
    rng : numpy.random.Generator
    """
    return rng.multinomial(blocks, np.full(blocks, 1 / blocks), SETTINGS.bootstrap_replicas).astype(
        float
    )


def with_sigma(
    sums: np.ndarray, figure: Callable[[np.ndarray], np.ndarray], weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A figure of each bin, its sigma by the bootstrap over blocks, and its number of blocks.

    Parameters
    ----------
    sums : (b, bins, k) array
        The last column is what a block weighs.
    figure : function
        Of sums (..., bins, k): values (..., bins).
    weights : (replicas, b) array

    Returns
    -------
    value, sigma, blocks : (bins,) arrays
        Blocks as if all weighed alike; NaN for values of fewer than can tell a sigma.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        blocks = effective(sums[..., -1])
        value = figure(sums.sum(axis=0))
        drawn = figure(np.tensordot(weights, sums, axes=1))
        good = np.isfinite(drawn).mean(axis=0) > SETTINGS.difference_confidence
        known = (blocks >= SETTINGS.least_blocks) & good & np.isfinite(value)
        drawn = np.where(np.isfinite(drawn), drawn, value)
        sigma = drawn.std(axis=0) * np.sqrt(blocks / np.maximum(blocks - 1, 1.0))
    return np.where(known, value, np.nan), np.where(known, sigma, np.nan), blocks


def limit(blocks: np.ndarray, tests: int) -> np.ndarray:
    """Sigmas (n,) that a difference must reach, where so many are looked at (Bonferroni).

    Parameters
    ----------
    blocks : (n,) array
        On which each sigma rests.
    tests : int
    """
    return t.isf(
        0.5 * (1 - SETTINGS.difference_confidence) / max(tests, 1), np.maximum(blocks - 1, 1.0)
    )
