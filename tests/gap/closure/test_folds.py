"""Each row is judged by a size that was found without it."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.effects.vehicle import PositionStep
from mlscorr.gap.closure import cause_for_simulator
from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure.folds import Folds
from mlscorr.gap.evidence import Inference, Predicted
from mlscorr.gap.evidence.decision import GapVerdict
from mlscorr.gap.signatures import Bench, signature


def test_blocks_are_short_enough_for_an_event(late):
    "Five seconds, or a quarter of an event's width; rows of one block are close in time"
    cause = late.cause("none")
    event = next(sign for sign in late.signs if "width" in sign.fixed)
    narrow = replace(cause, parts=((event, np.zeros(3)),))
    for tested, length in (
        (cause, SETTINGS.block_length),
        (narrow, SETTINGS.event_share * event.fixed["width"]),
    ):
        block = late.folds(replace(tested, effect="none")).block
        spans = [np.ptp(late.rows.gps_time[block == b]) for b in np.unique(block)]
        assert max(spans) <= length
        assert block.min() == 0


def test_each_row_is_judged_by_a_size_found_without_it(late):
    "Five folds of whole blocks, each with a fifth of what the clock moves; check points judge all"
    cause = late.cause("time_offset")
    folds = late.folds(cause)
    assert set(np.unique(folds.fold)) == {-1, 0, 1, 2, 3, 4}
    assert folds.is_held_out
    assert (folds.fold[~late.used] == -1).all()
    for block in np.unique(folds.block):
        assert len(np.unique(folds.fold[late.used & (folds.block == block)])) <= 1
    moved = np.where(late.used & late.rows.metric, folds.whole.shift, 0.0) ** 2
    share = [moved[folds.fold == number].sum() / moved.sum() for number in range(5)]
    assert min(share) > 0.15


def test_rows_are_compared_with_what_their_fold_predicts():
    "Used rows with their own, check points with the first"
    nothing = Predicted(*np.zeros((3, 5)))
    fold = np.array([0, 1, -1, 1, 0])
    folds = Folds(np.arange(5), fold, (nothing, nothing), "", nothing, np.zeros((5, 0)))
    assert folds.of_rows.tolist() == [0, 1, 0, 1, 0]


def test_a_cause_of_one_moment_holds_nothing_out(late):
    "A jump in the last second shifts rows of one block alone: one prediction judges all"
    rows = late.rows
    bench = Bench(late.rows, late.survey)
    time = float(rows.gps_time[rows.metric & late.used].max() - rows.reference.start - 1.0)
    jump = signature(bench, PositionStep, {"time": time}, np.random.default_rng(0))
    cause = replace(late.cause("time_offset"), parts=((jump, np.full(3, 0.05)),))
    folds = late.folds(cause)
    assert folds.held_out.startswith("Nothing could be held out")
    assert not folds.is_held_out
    assert len(folds.predicted) == 1 and not folds.fold.any()
    np.testing.assert_array_equal(folds.predicted[0].shift, folds.whole.shift)


def test_each_fold_finds_the_size_of_the_clock_by_the_others(late):
    "Found in four fifths of the blocks each, the predicted shifts are those of 6 ms to a fifth"
    truth = late.simulated((make_effect("time_offset", magnitude=0.006),))
    metric = late.rows.metric
    for predicted in late.folds(late.cause("time_offset")).predicted:
        off = np.sqrt(np.mean((predicted.shift - truth)[metric] ** 2))
        assert off < 0.2 * np.sqrt(np.mean(truth[metric] ** 2))


def test_the_folds_are_counted(late):
    "They report once when they are done"
    steps = []
    late.folds(late.cause("time_offset"), progress=steps.append)
    assert steps == [1]


def inference(late, label, probability, is_hidden=False):
    "Inference on the bed, in the parts on which the simulator's cause depends"
    verdict = GapVerdict(label, probability[label], (label,), 0.01, "", is_hidden)
    causes = tuple(late.cause(name) for name in probability if name != "unknown")
    return Inference(verdict, causes, (), None, None, probability, late.evidence, None)


@pytest.mark.parametrize(
    "label, is_hidden, expected",
    [
        ("time_offset", False, "time_offset"),
        ("none", False, "none"),
        ("unknown", False, "lever_arm"),
        ("unknown", True, "none"),
    ],
)
def test_the_simulator_takes_a_known_cause(late, label, is_hidden, expected):
    "The verdict's; for unknown the best known one, or nothing where only missing targets tell"
    share = {"unknown": 0.5, "none": 0.2, "lever_arm": 0.2, "time_offset": 0.1}
    cause = cause_for_simulator(late.rows, late.signs, inference(late, label, share, is_hidden))
    assert cause.effect == expected


def test_without_a_known_cause_nothing_is_added(late):
    "With labels none and unknown the simulator does not change"
    share = {"unknown": 0.8, "none": 0.2}
    cause = cause_for_simulator(late.rows, late.signs, inference(late, "unknown", share))
    assert cause.effect == "none"
