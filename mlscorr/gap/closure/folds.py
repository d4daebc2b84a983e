"""Cross-validation of a cause: sizes estimated without some blocks of time, tested on these.

The effect, its probability and the time of an event are determined from all blocks, because a
choice in each part of the data often differs. Sizes are estimated without each fifth of the blocks,
from innovations, which are independent under V, including drift.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from mlscorr.effects import Effect
from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.evidence import (
    Cause,
    ErrorModel,
    Inference,
    LabelEvidence,
    Observations,
    Predicted,
    cause_of,
    weigh_labels,
)
from mlscorr.gap.residuals import Rows, background
from mlscorr.gap.signatures import Bench, Signature, expected, select, signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class FoundCause:
    """Cause, and the data in which it was found.

    Parameters
    ----------
    rows : Rows
        All rows, including check points.
    used : (m,) bool array
        False for those of check points.
    survey : Survey
        With the simulator's assumptions.
    signatures : sequence of Signature
        Of all rows.
    evidence : LabelEvidence
        Of the used rows.
    cause : Cause
        From them.
    """

    rows: Rows
    used: np.ndarray
    survey: Survey
    signatures: Sequence[Signature]
    evidence: LabelEvidence
    cause: Cause

    @property
    def shifting(self) -> list[tuple[Signature, np.ndarray]]:
        """Parts of the cause that are not noise, with their estimates."""
        return [pair for pair in self.cause.parts if pair[0].name not in self.evidence.noisy]

    @property
    def undecided(self) -> np.ndarray:
        """Rows (m,) bool of check points at the time of a jump, between the adjacent used rows,
        so that their side of the jump is unknown.
        """
        rows = self.rows
        undecided = np.zeros(len(self.rows), bool)
        known = rows.gps_time[self.used & rows.metric], rows.gps_time_2[self.used & rows.two_times]
        known = np.sort(np.concatenate([[-np.inf], *known, [np.inf]]))
        for part, _ in self.shifting:
            if part.kind.moment() and "width" not in part.fixed:
                after = np.searchsorted(known, rows.reference.start + part.fixed["time"])
                between = (rows.gps_time > known[after - 1]) & (rows.gps_time < known[after])
                undecided |= between & ~self.used
        return undecided

    def columns(self) -> np.ndarray:
        """Effect of these parts on all rows (m, p), by their parameters."""
        # nothing is drawn
        bench = Bench(self.rows, self.survey)
        rng = np.random.default_rng(0)
        parts = [signature(bench, p.kind, p.fixed, rng).jacobian for p, _ in self.shifting]
        return np.hstack([np.zeros((len(self.rows), 0)), *parts])


Simulated = Callable[[tuple[Effect, ...]], np.ndarray] | np.ndarray


@dataclass(frozen=True)
class Folds:
    """Assignment of rows to the sizes of a cause that they test.

    Parameters
    ----------
    block : (m,) int array
        Block of time, from 0.
    fold : (m,) int array
        Index of `predicted` that each row tests; -1 for check points, which test all.
    predicted : tuple of Predicted
    held_out : str
        Held-out data, in a sentence.
    whole : Predicted
        Prediction from the cause found in all used rows.
    columns : (m, p) array
        Effect of the cause's shifting parts on the rows, by their parameters.
    """

    block: np.ndarray
    fold: np.ndarray
    predicted: tuple[Predicted, ...]
    held_out: str
    whole: Predicted
    columns: np.ndarray

    @property
    def is_held_out(self) -> bool:
        """True if rows test a size that was estimated without them."""
        return len(self.predicted) > 1

    @property
    def of_rows(self) -> np.ndarray:
        """Index of `predicted` (m,) that is compared with each row, if one is required."""
        return np.clip(self.fold, 0, len(self.predicted) - 1)

    def out_of_fold(self, name: str) -> np.ndarray:
        """Return a column (m,) of Predicted by name, for each row from its own fold."""
        each = np.array([getattr(predicted, name) for predicted in self.predicted])
        return each[self.of_rows, np.arange(len(self.fold))]


def predict_whole(case: FoundCause, simulated: Simulated) -> Predicted:
    """Predict the rows from the cause found in all used rows, or from the simulator's next run.

    Parameters
    ----------
    case : FoundCause
    simulated
        See ``close_gap``.
    """
    rows = case.rows
    if callable(simulated):
        return _predict(rows, case.survey, case.cause, simulated)
    rough = rows.channel == "roughness"
    before = np.exp(rows.residual - simulated)
    growth = np.where(rough, np.exp(rows.residual) - before, 0.0)
    return Predicted(simulated, growth, np.zeros(len(rows)), case.cause.model)


def make_folds(
    case: FoundCause,
    whole: Predicted,
    observations: Observations,
    model: ErrorModel,
    simulated: Simulated,
    rng: np.random.Generator,
    progress: Callable[[int], None] | None = None,
) -> Folds:
    """Make the Folds of a cause.

    Parameters
    ----------
    case : FoundCause
    whole : Predicted
        Prediction from the cause found in all used rows.
    observations : Observations
        Of all rows.
    model : ErrorModel
        Of their covariance, with the cause.
    simulated, rng, progress
        See ``close_gap``.
    """
    rows = case.rows
    used = case.used
    cause = case.cause
    block = _blocks(rows, cause)
    columns = case.columns()
    nothing = np.zeros(len(rows), dtype=int)
    if not callable(simulated):
        held_out = (
            "The next run of the simulator was compared with the same survey. The effect had "
            "been estimated from this survey, but the change of the simulator was not fitted to "
            "it."
        )
        return Folds(block, nothing, (whole,), held_out, whole, columns)
    if cause.effect == "none":
        held_out = "Nothing was added to the simulator."
        return Folds(block, nothing, (whole,), held_out, whole, columns)
    shift = columns @ np.concatenate([np.zeros(0), *(size for _, size in case.shifting)])
    squares = np.bincount(block, (shift * rows.metric * used) ** 2)
    is_brief = len(np.unique(block[used & rows.metric])) < 2
    if is_brief or squares.max() > SETTINGS.block_share * squares.sum() > 0:
        held_out = (
            "Nothing could be held out: an effect at a single moment shows in no other residual."
        )
        return Folds(block, nothing, (whole,), held_out, whole, columns)
    fold = np.where(used, _dealt(squares)[block], -1)
    if columns.shape[1]:
        predicted = _with_sizes(case, observations, model, fold, whole, columns)
    else:
        keeps = [used & (fold != number) for number in range(SETTINGS.folds)]
        causes = [_trained(case, observations, model, keep, rng) for keep in keeps]
        predicted = tuple(_predict(rows, case.survey, each, simulated) for each in causes)
    if progress is not None:
        progress(1)
    held_out = (
        f"The effect was chosen on all {block.max() + 1} blocks of time; each fifth of them "
        "tests a size that was estimated without it."
    )
    if not used.all():
        held_out += (
            f" {len(np.unique(rows.item[~used]))} observations of check points were never used."
        )
    if case.undecided.any():
        held_out += (
            f" {len(np.unique(rows.item[case.undecided]))} of these, at the moment of the jump, "
            "can't be used for the test: no other residual shows on which side of the jump they "
            "are."
        )
    return Folds(block, fold, predicted, held_out, whole, columns)


def _with_sizes(case, observations, model, fold, whole, columns):
    """Predictions of the simulator with the size from all folds except each.

    The run has the size from all blocks; another size is applied to first order.
    """
    if not whole.shift.any():  # no simulator accepts it
        return (whole,) * SETTINGS.folds
    learned = observations[case.used[observations.row]]
    residual = learned.columns(case.rows.residual[:, None])[:, 0]
    sizes = cross_fitted(
        learned, model, fold[learned.row], SETTINGS.folds, learned.columns(columns), residual
    )
    change = columns @ (sizes[:-1] - sizes[-1]).T
    return tuple(replace(whole, shift=whole.shift + each) for each in change.T)


def _blocks(rows, cause):
    """Block of time of each row (m,), from 0."""
    widths = [part.fixed["width"] for part, _ in cause.parts if "width" in part.fixed]
    length = min(SETTINGS.block_length, SETTINGS.event_share * min(widths, default=np.inf))
    number = np.floor((rows.gps_time - rows.reference.start) / length)
    return np.unique(number, return_inverse=True)[1]


def _dealt(squares):
    """Fold of each block, so that folds have similar squared shifts.

    Blocks are dealt back and forth from the largest; blocks without motion follow in turn.
    """
    turn = np.append(np.arange(SETTINGS.folds), np.arange(SETTINGS.folds)[::-1])
    dealt = np.empty(len(squares), dtype=int)
    dealt[np.argsort(-squares, kind="stable")] = np.resize(turn, len(squares))
    return dealt


def _trained(case, observations, model, used, rng):
    """Cause of a noise class with the size estimated from some rows (m,) bool.

    Intervals of a worse POS, like times of events, come from all rows.
    """
    survey = case.survey
    evidence = case.evidence
    cause = case.cause
    if cause.model.windows:
        part = observations[used[observations.row]]
        windows = _with_factor(part, model, part.columns(case.rows.residual[:, None]))
        return replace(cause, model=replace(cause.model, windows=windows))
    names = cause.effect.split("+")
    part = case.rows.select(used)
    of_part = select([s for s in case.signatures if s.name in names], case.rows, used)
    anew = weigh_labels(part, background(part, survey), survey, of_part, rng, 0)
    best = {name: _likeliest(evidence, name) for name in names}
    noise = [each for each in anew.noise if _is_alike(each, best.get(each.label))]
    anew = replace(anew, noise=tuple(noise))
    if not set(names) <= anew.noisy:  # without these rows nothing shows it
        return cause
    return cause_of(part, of_part, anew, cause.effect, cause.probability)


def _with_factor(observations, model, residual):
    """Intervals of a model with all factors scaled equally, as residuals (n, 1) indicate."""

    def windows(log_ratio):
        return tuple(w._replace(factor=w.factor * float(np.exp(log_ratio))) for w in model.windows)

    def score(log_ratio):
        changed = replace(model, windows=windows(log_ratio))
        return -observations.whitener(changed).log_likelihood(residual)[0]

    widest = np.log(max(INFERENCE.window_factors) / min(INFERENCE.window_factors))
    return windows(minimize_scalar(score, bounds=(-widest, widest), method="bounded").x)


def _likeliest(evidence, name):
    """NoiseEvidence of a label that explains most."""
    return max((e for e in evidence.noise if e.label == name), key=lambda each: each.gain[0])


def _is_alike(noise, other):
    """True if two NoiseEvidence are of one kind: at all times, of fixes, or in intervals."""
    return type(noise) is type(other) and (noise.member < 0) == (other.member < 0)


def cause_for_simulator(rows: Rows, signatures: Sequence[Signature], inference: Inference) -> Cause:
    """Cause to add to the simulator: that of the verdict, or the best known one for unknown.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    inference : Inference
        Of these.
    """
    if inference.verdict.label != "unknown":
        return inference.cause
    if inference.verdict.is_hidden:
        return cause_of(rows, signatures, inference.evidence, "none", inference.probability["none"])
    best = _best_known(inference.probability)
    probability = inference.probability
    return cause_of(rows, signatures, inference.evidence, best, probability.get(best, 0.0))


def _best_known(probability):
    """Most probable label that a simulator can apply; none if there is no other."""
    known = (name for name in probability if name not in ("none", "unknown"))
    return max(known, key=probability.get, default="none")


def _predict(rows, survey, cause, simulated):
    """Prediction of all rows by a simulator with a cause."""
    try:
        effects = cause.effects
    except ValueError:  # larger than possible: no simulator accepts it
        return Predicted.nothing(rows)
    own = [effect for effect in effects if not effect.is_of_pose()]
    change = expected(rows, survey, [effect for effect in own if effect.random])
    rough = (rows.channel == "roughness").any()  # the stated noise, from points, includes it then
    extra = np.zeros(len(rows)) if rough else change.variance
    shift = simulated(tuple(own)) if own else np.zeros(len(rows))
    return Predicted(shift, change.growth, extra, cause.model)


@dataclass(frozen=True)
class CrossFit:
    """Whitened columns of a cause, and the folds of their observations.

    Parameters
    ----------
    columns : (n, p) array
        Innovations of the columns in the observations allowed for training.
    fold : (n,) int array
    number : int
        Number of folds.
    """

    columns: np.ndarray
    fold: np.ndarray
    number: int

    def sizes(self, innovations: np.ndarray) -> np.ndarray:
        """Estimate sizes (f + 1, p, k) of k columns from all folds except each, and last from all.

        Parameters
        ----------
        innovations : (n, k) array
        """
        sizes = []
        for number in range(self.number + 1):
            keep = (self.fold != number) | (self.number == 1)  # nothing is held out then
            columns = self.columns[keep]
            free = INFERENCE.free_sigma
            normal = columns.T @ columns + np.eye(columns.shape[1]) / free**2
            sizes.append(np.linalg.solve(normal, columns.T @ innovations[keep]))
        return np.array(sizes)


def cross_fitted(
    observations: Observations,
    model: ErrorModel,
    fold: np.ndarray,
    number: int,
    columns: np.ndarray,
    residual: np.ndarray,
) -> np.ndarray:
    """Estimate sizes (f + 1, p) of columns from all folds except each, and last from all.

    Parameters
    ----------
    observations : Observations
        Observations allowed for training.
    model : ErrorModel
        Of their covariance.
    fold : (n,) int array
        Of each observation.
    number : int
        Of folds.
    columns : (n, p) array
    residual : (n,) array
    """
    scale = np.abs(columns).max(axis=0, initial=0.0)
    scale[scale == 0] = 1.0
    both = np.column_stack([columns / scale, residual])
    white = observations.whitener(model).innovations(both)[0]
    return CrossFit(white[:, :-1], fold, number).sizes(white[:, -1:])[:, :, 0] / scale
