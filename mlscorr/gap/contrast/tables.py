"""Tables of a channel by what it may depend on, and what is behind them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from mlscorr.gap.contrast._blocks import joined_bins, limit, sums_by_block, with_sigma
from mlscorr.gap.contrast._settings import SETTINGS

RATIOS = ("intensity", "density")  # channels whose figure is a ratio; else it is a difference
UNITS = {"intensity": "counts", "density": "points", "edge_width": "mrad", "dropout": "share"}


@dataclass(frozen=True)
class ContrastTable:
    """A channel by one thing that it may depend on.

    Parameters
    ----------
    by : str
        range (m), incidence (deg), reflectance, or all.
    edges : tuple of b + 1 float, or None
    bins : tuple of b str
    real, simulated : (b,) array
        In the channel's own unit.
    value, sigma : (b,) array
        Difference of the two, or log of their ratio, and its sigma by blocks; NaN where there are
        too few of them.
    blocks : (b,) array
        On which that rests.
    differs : (b,) bool array
        Where it is more than chance.
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
        """The table with what differs by more than chance, where so many bins are looked at.

        Parameters
        ----------
        tests : int
        """
        with np.errstate(invalid="ignore"):
            differs = np.abs(self.value) > limit(self.blocks, tests) * self.sigma
        return replace(self, differs=differs)

    def document(self, is_ratio: bool) -> dict:
        """A table of ``contrasts`` in gap.json.

        Parameters
        ----------
        is_ratio : bool
            Whether the value is the log of a ratio.
        """
        value = np.exp(self.value) if is_ratio else self.value
        columns = {
            "real": self.real,
            "simulated": self.simulated,
            "value": value,
            "sigma": self.sigma * value if is_ratio else self.sigma,
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
    """What things (n,) are sorted by.

    Parameters
    ----------
    by : str
    values : (n,) array
        Or numbers of bins, where there are no edges; -1 for none.
    edges : tuple of float, optional
        Of the finest bins.
    bins : tuple of str
    """

    by: str
    values: np.ndarray
    edges: tuple[float, ...] | None = None
    bins: tuple[str, ...] = ()

    def number(self, edges: tuple[float, ...] | None) -> np.ndarray:
        """The bin (n,) of each thing; -1 for none.

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
    """Columns (n,) of n things in blocks, and what figures their sums give.

    Parameters
    ----------
    channel : str
    block : (n,) int array
    columns : list of k (n,) arrays
        The last is what each thing weighs.
    figure : function
        Of sums (..., bins, k): values (..., bins).
    sides : function
        Of sums (bins, k): real and simulated figure (bins,).
    weights : (replicas, b) array
        Of the bootstrap.
    without : function
        Of a change (n,) of the figure of each thing: the Measure of what is left without it.
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
        """ContrastTable by a Binning, and the sums (b, bins, k) over blocks that made it.

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
        """ContrastTable of all things as one bin, and its sums."""
        return self.table(Binning("all", np.zeros(len(self.block), int), bins=("all",)))


@dataclass(frozen=True)
class Contrast:
    """A channel of the real cloud beside the simulated one's.

    Parameters
    ----------
    channel : str
        intensity, density, dropout or edge_width.
    silent : str
        Why nothing is compared, in a sentence; else nothing.
    whole : ContrastTable, optional
        Of all bins as one.
    tables : tuple of ContrastTable
    sentences : tuple of str
        Where the two differ by more than chance.
    """

    channel: str
    silent: str = ""
    whole: ContrastTable | None = None
    tables: tuple[ContrastTable, ...] = ()
    sentences: tuple[str, ...] = ()

    def document(self) -> dict:
        """A row of ``contrasts`` in gap.json."""
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
