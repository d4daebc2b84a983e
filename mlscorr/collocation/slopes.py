"""How a likelihood changes with signals and trend, for the search of their parameters."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mlscorr.collocation.dense import signal_covariance
from mlscorr.collocation.model import Collocation
from mlscorr.collocation.sparse_rows import SparseRows


def likelihood_changes(
    solved: Collocation,
    rows: Sequence[SparseRows],
    changed: Sequence[Sequence[SparseRows]],
    believed: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    r"""How the restricted log-likelihood (k,) changes with the signals, of first order in dV.

    d log L = (w^T dV w - tr(P dV)) / 2 with w = V^-1 (l - A x) and P = V^-1 less the trend's part
    (Rasmussen and Williams 2006, Eq. 5.9): one factor of V for any number of parameters.

    Parameters
    ----------
    solved : Collocation
        By ``collocate_rows_dense``.
    rows : sequence of SparseRows
        That it solved.
    changed : sequence of k sequences of SparseRows
        The same with signals that are a little different.
    believed : sequence of k arrays, optional
        Of the trend beside each of these; as solved by default.

    Examples
    --------
    A misclosure of 2 m where 1 m is believed: with a thousandth more its log-likelihood rises by
    (4 - 1) / 2 of dV, 0.002 m^2.

    >>> from mlscorr.collocation import Noise, Signal, SparseRows
    >>> from mlscorr.collocation import collocate_rows_dense, likelihood_changes
    >>> from mlscorr.collocation.covariance import Covariance
    >>> noise, none = Noise(np.full((1, 1, 1), 1e-6)), np.zeros((1, 1, 0))
    >>> drift = Covariance("exponential", 30.0)
    >>> scales = [Signal(np.full((1, 1, 1), scale), drift) for scale in (1.0, 1.001)]
    >>> rows, more = ([SparseRows(np.zeros((1, 1)), np.full((1, 1), 2.0), noise, none, [signal])]
    ...               for signal in scales)
    >>> likelihood_changes(collocate_rows_dense(rows), rows, [more]).round(4)
    array([0.003])
    """
    slope = np.outer(solved.weights, solved.weights)
    slope -= solved.precision_of(np.arange(len(slope)))
    slope = np.tril(slope) - np.diag(np.diag(slope) / 2)  # each of a pair counts a half
    by_variance = np.einsum("mi,mi->i", solved.design, slope @ solved.design)  # dV = A dS A^T
    before: dict[tuple, np.ndarray] = {}
    changes = []
    for other, trend in zip(changed, believed or [solved.believed] * len(changed), strict=True):
        numbers = _differing(rows, other)
        if numbers not in before:
            before[numbers] = signal_covariance(_with_signals(rows, numbers))
        after = signal_covariance(_with_signals(other, numbers))
        change = np.vdot(slope, after - before[numbers])
        changes.append(change + by_variance @ (_variance(trend) - _variance(solved.believed)))
    return np.array(changes)


def _variance(believed):
    """Of each coefficient (p,); zero where nothing is believed, so that it is always the same."""
    precision = np.sum(believed**2, axis=0)
    return np.divide(1.0, precision, out=np.zeros_like(precision), where=precision > 0)


def _differing(rows, others):
    """Numbers of the signals that differ in other rows."""
    same = [
        [
            here.covariance == there.covariance
            and np.array_equal(here.mixing, there.mixing)
            and np.array_equal(here.clock, there.clock)
            for here, there in zip(part.signals, other.signals, strict=True)
        ]
        for part, other in zip(rows, others, strict=True)
    ]
    return tuple(np.flatnonzero(~np.all(same, axis=0)).tolist())


def _with_signals(rows, numbers):
    """The rows with some of their signals alone."""
    return [replace(part, signals=[part.signals[k] for k in numbers]) for part in rows]
