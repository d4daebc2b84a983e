"""Evidence: how probable the residuals are when nothing, some effect or something unknown acts.

Residuals r = A x + e with e of covariance V and amplitudes x ~ N(0, s^2 I); integrated over x
(Rasmussen and Williams 2006, Eq. 2.43, with a finite basis),

    log p(r | A) - log p(r) = - 1/2 log det(I + s^2 G) + 1/2 b^T (G + I / s^2)^-1 b,
    G = A^T V^-1 A,  b = A^T V^-1 r.

Columns of A are scaled to an rms of one metre in the rows that they change, so that one grid of s
serves all effects. It is averaged over s and over the ErrorModels of V. What comes with many
members, as events do with their times and widths, is the mean over them: the price of having
looked often.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from mlscorr.gap.evidence._error_models import ErrorModel
from mlscorr.gap.evidence.columns import ColumnTable, block_groups
from mlscorr.gap.evidence.observations import Observations, relevant_models
from mlscorr.gap.evidence.settings import SETTINGS


@dataclass(frozen=True)
class BlockEvidence:
    """Log evidence of k residual columns, for each ErrorModel and averaged over them.

    Parameters
    ----------
    models : tuple of s ErrorModel
    none : (s, k) array
        Log of weight times likelihood.
    gain : (h, k) array
        Log evidence of each block, averaged over models, less that of none.
    by_model : (s, h) array
        Log of weight times evidence of each block for the first column.
    """

    models: tuple[ErrorModel, ...]
    none: np.ndarray
    gain: np.ndarray
    by_model: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Log evidence (k,) of none."""
        return np.logaddexp.reduce(self.none, axis=0)


def weigh_blocks(
    observations: Observations,
    models: Sequence[ErrorModel],
    residual: np.ndarray,
    table: ColumnTable,
) -> BlockEvidence:
    """Evidence of residuals under none and each block of a table.

    Parameters
    ----------
    observations : Observations
    models : sequence of ErrorModel
    residual : (n, k) array
        Units: m.
    table : ColumnTable
    """
    groups = list(block_groups(table))
    k = residual.shape[1]
    columns = observations.columns(table.columns)
    none = np.empty((len(models), k))
    total = np.full((len(table.blocks), k), -np.inf)
    by_model = np.empty((len(models), len(table.blocks)))
    for s, model in enumerate(models):
        whitener = observations.whitener(model)
        white = whitener.whiten(np.hstack([residual, columns]))
        y = white[slice(k)]
        a = white[slice(k, None)]
        none[s] = np.log(model.weight) + whitener.log_likelihood(y)
        projected = a.product(y)
        for index, numbers, amplitudes in groups:
            gain = none[s] + block_gain(a.blocks(index), projected[index], amplitudes)
            total[numbers] = np.logaddexp(total[numbers], gain)
            by_model[s, numbers] = gain[:, 0]
    return BlockEvidence(tuple(models), none, total - np.logaddexp.reduce(none, axis=0), by_model)


def without_known(observations: Observations, table: ColumnTable) -> ColumnTable:
    """The table without those unknown errors that some effect makes just so: they are known.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
        Its effects with many members, events and outliers, are not tried.
    """
    white = observations.whitener().whiten(observations.columns(table.columns))
    normal = white.product(white)
    length = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    normal /= np.outer(length, length)
    known = np.array(
        [
            np.einsum(
                "cp,pq,cq->c",
                normal[:, x],
                np.linalg.pinv(normal[np.ix_(x, x)], 1e-9),
                normal[:, x],
            )
            > SETTINGS.same
            for x in (block.columns for block in table.blocks if block.label in table.steady)
        ]
    )
    if len(known) == 0:
        return table
    keep = [
        block.label != "unknown" or not known[:, block.columns].all(axis=1).any()
        for block in table.blocks
    ]
    return replace(table, blocks=tuple(compress(table.blocks, keep)))


def block_gain(
    normal: np.ndarray, projected: np.ndarray, amplitudes: Sequence[float]
) -> np.ndarray:
    """Log evidence over that of none, averaged over amplitudes.

    Parameters
    ----------
    normal : (h, p, p) array
        G of each of h blocks.
    projected : (h, p, k) array
        b for each of k residual columns.
    amplitudes : sequence of float
        s. Units: m.

    Returns
    -------
    gain : (h, k) array
    """
    value, vector = np.linalg.eigh(normal)
    value = np.maximum(value, 0.0)
    square = (vector.swapaxes(1, 2) @ projected) ** 2
    gain = np.full((len(normal), projected.shape[2]), -np.inf)
    for s in amplitudes:
        part = (square / (value + s**-2)[:, :, None]).sum(axis=1)
        gain = np.logaddexp(gain, 0.5 * (part - np.log1p(s**2 * value).sum(axis=1)[:, None]))
    return gain - np.log(len(amplitudes))


def steady_columns(observations: Observations, table: ColumnTable) -> np.ndarray:
    """Columns (n, q) of all effects that are no events.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
    """
    use = [block.columns for block in table.blocks if block.label in table.steady]
    use = np.unique(np.concatenate([np.zeros(0, dtype=int), *use]))
    return observations.columns(table.columns[:, use])


def suited_models(
    observations: Observations,
    table: ColumnTable,
    models: Iterable[ErrorModel],
    residual: np.ndarray,
) -> tuple[ErrorModel, ...]:
    """Those models that explain residuals when nothing acts, or all effects that are no events and
    what changes slowly with time.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
    models : iterable of ErrorModel
    residual : (n, 1) array
        Units: m.
    """
    steady = steady_columns(observations, table)
    time = observations.errors.gps_time
    place = observations.errors.place
    time = time - time[0]
    wave = np.arange(12) * np.pi * time[:, None] / max(time[-1], 1e-9)
    slow = (np.cos(wave)[:, :, None] * place[:, None]).reshape(len(observations), -1)
    nuisances = steady[:, :0], np.hstack([steady, slow])
    return relevant_models(observations, models, residual, nuisances)
