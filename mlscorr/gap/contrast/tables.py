"""Tables of a channel by covariates, with sigmas from a bootstrap over ground blocks.

Data in one block are correlated, so the bootstrap draws blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.stats import t

from mlscorr.gap.contrast._settings import SETTINGS

RATIOS = ("intensity", "density")  # channels whose figure is a ratio; otherwise a difference
UNITS = {"intensity": "counts", "density": "points", "edge_width": "mrad", "dropout": "share"}


@dataclass(frozen=True)
class ContrastTable:
    """Channel by one covariate.

    Parameters
    ----------
    by : str
        range (m), incidence (deg), reflectance, or all.
    edges : tuple of b + 1 float, or None
    bins : tuple of b str
    real, simulated : (b,) array
        In the channel's own unit.
    value, sigma : (b,) array
        Difference of the two, or log of their ratio, and its sigma from blocks; NaN with too few of
        them.
    blocks : (b,) array
        Number of blocks used.
    differs : (b,) bool array
        True for significant differences.
    """

    by: str
    edges: tuple[float, ...] | None
    bins: tuple[str, ...]
    real: np.ndarray
    simulated: np.ndarray
    value: np.ndarray
    sigma: np.ndarray
    blocks: np.ndarray
    differs: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))

    def judged(self, tests: int) -> ContrastTable:
        """Return the table with significant differences flagged, for a number of tested bins.

        Parameters
        ----------
        tests : int
        """
        with np.errstate(invalid="ignore"):
            differs = np.abs(self.value) > limit(self.blocks, tests) * self.sigma
        return replace(self, differs=differs)

    def document(self, is_ratio: bool) -> dict:
        """Return a table of ``contrasts`` in gap.json.

        Parameters
        ----------
        is_ratio : bool
            True if the value is the log of a ratio.
        """
        value = self.value
        sigma = self.sigma
        if is_ratio:
            value = np.exp(value)
            sigma = sigma * value
        columns = {
            "real": self.real,
            "simulated": self.simulated,
            "value": value,
            "sigma": sigma,
            "blocks": np.round(self.blocks, 1),
            "differs": self.differs,
        }
        if self.edges is None:
            place = {"bins": list(self.bins)}
        else:
            place = {"edges": list(self.edges)}
        return {"by": self.by} | place | {name: c.tolist() for name, c in columns.items()}


@dataclass(frozen=True)
class Binning:
    """Covariate by which items (n,) are sorted.

    Parameters
    ----------
    by : str
    values : (n,) array
        Values, or indices of bins without edges; -1 for none.
    edges : tuple of float, optional
        Of the finest bins.
    bins : tuple of str
    """

    by: str
    values: np.ndarray
    edges: tuple[float, ...] | None = None
    bins: tuple[str, ...] = ()

    def number(self, edges: tuple[float, ...] | None) -> np.ndarray:
        """Return the bin (n,) of each item; -1 for none.

        Parameters
        ----------
        edges : tuple of float or None
        """
        if edges is None:
            return self.values
        number = np.searchsorted(edges, np.nan_to_num(self.values, nan=-1.0), side="right") - 1
        return np.where(number < len(edges) - 1, number, -1)


@dataclass(frozen=True)
class Measure:
    """Columns (n,) of n items in blocks, and figures from their sums.

    Parameters
    ----------
    channel : str
    block : (n,) int array
    columns : list of k (n,) arrays
        The last one is the weight of each item.
    figure : function
        Of sums (..., bins, k): values (..., bins).
    sides : function
        Of sums (bins, k): real and simulated figure (bins,).
    weights : (replicas, b) array
        Of the bootstrap.
    without : function
        Of a change (n,) of the figure of each item: the Measure without it.
    splits : tuple of Binning
    """

    channel: str
    block: np.ndarray
    columns: list
    figure: Callable
    sides: Callable
    weights: np.ndarray
    without: Callable
    splits: tuple[Binning, ...]

    def table(self, split: Binning) -> tuple[ContrastTable, np.ndarray]:
        """Return the ContrastTable by a Binning, and its sums (b, bins, k) over blocks.

        Parameters
        ----------
        split : Binning
        """
        edges = split.edges
        bins = split.bins
        if edges is None:
            sums = sums_by_block(self.block, split.values, len(bins), self.columns)
        else:
            fine = sums_by_block(self.block, split.number(edges), len(edges) - 1, self.columns)
            parts = joined_bins(fine[..., -1])
            sums = np.stack([fine[:, part].sum(axis=1) for part in parts], axis=1)
            edges = (*(edges[part.start] for part in parts), edges[parts[-1].stop])
            bins = tuple(f"{a:g} to {b:g}" for a, b in pairwise(edges))
        with np.errstate(invalid="ignore", divide="ignore"):
            sides = self.sides(sums.sum(axis=0))
        figures = with_sigma(sums, self.figure, self.weights)
        return ContrastTable(split.by, edges, bins, *sides, *figures), sums

    def whole(self) -> tuple[ContrastTable, np.ndarray]:
        """Return the ContrastTable of all items in one bin, and its sums."""
        return self.table(Binning("all", np.zeros(len(self.block), int), bins=("all",)))


@dataclass(frozen=True)
class Contrast:
    """Channel of the real and the simulated cloud, compared.

    Parameters
    ----------
    channel : str
        intensity, density, dropout or edge_width.
    silent : str
        Reason why nothing is compared, in a sentence; otherwise empty.
    whole : ContrastTable, optional
        Table of all bins as one.
    tables : tuple of ContrastTable
    sentences : tuple of str
        Sentences on significant differences.
    """

    channel: str
    silent: str = ""
    whole: ContrastTable | None = None
    tables: tuple[ContrastTable, ...] = ()
    sentences: tuple[str, ...] = ()

    def document(self) -> dict:
        """Return a row of ``contrasts`` in gap.json."""
        is_ratio = self.channel in RATIOS
        return {
            "channel": self.channel,
            "figure": "ratio" if is_ratio else "difference",
            "unit": UNITS[self.channel],
            "silent": self.silent,
            "whole": None if self.whole is None else self.whole.document(is_ratio),
            "tables": [table.document(is_ratio) for table in self.tables],
            "sentences": list(self.sentences),
            "confidence": SETTINGS.difference_confidence,
            "replicas": SETTINGS.bootstrap_replicas,
        }


def block_of(place: np.ndarray) -> np.ndarray:
    """Index (n,) of the ground block of each position, from 0.

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
        Bin of each; -1 for none.
    bins : int
    columns : list of k (n,) arrays
    """
    sums = np.zeros((int(block.max(initial=-1)) + 1, bins, len(columns)))
    kept = number >= 0
    for column, values in enumerate(columns):
        np.add.at(sums[..., column], (block[kept], number[kept]), values[kept])
    return sums


def effective(weight: np.ndarray) -> np.ndarray:
    """Effective number of equally weighted blocks (...), from weights (b, ...).

    Parameters
    ----------
    weight : (b, ...) array
    """
    return weight.sum(axis=0) ** 2 / np.maximum((weight**2).sum(axis=0), 1e-300)


def joined_bins(weight: np.ndarray) -> list[slice]:
    """Merge fine bins so that each has enough blocks; none before and after all data.

    Parameters
    ----------
    weight : (b, bins) array
        Weight of each block in each fine bin.
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
    if start < stop:  # the rest is not a separate bin
        if bins:
            start = bins.pop().start
        bins.append(slice(start, stop))
    return bins


def weights_of(blocks: int, rng: np.random.Generator) -> np.ndarray:
    """Draw counts (replicas, blocks) of each block for the bootstrap.

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
    """Figure of each bin, its sigma from a bootstrap over blocks, and its number of blocks.

    Parameters
    ----------
    sums : (b, bins, k) array
        The last column is the weight of a block.
    figure : function
        Of sums (..., bins, k): values (..., bins).
    weights : (replicas, b) array

    Returns
    -------
    value, sigma, blocks : (bins,) arrays
        Effective number of blocks; NaN for values with too few of them for a sigma.
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
    """Threshold (n,) of a difference in sigmas, for a number of tests (Bonferroni).

    Parameters
    ----------
    blocks : (n,) array
        Number of blocks behind each sigma.
    tests : int
    """
    return t.isf(
        0.5 * (1 - SETTINGS.difference_confidence) / max(tests, 1), np.maximum(blocks - 1, 1.0)
    )
