"""Reduction of a shift: effect on squared innovations of sizes estimated without them.

The remaining gap is due to the error of the size or, if that is improbably large, it is the part of
the rest that the cause's own columns still explain. The part explained by any other block, known or
unknown, counts with the probability that the cause is not complete: the evidence has already
weighed it, and drift with another shape than in V may mimic it. The gap before is the sum of the
removed and the remaining part, so no share exceeds one. The remaining gap of each single effect is
measured in the same way, in the rows in which it was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.closure.folds import CrossFit, Folds
from mlscorr.gap.evidence import (
    SETTINGS,
    ColumnTable,
    ErrorModel,
    Explanations,
    Inference,
    Observations,
    cause_of,
    signed_root,
)
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Signature


def share_gone(before: float, after: float, chance: float = -np.inf) -> float:
    """Removed share of a signed square, within [-1, 1]; negative if the square grew.

    Parameters
    ----------
    before, after : float
        Negative if the simulated errors exceed the real ones.
    chance : float
        2.5 % quantile of the square after, for a correct simulator: below it the simulator has too
        much of the cause, which is also a gap.

    >>> share_gone(100.0, 1.0), share_gone(100.0, -50.0, -60.0), share_gone(50.0, -100.0, -60.0)
    (0.99, 1.0, -0.5)
    """
    before = max(before, 0.0)
    after = -after if after < chance else max(after, 0.0)
    largest = max(before, after)
    if largest > 0:
        return float((before - after) / largest)
    return 0.0


def unit_square(observations: Observations, model: ErrorModel) -> float:
    """Squared length for a sum of squares of one, averaged over all rows. Units: m^2.

    The sigma is that of the median innovation; for planes of two passes that of the second view,
    because the first one only defines the plane.

    Parameters
    ----------
    observations : Observations
    model : ErrorModel
        Of V.
    """
    _, sigma = observations.whitener(model).innovations(np.zeros((len(observations), 1)))
    second = observations.second
    return float(np.median(sigma[second]) ** 2 / second.sum())


@dataclass(frozen=True)
class Squares:
    """Squares before and after (2,), in each fold (f, 2), and before by chance (k,), in m^2 or
    in the squared unit of the gap; removed share, and its 95 % interval.
    """

    square: np.ndarray
    folds: np.ndarray
    chance: np.ndarray
    gone: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class SystematicGap:
    """Innovations of observations, of their predictions, and of possible explanations.

    Parameters
    ----------
    residual : (n,) array
    predicted : (n,) array
        From the size estimated without each observation.
    own : (n, p) array
        Of the cause's columns.
    explanations : Explanations
    cross : CrossFit
    learned : (n,) bool array
        True for observations used to estimate sizes.
    fold : (n,) int array
    unit : float
        Square of the length of a sum of squares of one. Units: m^2.
    """

    residual: np.ndarray
    predicted: np.ndarray
    own: np.ndarray
    explanations: Explanations
    cross: CrossFit
    learned: np.ndarray
    fold: np.ndarray
    unit: float

    @classmethod
    def of(
        cls,
        observations: Observations,
        model: ErrorModel,
        table: ColumnTable,
        residual: np.ndarray,
        folds: Folds,
        used: np.ndarray,
        among: np.ndarray,
    ) -> SystematicGap:
        """Make the gap of some observations.

        Parameters
        ----------
        observations : Observations
        model : ErrorModel
        table : ColumnTable
            Table of innovations of each observation.
        residual : (m,) array
        folds : Folds
        used, among : (m,) bool array
            Rows used to estimate sizes; rows to evaluate.
        """
        keep = among[observations.row]
        row = observations.row[keep]
        shifts = np.array([predicted.shift for predicted in folds.predicted]).T
        f = shifts.shape[1]
        scale = np.abs(folds.columns).max(axis=0, initial=0.0)
        scale[scale == 0] = 1.0
        parts = observations.columns(np.column_stack([residual, shifts, folds.columns / scale]))
        white = observations.whitener(model).innovations(parts)[0][keep]
        u, each, own = np.split(white, [1, 1 + f], axis=1)
        fold = folds.of_rows[row]
        learned = used[row]
        judged = each[np.arange(len(row)), fold]
        predicted = np.where(folds.fold[row] < 0, each.mean(axis=1), judged)
        cross = CrossFit(own[learned], fold[learned], f)
        unit = unit_square(observations, model)
        explanations = Explanations.of(table, table.columns[keep])
        return cls(u[:, 0], predicted, own, explanations, cross, learned, fold, unit)

    def measure(self, rng: np.random.Generator, probability: float = 0.0) -> Squares:
        """Measure the gap before and after.

        Parameters
        ----------
        rng : numpy.random.Generator
            Draws replicas.
        probability : float
            Probability of the cause alone.
        """
        rest = self.residual - self.predicted
        tails = rest / np.sqrt(np.mean(rest**2))
        drawn = rng.choice(tails, (len(rest), SETTINGS.replicas))
        chance = self.explanations.largest(drawn)[0]
        usual = chance.mean()
        limit = np.percentile(chance, SETTINGS.band[1])
        (largest,), (block,) = self.explanations.largest(rest[:, None])
        chance = self.unit * (chance - usual)
        if not self.predicted.any():  # a signed gap, unchanged
            square = np.repeat(self.unit * (largest - usual), 2)
            return Squares(square, square[None], chance, 0.0, (0.0, 0.0))
        gone, own, off = self._own(drawn)
        stays = self._explained_by_own(rest[:, None])[1][:, 0]
        if largest > limit:
            other = max(float(largest - usual), own)
        else:
            other = own
        left = own + (1.0 - probability) * (other - own)
        if left > 2 * own:
            stays = self.explanations.fit(block, rest)
        before = max(gone + left, 0.0)
        interval = self._interval(gone, own, other, off, probability)
        square = self.unit * np.array([before, left])
        return Squares(square, self._folds(stays, left), chance, share_gone(*square), interval)

    def _interval(self, gone, own, other, off, probability):
        """95 % interval of the removed share: with others, unless they are improbable, and
        without.
        """
        low, high = np.percentile(off, SETTINGS.band)
        largest = share_gone(max(gone + own, 0.0), own)
        if 1.0 - probability < 0.5 * (1.0 - SETTINGS.confidence):
            other = own
        wide = SETTINGS.quantile * 2 * np.sqrt(other - own) / max(gone + other, 1.0)
        smallest = share_gone(max(gone + other, 0.0), other) - wide
        low, high = np.clip([smallest + min(low, 0.0), largest + max(high, 0.0)], -1, 1)
        return float(low), float(high)

    def _own(self, drawn):
        """Removed squares, those still explained by own columns, and share errors in replicas.

        The error of the size leaves the average of the replicas, or more, if the columns explain
        more of the rest than in nearly all replicas.
        """
        rest = self.residual - self.predicted
        signal = self.own @ self.cross.sizes(self.residual[self.learned, None])[-1]
        replica = signal + drawn
        sizes = self.cross.sizes(replica[self.learned])
        predicted = np.einsum("np,npk->nk", self.own, sizes[self.fold])
        wrong = ((signal - predicted) ** 2).sum(axis=0)
        gone = (replica**2 - (replica - predicted) ** 2).sum(axis=0)
        stated = [share_gone(max(g + wrong.mean(), 0.0), wrong.mean()) for g in gone]
        off = 1.0 - wrong / max((signal**2).sum(), 1e-300) - np.array(stated)
        usual = np.percentile(self._explained_by_own(replica - predicted)[0], SETTINGS.band[1])
        explained = self._explained_by_own(rest[:, None])[0][0]
        left = wrong.mean()
        if explained > usual:
            left = max(left, explained - self.own.shape[1])
        return (self.residual**2 - rest**2).sum(), float(left), off

    def _explained_by_own(self, rest):
        """Squares (k,) of columns (n, k) explained by the cause's columns, and their fits."""
        normal = self.own.T @ self.own + np.eye(self.own.shape[1]) / SETTINGS.free_sigma**2
        fit = self.own @ np.linalg.solve(normal, self.own.T @ rest)
        return (rest**2 - (rest - fit) ** 2).sum(axis=0), fit

    def _folds(self, stays, left):
        """Squares (f, 2) in each fold, before and after, on the scale of the whole."""
        rest = self.residual - self.predicted
        number = self.fold.max() + 1
        gone = self.residual**2 - rest**2
        share = stays**2 / max((stays**2).sum(), 1e-300) * left
        both = [np.bincount(self.fold, v, number) for v in (gone + share, share)]
        return self.unit * number * np.array(both).T


@dataclass(frozen=True)
class LoneEffect:
    """Systematic gap with one effect in the simulator, in the rows in which it was found.

    Parameters
    ----------
    effect : str
    probability : float
        Probability that it is the cause.
    before, after : float
        Signed. Units: mm.
    """

    effect: str
    probability: float
    before: float
    after: float


@threadpool_limits.wrap(limits=1, user_api="blas")
def lone_effects(
    rows: Rows, signatures: Sequence[Signature], inference: Inference, rng: np.random.Generator
) -> tuple[LoneEffect, ...]:
    """Measure the gap with each effect that shifts rows, sorted by increasing remaining gap.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    inference : Inference
        Of these.
    rng : numpy.random.Generator
        Draws replicas.
    """
    evidence = inference.evidence
    o = evidence.observations
    table = evidence.table
    names = [name for name in table.effects if name not in evidence.noisy]
    chance = inference.probability
    causes = [cause_of(rows, signatures, evidence, name, chance.get(name, 0.0)) for name in names]
    model = evidence.likely_model(inference.verdict.label)
    shifts = np.array([np.zeros(len(rows)), *(cause.shift for cause in causes)]).T
    both = np.hstack([rows.residual[:, None] - shifts, table.columns])
    white = o.whitener(model).innovations(o.columns(both))[0]
    rest = white[:, : len(names) + 1]
    columns = white[:, len(names) + 1 :]
    explanations = Explanations.of(table, columns)
    usual = explanations.largest(rng.standard_normal((len(o), SETTINGS.replicas)))[0].mean()
    square = unit_square(o, model) * (explanations.largest(rest)[0] - usual)
    before, *after = signed_root(square).tolist()
    effects = [
        LoneEffect(name, float(cause.probability), before, left)
        for name, cause, left in zip(names, causes, after, strict=True)
    ]
    return tuple(sorted(effects, key=lambda each: each.after))
