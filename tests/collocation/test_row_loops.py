"""The loops over rows are products with H, which is written out here."""

import numpy as np
import pytest

from mlscorr.collocation._graph import information_edges
from mlscorr.collocation._pattern import Pattern
from mlscorr.collocation._row_loops import (
    add_information,
    observe,
    row_covariances,
)
from tests.collocation.linked_rows import Street
from tests.collocation.test_block_cholesky import blocks
from tests.collocation.test_sparse_rows import sides_of


@pytest.fixture(scope="module", params=["exponential", "matern52", "integrated"])
def bed(request):
    "Arguments of the loops, and W H of all rows of ties and of control"
    layout, knots, sides = sides_of(Street(request.param, 60.0, targets=4, ties=12), 0)
    count = len(knots.clock)
    sides = [s._replace(unknown=np.where(s.unknown >= 0, s.unknown + count, -1)) for s in sides]
    widths = np.bincount(layout.signal) * layout.states
    sizes = np.append(np.repeat(widths, np.diff(knots.first)), np.full(4, 3))
    pattern = Pattern.of(sizes, information_edges(layout, knots, sides))
    cells = np.where(knots.cells >= 0, pattern.place[knots.cells], -1)
    placed = [part.placed(pattern.place) for part in sides]
    observing = [written_out(layout, pattern, cells, part) for part in placed]
    return (layout, pattern, cells), placed, observing


def written_out(layout, pattern, cells, sides):
    "W H (n, r, states) of observations"
    n, r = sides.sigma.shape
    h = np.zeros((n, r, pattern.states))
    for i in range(n):
        for e in range(sides.cell.shape[1]):
            for j, s in enumerate(layout.signal):
                d = layout.states[s]
                local = np.sum(layout.signal[:j] == s)
                for end in range(2):
                    node = cells[sides.cell[i, e], s, end]
                    if node >= 0:
                        state = pattern.first[node] + local * d
                        gain = sides.gains[i, e, s, end * d : end * d + d]
                        h[i, :, state : state + d] += np.outer(sides.mixing[i, e, :, j], gain)
        if sides.unknown[i] >= 0:
            h[i, np.arange(r), pattern.first[sides.unknown[i]] + np.arange(r)] += sides.sigma[i]
    return sides.white @ h


def test_states_are_observed_and_told_of_rows(bed):
    "W H x and H^T W^T y"
    loops, sides, observing = bed
    rng = np.random.default_rng(1)
    for part, h in zip(sides, observing, strict=True):
        x = rng.normal(size=(h.shape[2], 3))
        y = rng.normal(size=(*h.shape[:2], 3))
        seen = np.zeros((*part.sigma.shape, x.shape[1]))
        observe(*loops, part, x, seen, False)
        assert np.abs(seen - h @ x).max() < 1e-9 * np.abs(seen).max()
        sent = np.zeros_like(x)
        observe(*loops, part, sent, y, True)
        assert np.abs(sent - np.einsum("nrs,nrc->sc", h, y)).max() < 1e-9 * np.abs(sent).max()


def test_information_is_the_square_of_what_rows_see(bed):
    "H^T R^-1 H in the lower triangle, and nothing of it outside the pattern"
    loops, sides, observing = bed
    pattern = loops[1]
    values = pattern.zeros
    total = 0.0
    for part, h in zip(sides, observing, strict=True):
        add_information(*loops, part, values)
        total = total + np.einsum("nrs,nrt->st", h, h)
    rest = np.tril(total)
    for rows, columns, where in blocks(pattern):
        block = total[rows, columns]
        assert np.abs(values[where] - block).max() < 1e-9 * np.abs(total).max()
        rest[rows, columns] = 0.0
    assert np.abs(rest).max() < 1e-12 * np.abs(total).max()


def test_covariances_of_rows_come_from_blocks_of_the_inverse(bed):
    "W H Z H^T W^T of each observation with a random symmetric Z of the pattern"
    loops, sides, observing = bed
    pattern = loops[1]
    root = np.random.default_rng(2).normal(size=(pattern.states, pattern.states))
    symmetric = root + root.T
    values = pattern.zeros
    for rows, columns, where in blocks(pattern):
        values[where] = symmetric[rows, columns]
    for part, h in zip(sides, observing, strict=True):
        covariances = row_covariances(*loops, part, values)
        expected = h @ symmetric @ h.swapaxes(1, 2)
        assert np.abs(covariances - expected).max() < 1e-9 * np.abs(expected).max()
