"""How far the gap shrinks, on data not used to find the cause, once the simulator has it.

The survey is cut into blocks of time. For each fold of blocks the whole diagnosis, the choice of
the label included, is done on the others; the simulator runs again with that cause, and the gap is
measured where the cause was not looked for. Check points are never looked at but here.
"""

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.background import epochs
from mlscorr.gap.evidence import table
from mlscorr.gap.folds import fold
from mlscorr.gap.measure import (
    BAND,
    REPLICAS,
    UNITS,
    Predicted,
    kind_of,
    length,
    position,
    scatter,
    signed_root,
    systematic,
    without,
)
from mlscorr.gap.rows import background
from mlscorr.gap.tails import without_tails
from mlscorr.gap.unknown import unknown_blocks
from mlscorr.gap.weighing import FREE, nuisance
from mlscorr.gap.whitening import whitener

GROUPS = 10  # of blocks of time that the jackknife leaves out one at a time
QUANTILE = 1.96


@dataclass(frozen=True)
class Gap:
    """Signed, before and after a cause is added, and 95 % of what it is when nothing is wrong."""

    before: float
    after: float
    null_band: tuple[float, float]


@dataclass(frozen=True)
class Closure:
    """The gap before and after a cause is added, where it was not looked for.

    Parameters
    ----------
    effect : str
        The label that was added; the best known one where the verdict is unknown.
    kind, unit : str
        How the gap is measured, see measure.
    before, after : float
        Signed.
    shrink : float
        1 - after^2 / before^2 with their signs; 0 where nothing was added.
    interval : (float, float)
        95 % of it, by the jackknife over groups of blocks of time.
    null_band : (float, float)
        95 % of what the gap is when nothing is wrong.
    held_out : str
        A sentence.
    labels : tuple of str
        Chosen in each fold.
    folds : (f, 2) array
        The gap in each fold alone, before and after. In the unit.
    gap : Gap
        That of the rows in which the cause was found.
    """

    effect: str
    kind: str
    unit: str
    before: float
    after: float
    shrink: float
    interval: tuple[float, float]
    null_band: tuple[float, float]
    held_out: str
    labels: tuple[str, ...]
    folds: np.ndarray
    gap: Gap


@threadpool_limits.wrap(limits=1, user_api="blas")
def close(
    rows, used, survey, signatures, found, cause, simulated, rng, impostor=False, progress=None
):
    """Closure of a cause.

    Parameters
    ----------
    rows : Rows
        All of them, check points too.
    used : (m,) bool array
        False for those of check points.
    survey : Survey
        With what the simulator believes.
    signatures : tuple of Signature
        Of all rows.
    found : Found
        Of the used rows.
    cause : Cause
        From them.
    simulated : function of a tuple of Effect
        What the simulator, run again with these too, adds to the rows' residuals: (m,).
    rng : numpy.random.Generator
    impostor : bool
        Whether the cause stands for an unknown one.
    progress : function of a number of folds, optional
    """
    kind = kind_of(cause.effect, {one.label for one in found.noise}, rows)
    folds = fold(rows, used, survey, signatures, cause, impostor, simulated, rng, progress)
    scale = _Scale.of(kind, rows, survey, signatures, found, cause)
    group = (folds.block * GROUPS) // (folds.block.max() + 1)
    group = np.unique(group, return_inverse=True)[1]
    measured = scale.compare(folds, group, rng)
    shrink, spread, unit = _shrink(measured.square), 0.0, UNITS[kind]
    if len(measured.left) > 1 and cause.effect != "none":
        several = np.array([_shrink(one) for one in measured.left])
        g = len(several)
        spread = QUANTILE * np.sqrt((g - 1) / g * ((several - several.mean()) ** 2).sum())
    gap = _gap(measured, unit)
    one = replace(folds, fold=np.where(used, 0, 1), predicted=(folds.whole,))
    return Closure(
        cause.effect,
        kind,
        unit,
        gap.before,
        gap.after,
        shrink,
        (float(shrink - spread), float(shrink + spread)),
        gap.null_band,
        folds.told,
        folds.labels,
        signed_root(measured.folds, unit),
        _gap(scale.compare(one, np.zeros_like(group), rng), unit),
    )


def _gap(measured, unit):
    before, after = (float(v) for v in signed_root(measured.square, unit))
    low, high = (float(v) for v in np.percentile(signed_root(measured.chance, unit), BAND))
    return Gap(before, after, (low, high))


@dataclass(frozen=True)
class _Measured:
    """Squares before and after (2,), the same without each group (g, 2) and in each fold (f, 2),
    and by chance (k,)."""

    square: np.ndarray
    left: np.ndarray
    folds: np.ndarray
    chance: np.ndarray


def _shrink(square):
    before, after = square
    return float(1 - after / before) if before != after else 0.0


@dataclass(frozen=True)
class _Scale:
    """What a gap is measured with."""

    kind: str
    rows: object
    observed: object
    table: object
    setting: object

    @classmethod
    def of(cls, kind, rows, survey, signatures, found, cause):
        observed = epochs(rows, background(rows, survey))
        columns = table(rows, signatures, unknown_blocks(rows, survey), observed.sigma)
        constant, _ = nuisance(observed, columns)
        observed, _ = without_tails(observed, rows, FREE * constant)
        return cls(kind, rows, observed, columns, likely_setting(found, cause.effect))

    def compare(self, folds, group, rng):
        """What each fold's own cause does to the gap of its rows: _Measured."""
        if self.kind == "systematic":
            return self._systematic(folds, group, rng)
        before, after, chance, place = self._terms(folds, rng)
        both = np.column_stack([before, after])
        mean, parts = both.mean(axis=0), []
        for number in (group[place], folds.of_rows[place]):
            count = np.bincount(number)
            sums = np.array([np.bincount(number, v) for v in both.T]).T
            parts.append((count[:, None], sums))
        (count, sums), (_, in_fold) = parts
        left = (both.sum(axis=0) - sums) / np.maximum(len(both) - count, 1)
        told = mean, left, in_fold / np.maximum(parts[1][0], 1), chance.mean(axis=0)
        if self.kind == "returns":  # a mean of shares, not of squares
            told = tuple(np.sign(v) * v**2 for v in told)
        return _Measured(*told)

    def _systematic(self, folds, group, rng):
        """What the cause of each fold leaves of its rows and the check points, by themselves."""
        drawn = whitener(self.observed, self.setting).draw(rng, REPLICAS)
        in_fold = np.array([self._fold(folds, f, drawn) for f in range(len(folds.predicted))])
        usual = in_fold[:, 2:].mean(axis=1)[:, None]
        in_fold -= usual
        left = []
        for g in range(group.max() + 1):
            keep = group[self.observed.row] != g
            several = [self._fold(folds, f, None, keep) for f in range(len(folds.predicted))]
            left.append((np.array(several) - usual).sum(axis=0))
        scale, total = length(self.observed, self.setting), in_fold.sum(axis=0)
        return _Measured(
            scale * total[:2],
            scale * np.array(left),
            scale * len(in_fold) * in_fold[:, :2],
            scale * total[2:],
        )

    def _fold(self, folds, one, drawn, keep=True):
        """What can be explained of one fold's rows before and after, and by chance: (2 + k,)."""
        observed, shift = self.observed, folds.predicted[one].shift
        both = np.column_stack([self.rows.residual, self.rows.residual - shift])
        both = observed.columns(both)
        both = both if drawn is None else np.hstack([both, drawn])
        mine = keep & folds.judge(one)[observed.row]
        if not mine.any():
            return np.zeros(both.shape[1])
        return systematic(without(observed, mine), self.setting, self.table, both[mine])

    def _terms(self, folds, rng):
        """Terms before, after (q,) and by chance (q, k), whose mean is the gap; their rows (q,)."""
        rows, nothing = self.rows, Predicted.nothing(self.rows)
        if self.kind == "position":
            residual = self.observed.columns(rows.residual[:, None])
            believed = whitener(self.observed, nothing.setting)
            chance = position(self.observed, nothing, believed.draw(rng, REPLICAS))
            mine = folds.of_rows[self.observed.row]
            each = [position(self.observed, p, residual)[:, 0] for p in folds.predicted]
            kept = self.observed.second
            return (
                position(self.observed, nothing, residual)[kept, 0],
                np.choose(mine, each)[kept],
                chance[kept],
                self.observed.row[kept],
            )
        name = "roughness" if self.kind == "scatter" else "return_rate"
        mine = rows.channel == name
        drawn = np.sqrt(rows.noise)[:, None] * rng.standard_normal((len(rows), REPLICAS))
        values = np.column_stack([rows.residual, drawn])
        if self.kind == "scatter":
            held = Predicted(nothing.shift, self._held(folds, "growth"), nothing.extra)
            before = scatter(rows, nothing, values)
            after = scatter(rows, held, values[:, :1])
        else:
            before, after = values, (rows.residual - self._held(folds, "shift"))[:, None]
        return before[mine, 0], after[mine, 0], before[mine, 1:], np.flatnonzero(mine)

    def _held(self, folds, name):
        """What each row's own fold predicts (m,)."""
        several = np.array([getattr(one, name) for one in folds.predicted])
        return several[folds.of_rows, np.arange(len(folds.fold))]


def likely_setting(found, label):
    """The Setting of V that is most probable when a label acts."""
    first = label.split("+")[0]
    score = found.evidence.none[:, 0]
    if first in found.table.labels:
        score = found.evidence.by_setting[:, found.table.of(first)].max(axis=1)
    return found.evidence.settings[int(np.argmax(score))]
