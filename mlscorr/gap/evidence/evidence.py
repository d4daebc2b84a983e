"""Evidence: probability of the residuals with no effect, some effect or something unknown.

Residuals r = A x + e with e of covariance V and amplitudes x ~ N(0, s^2 I); integrated over x
(Rasmussen and Williams 2006, Eq. 2.43, with a finite basis),

    log p(r | A) - log p(r) = - 1/2 log det(I + s^2 G) + 1/2 b^T (G + I / s^2)^-1 b,
    G = A^T V^-1 A,  b = A^T V^-1 r.

Columns of A are scaled to an RMS of one meter in the rows that they change, so that one grid of s
serves all effects. Evidence is averaged over s and over the ErrorModels of V. For labels with many
members, such as events with their times and widths, it is the mean over them, which accounts for
multiple tests.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np

from mlscorr.gap.evidence.observations import ErrorModel, Observations, relevant_models
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.unknown import UnknownBlock
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Signature


@dataclass(frozen=True)
class ColumnBlock:
    """Columns that act together.

    Parameters
    ----------
    label : str
        The effect's name, or unknown.
    member : int
        Index of the signature, or of the unknown block.
    columns : (p,) int array
        In the ColumnTable.
    weight : float
        Prior weight within the label.
    least : float
        Smallest amplitude (m). A position error over time that is no larger than the POS's own
        sigma is drift, not an event.
    """

    label: str
    member: int
    columns: np.ndarray
    weight: float
    least: float = 0.0

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """Amplitudes of its prior."""
        allowed = tuple(s for s in SETTINGS.amplitudes if s >= self.least)
        return allowed or SETTINGS.amplitudes[-1:]


@dataclass(frozen=True)
class ColumnTable:
    """All columns (m, c) of signatures and unknown blocks, scaled to an RMS of one meter."""

    columns: np.ndarray
    blocks: tuple[ColumnBlock, ...]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Labels of the blocks, each once."""
        return tuple(dict.fromkeys(block.label for block in self.blocks))

    @property
    def effects(self) -> tuple[str, ...]:
        """Labels except unknown."""
        return tuple(label for label in self.labels if label != "unknown")

    @cached_property
    def steady(self) -> set[str]:
        """Effects that are not events, with a single member."""
        members = {(block.label, block.member) for block in self.blocks}
        count = Counter(label for label, _ in members)
        return {label for label in self.effects if count[label] == 1}

    def of(self, label: str) -> np.ndarray:
        """Return the blocks (h,) bool of a label."""
        return np.array([block.label == label for block in self.blocks], dtype=bool)

    def weighed(self, gain: np.ndarray) -> np.ndarray:
        """Return the log of weight times evidence (h, k)."""
        return np.log([block.weight for block in self.blocks])[:, None] + gain

    def best(self, label: str, gain: np.ndarray) -> int:
        """Return the index of a label's block that explains a column best, by gains (h,)."""
        numbers = np.flatnonzero(self.of(label))
        return int(numbers[np.argmax(self.weighed(gain[:, None])[numbers, 0])])


def column_table(
    rows: Rows, signatures: Sequence[Signature], unknown: Sequence[UnknownBlock], sigma: np.ndarray
) -> ColumnTable:
    """Make columns of the signatures that shift the metric rows, and of unknown blocks.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    unknown : sequence of UnknownBlock
    sigma : (m,) array
        Stated sigma of each row due to the POS position. Units: m.
    """
    metric = rows.metric
    parts = [np.zeros((len(rows), 0))]
    blocks = []
    members = Counter(signature.name for signature in signatures)

    def add(columns, block):
        """Add columns with one block of all, whose indices are block.columns."""
        blocks.append(replace(block, columns=block.columns + sum(p.shape[1] for p in parts)))
        parts.append(columns)

    for number, signature in enumerate(signatures):
        if signature.is_noise or not signature.jacobian[metric].any():
            continue
        if signature.kind.moment() and is_of_one_target(rows, signature.jacobian):
            continue
        scale = np.array([_rms(column[metric]) for column in signature.jacobian.T])
        used = np.flatnonzero(scale > 0)
        least = 0.0
        if signature.kind.moment():
            least = _rms_of(sigma, signature.jacobian)
        elif signature.kind.is_on_target():
            survey = _rms_of(np.sqrt(rows.survey + rows.noise), signature.jacobian)
            least = SETTINGS.outlier * survey
        p = len(used)
        share = 1 / members[signature.name]
        every = ColumnBlock(signature.name, number, np.arange(p), share, least)
        is_vector = p > 1 and not signature.kind.is_wave()
        add(
            signature.jacobian[:, used] / scale[used],
            replace(every, weight=share / 2 if is_vector else share),
        )
        single = replace(every, weight=share / 2 / p)  # each component of a vector, evenly
        blocks += [replace(single, columns=np.array([c])) for c in blocks[-1].columns if is_vector]
    events = any(signature.kind.moment() for signature in signatures)
    for number, (block, share) in enumerate(_with_shares(unknown, events)):
        least = _rms_of(sigma, block.columns) if block.is_drift else 0.0
        index = np.arange(block.columns.shape[1])
        columns = block.columns / _rms(np.sqrt((block.columns[metric] ** 2).sum(axis=1)))
        add(columns, ColumnBlock("unknown", number, index, share, least))
    return ColumnTable(np.hstack(parts), tuple(blocks))


def _with_shares(unknown, events):
    """Pairs of unknown blocks and their shares; less for drift if events also explain it."""
    shares = [SETTINGS.unknown_drift if block.is_drift and events else 1.0 for block in unknown]
    total = max(sum(shares), 1.0)
    return [(block, share / total) for block, share in zip(unknown, shares, strict=True)]


def is_of_one_target(rows: Rows, jacobian: np.ndarray) -> bool:
    """True if all changed rows are all rows of one surveyed target, which its outlier explains.

    Parameters
    ----------
    rows : Rows
    jacobian : (m, p) array
    """
    size = np.abs(np.where(rows.metric[:, None], jacobian, 0.0)).max(axis=1)
    changed = size > SETTINGS.changed * size.max()
    targets = np.unique(rows.survey_item[changed])
    if len(targets) != 1 or targets[0] < 0:
        return False
    items = rows.item[changed]
    return bool(np.isin(rows.item[rows.survey_item == targets[0]], items).all())


def _rms_of(sigma, columns):
    """Root mean square of sigma (m,) over the rows that any of the columns changes."""
    size = np.abs(columns).sum(axis=1)
    return float(np.sqrt(np.mean(sigma[size > SETTINGS.changed * size.max()] ** 2)))


def _rms(column):
    """Root mean square over the rows that a column changes; zero if it changes none."""
    size = np.abs(column)
    changed = size > SETTINGS.changed * size.max(initial=0.0)
    if changed.any():
        return float(np.sqrt(np.mean(column[changed] ** 2)))
    return 0.0


def block_groups(table: ColumnTable) -> Iterator[tuple[np.ndarray, np.ndarray, tuple[float, ...]]]:
    """Yield blocks of equal size and amplitudes: column indices (h, p), block indices,
    amplitudes.
    """
    kinds: dict = {}
    for number, block in enumerate(table.blocks):
        kinds.setdefault((len(block.columns), block.amplitudes), []).append(number)
    for (_, amplitudes), numbers in kinds.items():
        index = np.array([table.blocks[i].columns for i in numbers])
        yield index, np.array(numbers), amplitudes


@dataclass(frozen=True)
class BlockEvidence:
    """Log evidence of k residual columns, for each ErrorModel and averaged over them.

    Parameters
    ----------
    models : tuple of s ErrorModel
    none : (s, k) array
        Log of weight times likelihood.
    gain : (h, k) array
        Log evidence of each block, averaged over models, minus that of none.
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
    """Weigh the evidence of residuals under none and each block of a table.

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
    """Return the table without unknown errors that some effect explains exactly.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
        Its effects with many members (events and outliers) are not tried.
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
    """Columns (n, q) of all effects that are not events.

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
    """Models that explain residuals with no effect, or with all steady effects and slow changes.

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
