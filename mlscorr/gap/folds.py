"""Causes found in some blocks of time alone, for others to judge."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.causes import cause_of
from mlscorr.gap.changes import expected
from mlscorr.gap.measure import Predicted
from mlscorr.gap.rows import background
from mlscorr.gap.signatures import select
from mlscorr.gap.verdict import compare, pairs, verdict

FOLDS = 2  # with more, each judges with less, and steady effects hide in the drift
LONGEST, SHORTEST = 5.0, 0.5  # s of a block: the drift of seconds is held out with it
WITHIN = 0.25  # of an event's width that a block lasts: some of the event is left to learn from
ALONE = 0.8  # of a cause's squared shift in one block, from which on no other block tells of it


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
    told : str
        What was held out, in a sentence.
    whole : Predicted
        Of the cause that was found in all used rows.
    """

    block: np.ndarray
    fold: np.ndarray
    predicted: tuple[Predicted, ...]
    labels: tuple[str, ...]
    told: str
    whole: Predicted

    @property
    def of_rows(self):
        """Which of `predicted` (m,) is compared with each row where one must be."""
        return np.clip(self.fold, 0, len(self.predicted) - 1)

    def judge(self, one):
        """Which rows (m,) judge one of `predicted`."""
        return (self.fold == one) | (self.fold < 0)


def fold(rows, used, survey, signatures, cause, impostor, simulated, rng, progress=None):
    """Folds for a cause that was found in the used rows; see closure.close."""
    block, whole = blocks_of(rows, cause), predict(rows, survey, cause, simulated)
    nothing = np.zeros(len(rows), dtype=int)
    if cause.effect == "none":
        told = "Nothing was added to the simulator."
        return Folds(block, nothing, (whole,), (), told, whole)
    squares = np.bincount(block, (whole.shift * rows.metric) ** 2)
    if squares.max() > ALONE * squares.sum() > 0:
        told = "Nothing could be held out: what acts in one moment is told by no other."
        return Folds(block, nothing, (whole,), (), told, whole)
    number, predicted, labels = np.where(used, block % FOLDS, -1), [], []
    for one in range(FOLDS):
        trained = train(rows, used & (number != one), survey, signatures, impostor, rng)
        labels.append(trained.effect)
        predicted.append(predict(rows, survey, trained, simulated))
        if progress is not None:
            progress(1)
    told = (
        f"Every other one of {block.max() + 1} blocks of time, and then the rest: effect and size "
        "were found in those between."
    )
    if not used.all():
        told += f" {len(np.unique(rows.item[~used]))} looks at check points were never used."
    return Folds(block, number, tuple(predicted), tuple(labels), told, whole)


def blocks_of(rows, cause):
    """Which block of time each row (m,) is in, from 0."""
    widths = [part.fixed["width"] for part, _ in cause.parts if "width" in part.fixed]
    length = np.clip(WITHIN * min(widths, default=np.inf), SHORTEST, LONGEST)
    number = np.floor((rows.gps_time - rows.reference.start) / length)
    return np.unique(number, return_inverse=True)[1]


def train(rows, used, survey, signatures, impostor, rng):
    """The Cause that some rows (m,) bool tell of, by the whole inference.

    Nothing unknown can be added to a simulator: the best known cause is, where an impostor is
    wanted, and else nothing.
    """
    part = rows.select(used)
    signs = select(signatures, used)
    found = compare(part, background(part, survey), survey, signs, rng, 0)
    chance = pairs(part, signs, found)
    label = verdict(found, chance).label
    if label == "unknown":
        label = best_known(chance) if impostor else "none"
    return cause_of(part, signs, found, label, chance[label])


def best_known(chance):
    """The most probable label that a simulator can take; none where there is no other."""
    return max((n for n in chance if n not in ("none", "unknown")), key=chance.get, default="none")


def predict(rows, survey, cause, simulated):
    """What a simulator with a cause in it expects of all rows: Predicted."""
    try:
        effects = cause.effects
    except ValueError:  # larger than any survey can have: no simulator takes it
        return Predicted.nothing(rows)
    own = [effect for effect in effects if not (effect.random and effect.stage == "pos")]
    noise = [effect for effect in own if effect.random]
    change = expected(rows, survey, noise)
    rough = (rows.channel == "roughness").any()  # then the stated noise, from the points, holds it
    extra = np.zeros(len(rows)) if rough else change.variance
    shift = simulated(tuple(own)) if own else np.zeros(len(rows))
    return Predicted(shift, change.growth, extra, cause.setting)
