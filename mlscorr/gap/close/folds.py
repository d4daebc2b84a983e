"""Causes found in some blocks of time alone, for others to judge."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.effects import Effect
from mlscorr.gap.close.settings import SETTINGS
from mlscorr.gap.infer.causes import Cause, Inference, cause_of
from mlscorr.gap.infer.labels import weigh_labels
from mlscorr.gap.infer.measure import Predicted
from mlscorr.gap.infer.verdict import decide, weigh_pairs
from mlscorr.gap.observe.rows import Rows, background
from mlscorr.gap.signatures.expectation import expected
from mlscorr.gap.signatures.signatures import Signature, select
from mlscorr.survey import Survey

Simulated = Callable[[tuple[Effect, ...]], np.ndarray]


@dataclass(frozen=True)
class Folds:
    """Which rows judge which cause.

    Parameters
    ----------
    block : (m,) int array
        Of time, from 0.
    fold : (m,) int array
        Which of `predicted` each row judges; -1 for check points, which judge all.
    predicted : tuple of Predicted
    labels : tuple of str
        Chosen in each fold; none where nothing was held out.
    held_out : str
        What was, in a sentence.
    whole : Predicted
        Of the cause that was found in all used rows.
    """

    block: np.ndarray
    fold: np.ndarray
    predicted: tuple[Predicted, ...]
    labels: tuple[str, ...]
    held_out: str
    whole: Predicted

    @property
    def of_rows(self) -> np.ndarray:
        """Which of `predicted` (m,) is compared with each row where one must be."""
        return np.clip(self.fold, 0, len(self.predicted) - 1)

    def judges(self, number: int) -> np.ndarray:
        """Which rows (m,) judge one of `predicted`."""
        return (self.fold == number) | (self.fold < 0)


def make_folds(
    rows: Rows,
    used: np.ndarray,
    survey: Survey,
    signatures: Sequence[Signature],
    cause: Cause,
    impostor: bool,
    simulated: Simulated,
    rng: np.random.Generator,
    progress: Callable[[int], None] | None = None,
) -> Folds:
    """Folds for a cause that the used rows tell of; see ``close_gap``.

    Every other block of time and the rest: with more folds each judges with less, and steady
    effects hide in the drift.
    """
    block, whole = _blocks(rows, cause), _predict(rows, survey, cause, simulated)
    nothing = np.zeros(len(rows), dtype=int)
    if cause.effect == "none":
        held_out = "Nothing was added to the simulator."
        return Folds(block, nothing, (whole,), (), held_out, whole)
    squares = np.bincount(block, (whole.shift * rows.metric) ** 2)
    if squares.max() > SETTINGS.block_share * squares.sum() > 0:
        held_out = "Nothing could be held out: what acts in one moment is told by no other."
        return Folds(block, nothing, (whole,), (), held_out, whole)
    number, predicted, labels = np.where(used, block % 2, -1), [], []
    for half in range(2):
        trained = _train(rows, used & (number != half), survey, signatures, impostor, rng)
        labels.append(trained.effect)
        predicted.append(_predict(rows, survey, trained, simulated))
        if progress is not None:
            progress(1)
    held_out = (
        f"Every other one of {block.max() + 1} blocks of time, and then the rest: effect and size "
        "were found in those between."
    )
    if not used.all():
        held_out += f" {len(np.unique(rows.item[~used]))} looks at check points were never used."
    return Folds(block, number, tuple(predicted), tuple(labels), held_out, whole)


def _blocks(rows, cause):
    """Which block of time each row (m,) is in, from 0."""
    widths = [part.fixed["width"] for part, _ in cause.parts if "width" in part.fixed]
    length = min(SETTINGS.block_length, SETTINGS.event_share * min(widths, default=np.inf))
    number = np.floor((rows.gps_time - rows.reference.start) / length)
    return np.unique(number, return_inverse=True)[1]


def _train(rows, used, survey, signatures, impostor, rng):
    """The Cause that some rows (m,) bool tell of, by the whole inference.

    Nothing unknown can be added to a simulator: the best known cause is, where an impostor is
    wanted, and else nothing.
    """
    part, of_part = rows.select(used), select(signatures, used)
    evidence = weigh_labels(part, background(part, survey), survey, of_part, rng, 0)
    probability = weigh_pairs(part, of_part, evidence)
    label = decide(evidence, probability).label
    if label == "unknown":
        label = _best_known(probability) if impostor else "none"
    return cause_of(part, of_part, evidence, label, probability[label])


def cause_for_simulator(rows: Rows, signatures: Sequence[Signature], inference: Inference) -> Cause:
    """The cause that is put into the simulator: the verdict's; the best known one for unknown.

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
    best, probability = _best_known(inference.probability), inference.probability
    return cause_of(rows, signatures, inference.evidence, best, probability.get(best, 0.0))


def _best_known(probability):
    """The most probable label that a simulator can take; none where there is no other."""
    known = (name for name in probability if name not in ("none", "unknown"))
    return max(known, key=probability.get, default="none")


def _predict(rows, survey, cause, simulated):
    """What a simulator with a cause in it expects of all rows: Predicted."""
    try:
        effects = cause.effects
    except ValueError:  # larger than any survey can have: no simulator takes it
        return Predicted.nothing(rows)
    own = [effect for effect in effects if not effect.is_of_pose()]
    noise = [effect for effect in own if effect.random]
    change = expected(rows, survey, noise)
    rough = (rows.channel == "roughness").any()  # then the stated noise, from the points, holds it
    extra = np.zeros(len(rows)) if rough else change.variance
    shift = simulated(tuple(own)) if own else np.zeros(len(rows))
    return Predicted(shift, change.growth, extra, cause.model)
