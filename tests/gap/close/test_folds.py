"""Each row is judged by a cause that was found without it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.close.folds import Folds, cause_for_simulator, make_folds
from mlscorr.gap.close.settings import SETTINGS
from mlscorr.gap.infer.causes import Inference
from mlscorr.gap.infer.measure import Predicted
from mlscorr.gap.infer.verdict import GapVerdict


def test_blocks_are_short_enough_for_an_event(late):
    "Five seconds, or a quarter of an event's width; rows of one block are close in time"
    cause = late.cause("none")
    event = next(sign for sign in late.signs if "width" in sign.fixed)
    narrow = replace(cause, parts=((event, np.zeros(3)),))
    for tested, length in (
        (cause, SETTINGS.block_length), (narrow, SETTINGS.event_share * event.fixed["width"])
    ):  # fmt: skip
        block = late.folds(replace(tested, effect="none")).block
        spans = [np.ptp(late.rows.gps_time[block == b]) for b in np.unique(block)]
        assert max(spans) <= length
        assert block.min() == 0


def test_each_row_is_judged_by_a_cause_found_without_it(late):
    "Used rows judge one half's cause, check points both; neighbouring blocks take turns"
    folds = late.folds(late.cause("time_offset"))
    assert set(np.unique(folds.fold)) == {-1, 0, 1}
    assert (folds.fold[~late.used] == -1).all()
    assert (folds.judges(0) & folds.judges(1) == (folds.fold == -1)).all()
    halves = {b: f for b, f in zip(folds.block, folds.fold, strict=True) if f >= 0}
    assert all(halves[a] != halves[b] for a, b in pairwise(sorted(halves)) if b == a + 1)


def test_rows_are_compared_with_what_their_fold_predicts():
    "Used rows with their own, check points with the first; check points judge every fold"
    nothing = Predicted(*np.zeros((3, 5)))
    fold = np.array([0, 1, -1, 1, 0])
    folds = Folds(np.arange(5), fold, (nothing, nothing), ("a", "b"), "", nothing)
    assert folds.of_rows.tolist() == [0, 1, 0, 1, 0]
    assert folds.judges(0).tolist() == [True, False, True, False, True]
    assert folds.judges(1).tolist() == [False, True, True, True, False]


def test_a_cause_of_one_moment_holds_nothing_out(late):
    "What shifts rows of one block of time alone is told by no other: one prediction judges all"
    cause = late.cause("time_offset")
    block = late.folds(replace(cause, effect="none")).block

    def in_one_block(effects):
        return np.where(block == 1, 0.05, 0.0)

    rows, used, survey, signs, _, _, rng = late.arguments(cause)
    folds = make_folds(rows, used, survey, signs, cause, False, in_one_block, rng)
    assert folds.held_out.startswith("Nothing could be held out")
    assert folds.labels == () and len(folds.predicted) == 1 and not folds.fold.any()
    np.testing.assert_array_equal(folds.predicted[0].shift, folds.whole.shift)


def test_halves_find_the_size_of_the_clock_by_themselves(late):
    "Found in half of the blocks each, the predicted shifts are those of 6 ms to a quarter"
    cause = late.cause("time_offset")
    truth = late.simulated((make_effect("time_offset", magnitude=0.006),))
    metric = late.rows.metric
    for predicted in late.folds(cause).predicted:
        off = np.sqrt(np.mean((predicted.shift - truth)[metric] ** 2))
        assert off < 0.25 * np.sqrt(np.mean(truth[metric] ** 2))


def test_training_is_counted(late):
    "Each half reports once when it is done"
    rows, used, survey, signs, cause, simulated, rng = late.arguments(late.cause("time_offset"))
    steps = []
    make_folds(rows, used, survey, signs, cause, False, simulated, rng, steps.append)
    assert steps == [1, 1]


def inference(late, label, probability, is_hidden=False):
    "What an inference says of the bed, in the parts on which the simulator's cause depends"
    verdict = GapVerdict(label, probability[label], (label,), 0.01, "", is_hidden)
    causes = tuple(late.cause(name) for name in probability if name != "unknown")
    return Inference(verdict, causes, (), None, None, probability, late.evidence)


@pytest.mark.parametrize("label, is_hidden, expected", [
    ("time_offset", False, "time_offset"),
    ("none", False, "none"),
    ("unknown", False, "lever_arm"),
    ("unknown", True, "none"),
])  # fmt: skip
def test_the_simulator_takes_a_known_cause(late, label, is_hidden, expected):
    "The verdict's; for unknown the best known one, or nothing where only missing targets tell"
    share = {"unknown": 0.5, "none": 0.2, "lever_arm": 0.2, "time_offset": 0.1}
    cause = cause_for_simulator(late.rows, late.signs, inference(late, label, share, is_hidden))
    assert cause.effect == expected


def test_without_a_known_cause_nothing_is_added(late):
    "Where none and unknown are all labels, the simulator stays as it is"
    share = {"unknown": 0.8, "none": 0.2}
    cause = cause_for_simulator(late.rows, late.signs, inference(late, "unknown", share))
    assert cause.effect == "none"
