"""Collocation of rows of any kind: by the recursion where it is exact, otherwise by knots.

The recursion processes one epoch after another. A row of two epochs, B_1 f(t_1) + B_2 f(t_2) = l,
equals two rows of one epoch each that share an unknown place u with a diffuse prior,

    B_1 f(t_1) + u = l,     -B_2 f(t_2) + u = 0,     u ~ N(0, S^2),   S -> infinity,

whose difference is the row itself; log S is removed from the likelihood. Each place costs a column,
so this is used for a few steps of a path, while thousands of ties are solved by knots.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mlscorr.collocation.linked import collocate_by_knots
from mlscorr.collocation.markov import collocate
from mlscorr.collocation.model import Collocation, Noise, Signal
from mlscorr.collocation.sparse_rows import SparseRows

FREE = 1e4  # S over the sigma of the rows there: u takes 1e-8 of the variance
PLACES = 600  # columns of places: more of them cost more than knots; guard


def collocate_rows(
    rows: Sequence[SparseRows],
    like: Any = None,
    tolerance: float = 0.0,
    prior_rows: np.ndarray | None = None,
) -> Collocation:
    r"""Separate the misclosures of sparse rows into trend, signal and noise.

    Solves l = A x + B s + n. Rows of one epoch each, and a few of two, are solved exactly (1e-9) by
    ``collocate``; others to 1e-5 m by ``collocate_by_knots``.

    Parameters
    ----------
    rows : sequence of SparseRows
        With the same signals and trend: targets, steps of the path, ties.
    like, tolerance
        See ``collocate_by_knots``.
    prior_rows : (k, p + 1) array, optional
        Prior of the trend; see Collocation.

    Returns
    -------
    solved : Collocation
        Its rows are those of all observations, one after the other.

    Raises
    ------
    ValueError
        See these two functions.

    Examples
    --------
    A step of 0.3 m in the path, before which control constrains the drift to 1 mm:

    >>> from mlscorr.collocation import Covariance, Noise, Signal, SparseRows, collocate_rows
    >>> drift, none = Covariance("matern32", 30.0), np.zeros((1, 1, 0))
    >>> noise, unit = Noise(np.full((1, 1, 1), 1e-6)), np.ones((1, 1, 1))
    >>> held = SparseRows(np.array([[0.0]]), np.zeros((1, 1)), noise, none, [Signal(unit, drift)])
    >>> sides = Signal(np.array([-1.0, 1.0])[:, None, None], drift)
    >>> step = SparseRows(np.array([[0.0, 900.0]]), np.full((1, 1), 0.3), noise, none, [sides])
    >>> mean, covariance = collocate_rows([held, step]).predict(np.array([900.0]), none, [unit])
    >>> mean.round(4), np.sqrt(covariance).round(4)
    (array([[0.3]]), array([[[0.0014]]]))
    """
    if not _is_in_time(rows):
        return collocate_by_knots(rows, like, tolerance, prior_rows)
    if len(rows) == 1 and _epochs(rows[0]) == 1:
        (part,) = rows
        given = part.misclosure, part.noise, part.design, part.signals
        return collocate(part.gps_time[:, 0], *given, prior_rows)
    gps_time, misclosure, noise, design, signals, second_views = _in_time(rows)
    return collocate(gps_time, misclosure, noise, design, signals, prior_rows, second_views)


def _is_in_time(rows):
    """True if the recursion can solve the rows: equal size of observations, few with two epochs."""
    heights = {part.misclosure.shape[1] for part in rows}
    links = [part for part in rows if _epochs(part) == 2]
    columns = sum(part.misclosure.size for part in links)
    is_alone = all(part.noise.group is None for part in links)
    has_more = any(_epochs(part) > 2 for part in rows)
    return len(heights) == 1 and columns <= PLACES and is_alone and not has_more


def _in_time(rows):
    """Input of ``collocate``: all first views, then the second views of rows with two epochs."""
    links = [part for part in rows if _epochs(part) == 2]
    views = [_view(part, 0) for part in rows] + [_view(part, 1) for part in links]
    gps_time, misclosure, design, own, clocks = (
        np.concatenate(parts) for parts in zip(*(view[:5] for view in views), strict=True)
    )
    signals = [
        Signal(
            np.concatenate([view.mixings[number] for view in views]),
            signal.covariance,
            clocks[:, number],
        )
        for number, signal in enumerate(rows[0].signals)
    ]
    free = np.concatenate([np.zeros((0, own.shape[1])), *(_free(part) for part in links)])
    group, shared = _groups(rows, free)
    return gps_time, misclosure, Noise(own, group, shared), design, signals, free


class _View(NamedTuple):
    """One epoch of each of n observations."""

    gps_time: np.ndarray
    misclosure: np.ndarray
    design: np.ndarray
    own: np.ndarray
    clocks: np.ndarray
    mixings: list[np.ndarray]


def _view(part, side):
    """View of one side; a second view has only the place, from which a row is subtracted."""
    n, epochs = part.gps_time.shape
    r = part.misclosure.shape[1]
    sign = 1.0 - 2.0 * side
    clocks = part.epochs[1].reshape(n, epochs, len(part.signals))[:, side]
    mixings = [
        sign * signal.mixing.reshape(n, epochs, r, signal.mixing.shape[-1])[:, side]
        for signal in part.signals
    ]
    known = 1.0 - side
    own = part.noise.own / epochs
    return _View(
        part.gps_time[:, side], known * part.misclosure, known * part.design, own, clocks, mixings
    )


def _free(part):
    """Sigma (n, r) of the places, far above their signals and noise."""
    noise = np.sqrt(np.einsum("nii->ni", part.noise.own).max(axis=1))
    size = np.hypot(noise, np.abs(part.misclosure).max(axis=1))
    for signal in part.signals:
        amplitude = np.linalg.norm(signal.mixing, axis=(1, 2)).reshape(part.gps_time.shape)
        size = np.hypot(size, np.linalg.norm(amplitude, axis=1))
    return np.tile(FREE * size[:, None], (1, part.misclosure.shape[1]))


def _groups(rows, free):
    """Group of each view, and shared sigmas: of targets in all passes, and of the places of two
    views.
    """
    groups = []
    places = []
    shared = []
    count = 0
    for part in rows:
        noise = part.noise
        n, r = part.misclosure.shape
        if noise.group is None:
            own = np.arange(n)
            sigma = np.zeros((n, r))
        else:
            own = noise.group
            sigma = noise.shared
        groups.append(count + own)
        if _epochs(part) == 2:
            places.append(count + own)
            sigma = free[:n]
            free = free[n:]
        shared.append(sigma)
        count += len(sigma)
    return np.concatenate([*groups, *places]), np.concatenate(shared)


def _epochs(part):
    return np.shape(part.gps_time)[1]
