"""How far the gap shrinks, on data not used to find the cause, once the simulator has it.

The survey is cut into blocks of time. For each fold of blocks the whole diagnosis, the choice of
the label included, is done on the others; the simulator runs again with that cause, and the gap is
measured where the cause was not looked for. Check points are never looked at but here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.close.folds import Folds, Simulated, make_folds
from mlscorr.gap.close.settings import SETTINGS
from mlscorr.gap.infer.causes import Cause
from mlscorr.gap.infer.error_models import ErrorModel
from mlscorr.gap.infer.evidence import ColumnTable, column_table, nuisance_columns
from mlscorr.gap.infer.labels import LabelEvidence
from mlscorr.gap.infer.measure import (
    UNITS,
    Predicted,
    gap_kind,
    position_terms,
    scatter_terms,
    signed_root,
    systematic_square,
    unit_square,
)
from mlscorr.gap.infer.observations import Observations
from mlscorr.gap.infer.settings import SETTINGS as INFERENCE
from mlscorr.gap.infer.tails import without_tails
from mlscorr.gap.infer.unknown import unknown_blocks
from mlscorr.gap.observe.rows import Rows, background
from mlscorr.gap.signatures.signatures import Signature
from mlscorr.survey import Survey


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
def close_gap(
    rows: Rows,
    used: np.ndarray,
    survey: Survey,
    signatures: Sequence[Signature],
    evidence: LabelEvidence,
    cause: Cause,
    simulated: Simulated,
    rng: np.random.Generator,
    impostor: bool = False,
    progress: Callable[[int], None] | None = None,
) -> Closure:
    """Closure of a cause.

    Parameters
    ----------
    rows : Rows
        All of them, check points too.
    used : (m,) bool array
        False for those of check points.
    survey : Survey
        With what the simulator believes.
    signatures : sequence of Signature
        Of all rows.
    evidence : LabelEvidence
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
    kind = gap_kind(cause.effect, evidence.noisy, rows)
    unit = UNITS[kind]
    folds = make_folds(rows, used, survey, signatures, cause, impostor, simulated, rng, progress)
    ruler = _Ruler.of(kind, rows, survey, signatures, evidence, cause)
    group = (folds.block * SETTINGS.groups) // (folds.block.max() + 1)
    group = np.unique(group, return_inverse=True)[1]
    measured = ruler.compare(folds, group, rng)
    shrink, spread = _shrink(measured.square), 0.0
    if len(measured.left) > 1 and cause.effect != "none":
        each, g = np.array([_shrink(square) for square in measured.left]), len(measured.left)
        spread = INFERENCE.quantile * np.sqrt((g - 1) / g * ((each - each.mean()) ** 2).sum())
    gap = measured.gap(unit)
    whole = replace(folds, fold=np.where(used, 0, 1), predicted=(folds.whole,))
    return Closure(
        cause.effect,
        kind,
        unit,
        gap.before,
        gap.after,
        shrink,
        (float(shrink - spread), float(shrink + spread)),
        gap.null_band,
        folds.held_out,
        folds.labels,
        signed_root(measured.folds, unit),
        ruler.compare(whole, np.zeros_like(group), rng).gap(unit),
    )


@dataclass(frozen=True)
class _Measured:
    """Squares before and after (2,), the same without each group (g, 2) and in each fold (f, 2),
    and by chance (k,).
    """

    square: np.ndarray
    left: np.ndarray
    folds: np.ndarray
    chance: np.ndarray

    def gap(self, unit):
        before, after = (float(v) for v in signed_root(self.square, unit))
        band = np.percentile(signed_root(self.chance, unit), INFERENCE.band)
        return Gap(before, after, tuple(float(v) for v in band))


def _shrink(square):
    before, after = square
    return float(1 - after / before) if before != after else 0.0


@dataclass(frozen=True)
class _Ruler:
    """What a gap is measured with."""

    kind: str
    rows: Rows
    observations: Observations
    table: ColumnTable
    model: ErrorModel

    @classmethod
    def of(cls, kind, rows, survey, signatures, evidence, cause):
        observations = Observations.of(rows, background(rows, survey))
        unknown = unknown_blocks(rows, survey)
        table = column_table(rows, signatures, unknown, observations.sigma)
        steady, _ = nuisance_columns(observations, table)
        observations, _ = without_tails(observations, rows, steady)
        return cls(kind, rows, observations, table, evidence.likely_model(cause.effect))

    def compare(self, folds, group, rng):
        """What each fold's own cause does to the gap of its rows: _Measured."""
        if self.kind == "systematic":
            return self._systematic(folds, group, rng)
        before, after, chance, place = self._terms(folds, rng)
        both = np.column_stack([before, after])
        (count, sums), (in_fold, fold_sums) = (
            (np.bincount(number)[:, None], np.array([np.bincount(number, v) for v in both.T]).T)
            for number in (group[place], folds.of_rows[place])
        )
        left = (both.sum(axis=0) - sums) / np.maximum(len(both) - count, 1)
        folded = fold_sums / np.maximum(in_fold, 1)
        squares = both.mean(axis=0), left, folded, chance.mean(axis=0)
        if self.kind == "returns":  # a mean of shares, not of squares
            squares = (np.sign(v) * v**2 for v in squares)
        return _Measured(*squares)

    def _systematic(self, folds, group, rng):
        """What the cause of each fold leaves of its rows and the check points, by themselves."""
        drawn = self.observations.whitener(self.model).draw(rng, INFERENCE.replicas)
        numbers = range(len(folds.predicted))
        in_fold = np.array([self._fold(folds, number, drawn) for number in numbers])
        usual = in_fold[:, 2:].mean(axis=1)[:, None]
        in_fold -= usual
        left = []
        for g in range(group.max() + 1):
            keep = group[self.observations.row] != g
            squares = np.array([self._fold(folds, number, None, keep) for number in numbers])
            left.append((squares - usual).sum(axis=0))
        scale, total = unit_square(self.observations, self.model), in_fold.sum(axis=0)
        return _Measured(
            scale * total[:2],
            scale * np.array(left),
            scale * len(in_fold) * in_fold[:, :2],
            scale * total[2:],
        )

    def _fold(self, folds: Folds, number, drawn, keep=True):
        """What can be explained of one fold's rows before and after, and by chance: (2 + k,)."""
        residual, shift = self.rows.residual, folds.predicted[number].shift
        both = self.observations.columns(np.column_stack([residual, residual - shift]))
        both = both if drawn is None else np.hstack([both, drawn])
        judging = keep & folds.judges(number)[self.observations.row]
        if not judging.any():
            return np.zeros(both.shape[1])
        part = self.observations[judging]
        return systematic_square(part, self.model, self.table, both[judging])

    def _terms(self, folds, rng):
        """Terms before, after (q,) and by chance (q, k), whose mean is the gap; their rows (q,)."""
        rows, nothing, replicas = self.rows, Predicted.nothing(self.rows), INFERENCE.replicas
        if self.kind == "position":
            observations = self.observations
            residual = observations.columns(rows.residual[:, None])
            drawn = observations.whitener(nothing.model).draw(rng, replicas)
            chance = position_terms(observations, nothing, drawn)
            each = [position_terms(observations, p, residual)[:, 0] for p in folds.predicted]
            after = np.choose(folds.of_rows[observations.row], each)
            before, keep = (
                position_terms(observations, nothing, residual)[:, 0],
                observations.second,
            )
            return before[keep], after[keep], chance[keep], observations.row[keep]
        of_kind = rows.channel == ("roughness" if self.kind == "scatter" else "return_rate")
        drawn = np.sqrt(rows.noise)[:, None] * rng.standard_normal((len(rows), replicas))
        values = np.column_stack([rows.residual, drawn])
        if self.kind == "scatter":
            held = Predicted(nothing.shift, self._held(folds, "growth"), nothing.extra)
            before = scatter_terms(rows, nothing, values)
            after = scatter_terms(rows, held, values[:, :1])
        else:
            before, after = values, (rows.residual - self._held(folds, "shift"))[:, None]
        before, place = before[of_kind], np.flatnonzero(of_kind)
        return before[:, 0], after[of_kind, 0], before[:, 1:], place

    def _held(self, folds, name):
        """What each row's own fold predicts (m,)."""
        each = np.array([getattr(predicted, name) for predicted in folds.predicted])
        return each[folds.of_rows, np.arange(len(folds.fold))]
