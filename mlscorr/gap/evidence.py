"""Evidence: how probable the residuals are when nothing, some effect or something unknown acts.

Residuals r = A x + e with e of covariance V and amplitudes x ~ N(0, s^2 I); integrated over x
(Rasmussen and Williams 2006, Eq. 2.43, with a finite basis),

    log p(r | A) - log p(r) = - 1/2 log det(I + s^2 G) + 1/2 b^T (G + I / s^2)^-1 b,
    G = A^T V^-1 A,  b = A^T V^-1 r.

Columns of A are scaled to an rms of one metre in the rows that they change, so that one grid of s
serves all effects. It is averaged over s and over the Settings of V. What comes with many members,
as events do with their times and widths, is the mean over them: the price of having looked often.
"""

from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from mlscorr.gap.background import BELIEVED
from mlscorr.gap.separability import SAME
from mlscorr.gap.unknown import UnknownBlock
from mlscorr.gap.whitening import whitener

AMPLITUDES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)  # m, induced rms
USED = 6  # of them; the largest is for events beyond a large sigma of the POS
TOUCHED = 0.1  # of a column's largest value: rows above it count as changed
# Log evidence counts by these factors, for what a covariance of another shape than assumed, or a
# heavier tail, looks like, and for all else (a power likelihood: Grünwald and van Ommen 2017).
# Found on seeds of their own: python benchmarks/gap_study.py --seed 5000, 6000 and 7000
DRIFT_TRUST, TAIL_TRUST, TRUST = 0.65, 0.4, 0.7
DRIFTING = 0.2  # weight of unknown errors of the position in time while the library has events
OUTLIER = 4.0  # sigmas of a survey; what is less is no outlier
FULL = 0.5  # prior weight of all components of a vector together; the rest goes to each alone


@dataclass(frozen=True)
class Block:
    """Columns that act together.

    Parameters
    ----------
    label : str
        The effect's name, or unknown.
    member : int
        Which of the signatures, or of the unknown blocks.
    columns : (p,) int array
        In the Table.
    weight : float
        Prior weight within the label.
    least : float
        Least amplitude (m). An error of the position in time that is no larger than the POS's own
        sigma is drift, not an event.
    trust : float
        Factor on log evidence in favour.
    """

    label: str
    member: int
    columns: np.ndarray
    weight: float
    least: float = 0.0
    trust: float = TRUST

    @property
    def amplitudes(self):
        """Those of its prior."""
        allowed = [s for s in AMPLITUDES if s >= self.least]
        return tuple(allowed[:USED] if self.least == 0.0 else allowed) or AMPLITUDES[-1:]


@dataclass(frozen=True)
class Table:
    """All columns (m, c), scaled; unit (c,) is the parameter that one metre of rms stands for."""

    columns: np.ndarray
    unit: np.ndarray
    blocks: tuple[Block, ...]

    @property
    def labels(self):
        """Labels of the blocks, each once."""
        return tuple(dict.fromkeys(block.label for block in self.blocks))

    def of(self, label):
        """Which blocks (h,) have a label."""
        return np.array([block.label == label for block in self.blocks], dtype=bool)

    def weighed(self, gain):
        """Log of weight times evidence (h, k), which counts by the trust in each block."""
        trust = np.array([block.trust for block in self.blocks])[:, None]
        weight = np.log([block.weight for block in self.blocks])[:, None]
        return weight + np.where(gain > 0, trust, 1.0) * gain


def _kind(one, rows, sigma):
    """Least amplitude and trust of a signature or unknown block."""
    if isinstance(one, UnknownBlock):
        return (_rms_of(sigma, one.columns), DRIFT_TRUST) if one.is_drift else (0.0, TRUST)
    if "time" in one.fixed:
        return _rms_of(sigma, one.jacobian), DRIFT_TRUST
    if "target" in one.fixed:
        return OUTLIER * _rms_of(np.sqrt(rows.survey + rows.noise), one.jacobian), TAIL_TRUST
    return 0.0, TRUST


def table(rows, signatures, unknown, sigma):
    """Table of the signatures that shift the metric rows, and of unknown blocks.

    sigma (m,) is the stated one of each row by the POS's position. Units: m.
    """
    metric, parts, units, blocks, start = rows.metric, [], [], [], 0
    members = {}
    for one in signatures:
        members[one.name] = members.get(one.name, 0) + 1
    for number, one in enumerate(signatures):
        if one.is_noise or not one.jacobian[metric].any():
            continue
        scale = np.array([_rms(column[metric]) for column in one.jacobian.T])
        used = np.flatnonzero(scale > 0)
        parts.append(one.jacobian[:, used] / scale[used])
        units.append(1 / scale[used])
        column, p = start + np.arange(len(used)), len(used)
        share = 1 / members[one.name]
        kind = _kind(one, rows, sigma)
        split = p > 1 and len(set(one.units)) == 1 and "cos" not in one.parameters[0]
        blocks.append(Block(one.name, number, column, share * (FULL if split else 1.0), *kind))
        if split:
            blocks += [
                Block(one.name, number, column[[i]], share * FULL / p, *kind) for i in range(p)
            ]
        start += p
    events = any("time" in one.fixed for one in signatures)
    share = np.array([DRIFTING if one.is_drift and events else 1.0 for one in unknown])
    share /= max(share.sum(), 1.0)
    for number, one in enumerate(unknown):
        p = one.columns.shape[1]
        scale = _rms(np.sqrt((one.columns[metric] ** 2).sum(axis=1)))
        parts.append(one.columns / scale)
        units.append(np.full(p, 1 / scale))
        kind = _kind(one, rows, sigma)
        blocks.append(Block("unknown", number, start + np.arange(p), float(share[number]), *kind))
        start += p
    if not parts:
        return Table(np.zeros((len(rows), 0)), np.zeros(0), ())
    return Table(np.hstack(parts), np.concatenate(units), tuple(blocks))


def _rms_of(sigma, columns):
    """Root mean square of sigma (m,) over the rows that any of the columns changes."""
    size = np.abs(columns).sum(axis=1)
    return float(np.sqrt(np.mean(sigma[size > TOUCHED * size.max()] ** 2)))


def _rms(column):
    """Root mean square over the rows that a column changes; zero where it changes none."""
    size = np.abs(column)
    touched = size > TOUCHED * size.max(initial=0.0)
    return float(np.sqrt(np.mean(column[touched] ** 2))) if touched.any() else 0.0


@dataclass(frozen=True)
class Evidence:
    """Log evidence of k residual columns, for each Setting and averaged over them.

    Parameters
    ----------
    settings : tuple of s Setting
    none : (s, k) array
        Log of weight times likelihood.
    gain : (h, k) array
        Log evidence of each block, averaged over settings, less that of none.
    by_setting : (s, h) array
        Log of weight times evidence of each block for the first column.
    """

    settings: tuple
    none: np.ndarray
    gain: np.ndarray
    by_setting: np.ndarray

    @property
    def total(self):
        """Log evidence (k,) of none."""
        return np.logaddexp.reduce(self.none, axis=0)


def evidence(epochs, settings, residual, table):
    """Evidence of residual columns (n, k) of Epochs under none and each block of a Table."""
    several = list(groups(table))
    columns = epochs.columns(table.columns)
    none = np.empty((len(settings), residual.shape[1]))
    total = np.full((len(table.blocks), residual.shape[1]), -np.inf)
    by_setting = np.empty((len(settings), len(table.blocks)))
    for s, setting in enumerate(settings):
        factor = whitener(epochs, setting)
        white = factor.whiten(np.hstack([residual, columns]))
        k = residual.shape[1]
        y, a = white[slice(k)], white[slice(k, None)]
        none[s] = np.log(setting.weight) + log_likelihood(y, factor)
        projected = a.product(y)
        for index, numbers, amplitudes in several:
            gain = none[s] + block_gain(a.blocks(index), projected[index], amplitudes)
            total[numbers] = np.logaddexp(total[numbers], gain)
            by_setting[s, numbers] = gain[:, 0]
    return Evidence(tuple(settings), none, total - np.logaddexp.reduce(none, axis=0), by_setting)


def novel(epochs, table):
    """The Table without those unknown errors that some effect makes just so: they are known.

    Effects with many members, events and outliers, are not looked at.
    """
    many = {}
    for block in table.blocks:
        many.setdefault(block.label, set()).add(block.member)
    alone = {label for label, members in many.items() if len(members) == 1} - {"unknown"}
    white = whitener(epochs, BELIEVED).whiten(epochs.columns(table.columns))
    normal = white.product(white)
    length = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    normal /= np.outer(length, length)
    made = np.array([
        np.einsum("cp,pq,cq->c", normal[:, x], np.linalg.pinv(normal[np.ix_(x, x)], 1e-9),
                  normal[:, x]) > SAME
        for x in (b.columns for b in table.blocks if b.label in alone)
    ])  # fmt: skip
    if len(made) == 0:
        return table
    kept = [b.label != "unknown" or not made[:, b.columns].all(axis=1).any() for b in table.blocks]
    return replace(table, blocks=tuple(compress(table.blocks, kept)))


def log_likelihood(white, factor):
    """Of White columns (k,), without the constant."""
    return -0.5 * (white.squares + factor.log_determinant)


def groups(table):
    """Blocks alike in size and amplitudes: column numbers (h, p), block numbers, amplitudes."""
    kinds = {}
    for number, block in enumerate(table.blocks):
        kinds.setdefault((len(block.columns), block.amplitudes), []).append(number)
    for (_, amplitudes), numbers in kinds.items():
        index = np.array([table.blocks[i].columns for i in numbers])
        yield index, np.array(numbers), amplitudes


def block_gain(normal, projected, amplitudes=AMPLITUDES[:USED]):
    """Log evidence (h, k) over that of none, averaged over amplitudes.

    normal (h, p, p) is G, projected (h, p, k) is b.
    """
    value, vector = np.linalg.eigh(normal)
    value = np.maximum(value, 0.0)
    square = (vector.swapaxes(1, 2) @ projected) ** 2
    gain = np.full((len(normal), projected.shape[2]), -np.inf)
    for s in amplitudes:
        part = (square / (value + s**-2)[:, :, None]).sum(axis=1)
        gain = np.logaddexp(gain, 0.5 * (part - np.log1p(s**2 * value).sum(axis=1)[:, None]))
    return gain - np.log(len(amplitudes))
