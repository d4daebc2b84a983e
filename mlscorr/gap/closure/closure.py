"""Reduction of the gap with the cause in the simulator, on data not used to find it.

The effect is chosen from all blocks of time; its size is estimated without each fifth of them. The
simulator runs again with it, and the gap is measured in the held-out blocks, also as errors over
their simulated sigma, which is one for a correct simulator. Check points are used only here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure._systematic import Squares, SystematicGap, share_gone
from mlscorr.gap.closure.folds import Folds, FoundCause, Simulated, make_folds, predict_whole
from mlscorr.gap.evidence import (
    AXES,
    UNITS,
    ColumnTable,
    ErrorModel,
    Observations,
    Predicted,
    column_table,
    gap_kind,
    position_terms,
    scatter_terms,
    signed_root,
    simulated_variance,
    steady_columns,
    unknown_blocks,
    window_growth,
    without_tails,
)
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.residuals import Rows, background


@dataclass(frozen=True)
class Gap:
    """Signed gap before and after a cause is added, and 95 % interval of the gap by chance."""

    before: float
    after: float
    null_band: tuple[float, float]


@dataclass(frozen=True)
class Closure:
    """Gap before and after a cause is added, in data not used to estimate its size.

    Parameters
    ----------
    effect : str
        Added label; the best known one if the verdict is unknown.
    probability : float
        Of that label.
    kind, unit : str
        Measure of the gap; see measure.
    before, after : float
        Signed.
    shrink : float
        1 - after^2 / before^2, at most 1; 0 if nothing was added. If the gap grew, before^2 /
        after^2 - 1, at least -1.
    interval : (float, float)
        95 % of it, within [-1, 1].
    null_band : (float, float)
        95 % interval of the gap if nothing is wrong.
    held_out : str
        A sentence.
    is_held_out : bool
        True if the size was estimated without the rows that test it.
    folds : (f, 2) array
        The gap in each fold alone, before and after. In the unit.
    gap : Gap
        Gap of the rows in which the cause was found.
    over_sigma : OverSigma
        Errors over their simulated sigma.
    """

    effect: str
    probability: float
    kind: str
    unit: str
    before: float
    after: float
    shrink: float
    interval: tuple[float, float]
    null_band: tuple[float, float]
    held_out: str
    is_held_out: bool
    folds: np.ndarray
    gap: Gap
    over_sigma: OverSigma

    @property
    def is_within_noise(self) -> bool:
        """True if chance alone explains the gap before, so that there is nothing to close."""
        low, high = self.null_band
        is_lost = self.kind == "returns" and self.before < low  # below it fewer pulses return
        return self.effect != "none" and self.before <= high and not is_lost


@threadpool_limits.wrap(limits=1, user_api="blas")
def close_gap(
    case: FoundCause,
    simulated: Simulated,
    rng: np.random.Generator,
    progress: Callable[[int], None] | None = None,
) -> Closure:
    """Measure the closure of a cause.

    Parameters
    ----------
    case : FoundCause
    simulated : function of a tuple of Effect, or (m,) array
        Change of the rows' residuals (m,) in a second run with these effects, too; or the change in
        the next run, whatever was changed in it.
    rng : numpy.random.Generator
    progress : function of a number of steps, one in all, optional
    """
    rows = case.rows
    used = case.used
    cause = case.cause
    kind = gap_kind(cause.effect, case.evidence.noisy, rows)
    unit = UNITS[kind]
    whole = predict_whole(case, simulated)  # takes most memory, so before the table of all rows
    probability = 0.0
    if callable(simulated):
        probability = cause.probability
    ruler = _Ruler.of(kind, case, probability)
    folds = make_folds(case, whole, ruler.observations, ruler.model, simulated, rng, progress)
    compared = ruler.compare(folds, rng)
    fitted = replace(folds, fold=np.where(used, 0, -1), predicted=(whole,))
    gap = _gap(compared, unit)
    if cause.effect == "none":
        gap = replace(gap, after=gap.before)
        compared = replace(compared, gone=0.0, interval=(0.0, 0.0))
    in_sample = _gap(ruler.compare(fitted, rng, used), unit)
    return Closure(
        cause.effect,
        float(cause.probability),
        kind,
        unit,
        gap.before,
        gap.after,
        compared.gone,
        compared.interval,
        gap.null_band,
        folds.held_out,
        folds.is_held_out,
        signed_root(compared.folds, unit),
        in_sample,
        errors_over_sigma(rows, ruler.observations, folds, rng),
    )


def _gap(squares, unit):
    """Gap in a unit, from Squares."""
    before, after = (float(v) for v in signed_root(squares.square, unit))
    band = np.percentile(signed_root(squares.chance, unit), INFERENCE.band)
    return Gap(before, after, tuple(float(v) for v in band))


@dataclass(frozen=True)
class _Ruler:
    """Measuring method of a gap."""

    kind: str
    rows: Rows
    used: np.ndarray
    observations: Observations
    table: ColumnTable | None  # of innovations, for a systematic gap
    model: ErrorModel
    probability: float

    @classmethod
    def of(cls, kind, case, probability):
        rows = case.rows
        noise = case.cause.model
        observations = Observations.of(rows, background(rows, case.survey))
        unknown = unknown_blocks(rows, case.survey)
        table = column_table(rows, case.signatures, unknown, observations.sigma)
        observations = observations[~case.undecided[observations.row]]
        observations, _ = without_tails(observations, rows, steady_columns(observations, table))
        model = case.evidence.likely_model(case.cause.effect)
        scale = model.scale if noise.scale == 1.0 else noise.scale
        model = replace(model, scale=scale, fixes=noise.fixes, windows=noise.windows)
        white = None
        if kind == "systematic":
            table = replace(table, columns=observations.columns(table.columns))  # each is large
            innovations = observations.whitener(model).innovations(table.columns)[0]
            white = replace(table, columns=innovations)
        return cls(kind, rows, case.used, observations, white, model, probability)

    def compare(self, folds, rng, among=None):
        """Compare the gap of some rows (m,) before and after with the sizes from other folds:
        Squares.
        """
        if among is None:
            among = np.ones(len(self.rows), bool)
        if self.kind == "systematic":
            given = self.observations, self.model, self.table, self.rows.residual
            return SystematicGap.of(*given, folds, self.used, among).measure(rng, self.probability)
        *terms, place = self._terms(folds, rng)
        is_share = self.kind == "returns"  # a mean of shares, not of squares
        # lost, or gained
        if is_share and terms[0][among[place]].mean() < 0:
            sign = -1.0
        else:
            sign = 1.0
        before, after, chance, usual = (sign * values[among[place]] for values in terms)
        place = place[among[place]]
        both = np.column_stack([before, after])
        of_fold = folds.of_rows[place]
        folded = np.array([np.bincount(of_fold, v, len(folds.predicted)) for v in both.T]).T
        folded /= np.maximum(np.bincount(of_fold, minlength=len(folds.predicted)), 1)[:, None]
        squares = both.mean(axis=0), folded, chance.mean(axis=0)
        usual = np.percentile(usual.mean(axis=0), INFERENCE.band[0])
        left = _left_out(both, folds.block[place])
        if is_share:
            *squares, usual, left = (np.sign(v) * v**2 for v in (*squares, usual, left))
        gone = share_gone(*squares[0], usual)
        return Squares(*(sign * v for v in squares), gone, _jackknife(left, gone, usual))

    def _terms(self, folds, rng):
        """Terms before, after (q,) and by chance (q, k), for a simulator that is correct
        without and with the cause; their means are gaps; and their rows (q,).
        """
        rows = self.rows
        nothing = Predicted.nothing(self.rows)
        replicas = INFERENCE.replicas
        if self.kind == "position":
            observations = self.observations
            residual = observations.columns(rows.residual[:, None])
            chance, usual = (self._replicas(p, rng) for p in (nothing, folds.whole))
            each = [position_terms(observations, p, residual)[:, 0] for p in folds.predicted]
            after = np.choose(folds.of_rows[observations.row], each)
            before = position_terms(observations, nothing, residual)[:, 0]
            keep = observations.second
            terms = before, after, chance, usual, observations.row
            return tuple(values[keep] for values in terms)
        channel = {"scatter": "roughness", "returns": "return_rate"}[self.kind]
        of_kind = rows.channel == channel
        drawn = np.sqrt(rows.noise)[:, None] * rng.standard_normal((len(rows), replicas))
        before = np.column_stack([rows.residual, drawn])
        if self.kind == "scatter":
            out_of_sample = Predicted(nothing.shift, folds.out_of_fold("growth"), nothing.extra)
            grown = np.column_stack(
                [rows.residual, np.log1p(out_of_sample.growth)[:, None] + drawn]
            )
            of_kind &= ~_outliers(
                rows.residual, np.log1p(out_of_sample.growth), rows.noise, of_kind
            )
            before = scatter_terms(rows, nothing, before)
            after = scatter_terms(rows, out_of_sample, grown)
        else:
            after = np.column_stack([rows.residual - folds.out_of_fold("shift"), drawn])
        before = before[of_kind]
        after = after[of_kind]
        place = np.flatnonzero(of_kind)
        return before[:, 0], after[:, 0], before[:, 1:], after[:, 1:], place

    def _replicas(self, predicted, rng):
        """Position terms (n, k) of a simulator that is correct with the prediction."""
        o = self.observations
        whitener = o.whitener(predicted.model, predicted.extra[o.row] * o.half)
        drawn = whitener.draw(rng, INFERENCE.replicas) + o.columns(predicted.shift[:, None])
        return position_terms(o, predicted, drawn)


def _outliers(residual, expected, noise, among):
    """Flag (m,) of rows that are odd with and without the cause: curbs and crowns are rougher
    than planes, and a few of them would dominate a mean of squares.
    """
    score = np.minimum(np.abs(residual), np.abs(residual - expected)) / np.sqrt(noise)
    if among.any():
        limit = np.quantile(score[among], 1.0 - INFERENCE.tail_rows)
    else:
        limit = 0.0
    return among & (score > max(limit, INFERENCE.tail))


def _left_out(both, block):
    """Means (g, 2) of terms (q, 2) with groups of blocks (q,) omitted in turn."""
    groups = 2 * SETTINGS.folds
    group = np.unique((block * groups) // (block.max() + 1), return_inverse=True)[1]
    count = np.bincount(group)
    sums = np.array([np.bincount(group, v) for v in both.T]).T
    return (both.sum(axis=0) - sums) / np.maximum(len(both) - count, 1)[:, None]


def _jackknife(left, share, usual):
    """95 % interval of the removed share, from its values without each of g groups (g, 2)."""
    g = len(left)
    each = np.array([share_gone(*pair, usual) for pair in left])
    spread = INFERENCE.quantile * np.sqrt((g - 1) / g * ((each - each.mean()) ** 2).sum())
    return max(-1.0, share - spread), min(1.0, share + spread)


@dataclass(frozen=True)
class OverSigma:
    """RMS of errors over their simulated sigma, by axis, before and after a cause is added.

    Parameters
    ----------
    axes : tuple of str
        E, N, H; those of the rows. If the cause is a POS that is worse in intervals, only within
        these.
    before, after : tuple of float
    largest : tuple of float
        97.5 % quantile for surveys without other errors.
    """

    axes: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    largest: tuple[float, ...]

    @property
    def beyond(self) -> tuple[str, ...]:
        """Axes whose errors after it exceed chance, and 1.96 sigma."""
        pairs = zip(self.axes, self.after, self.largest, strict=True)
        usual = INFERENCE.quantile
        return tuple(axis for axis, after, chance in pairs if after > max(chance, usual))


def errors_over_sigma(
    rows: Rows, observations: Observations, folds: Folds, rng: np.random.Generator
) -> OverSigma:
    """Errors over sigma of the rows along a map axis, with sizes estimated without them.

    Planes of two passes are excluded, because their unknown position outweighs all differences
    between passes.

    Parameters
    ----------
    rows : Rows
    observations : Observations
        Of these.
    folds : Folds
    rng : numpy.random.Generator
        Draws replicas.
    """
    o = observations
    after = folds.whole
    residual = rows.residual[:, None]
    shift = folds.out_of_fold("shift")[:, None]
    nothing = Predicted.nothing(rows)
    scaled = [
        o.columns(values) / _sigma(o, predicted)[:, None]
        for values, predicted in ((residual, nothing), (residual - shift, after))
    ]
    scaled.append(o.whitener(after.model).draw(rng, INFERENCE.replicas) / _sigma(o, after)[:, None])
    axis = rows.covariates["axis"][o.row]
    inside = window_growth(after.model.windows, o.errors.gps_time)[:, 0] > 0
    here = ~rows.two_times[o.row] & (inside | (not after.model.windows))
    parts = [(name, here & (axis == number)) for number, name in enumerate(AXES)]
    parts = [(name, part) for name, part in parts if part.any()]
    values = [[np.sqrt((v[part] ** 2).mean(axis=0)) for v in scaled] for _, part in parts]
    return OverSigma(
        tuple(name for name, _ in parts),
        tuple(float(before[0]) for before, _, _ in values),
        tuple(float(after[0]) for _, after, _ in values),
        tuple(float(np.percentile(v, INFERENCE.band[1])) for *_, v in values),
    )


def _sigma(observations, predicted):
    """Simulated sigma (n,) of observations. Units: m."""
    return np.sqrt(simulated_variance(observations, predicted.model, predicted.extra))
