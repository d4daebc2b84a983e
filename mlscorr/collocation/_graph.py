"""Which knots and shared errors of sparse rows know of each other: the edges of L."""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from mlscorr.collocation._knots import Knots
from mlscorr.collocation._states import Layout
from mlscorr.collocation.sparse_rows import Sides


def information_edges(layout: Layout, knots: Knots, sides: Sequence[Sides]) -> np.ndarray:
    """Pairs (h, 2) of nodes.

    All knots about a time are linked, so that the inverse knows what is needed at any epoch, and
    so are all that an observation sees.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    sides : sequence of Sides
        Numbered as the knots are, and not in the order of elimination.
    """
    about = list(knots.cells.reshape(len(knots.cells), -1).T)
    pairs = [_distinct(combinations(about, 2))]
    for part in sides:
        groups = [[part.unknown]]
        groups += [list(_visible(layout, knots, part, e)) for e in range(part.cell.shape[1])]
        for left, right in combinations(groups, 2):
            pairs.append(_distinct(product(left, right)))
    return np.concatenate(pairs)


def _visible(layout, knots, sides, e):
    """Nodes (n,) visible to side e of each observation, -1 for none: two for each signal."""
    for s, d in enumerate(layout.states):
        before, after = knots.cells[sides.cell[:, e], s].T
        yield before
        is_between = sides.gains[:, e, s, 1 : 2 * d].any(axis=1)  # not at the knot before
        yield np.where(is_between, after, -1)


def _distinct(pairs):
    """Distinct pairs (h, 2) of nodes of some pairs of arrays, where both are some."""
    bits = 32
    codes = [np.zeros(0, dtype=np.int64)]
    codes += [(a << bits | b)[(a >= 0) & (b >= 0)] for a, b in pairs]
    codes = np.sort(np.concatenate(codes))
    codes = codes[np.diff(codes, prepend=-1) > 0]  # sooner than np.unique, which fills a table
    return np.column_stack([codes >> bits, codes & ((1 << bits) - 1)])
