import numpy as np
import pytest

from mlscorr.matching import SETTINGS, log_share
from mlscorr.matching._marginals import Marginals
from mlscorr.matching._pairs import CandidatePairs
from mlscorr.matching.decision import decide, moved_share_by_others


def decided(sound, moved, control, first=None, count=2):
    "Decision on pairs of observations with one pair each"
    n = len(control)
    same = np.ones(n, bool)
    nothing = np.zeros((n, 3))
    first = np.arange(n + 1) if first is None else first
    pairs = CandidatePairs(np.asarray(first), np.array(control), nothing, same)
    share = np.full(len(sound), SETTINGS.moved_share)
    return decide(
        pairs, Marginals(np.array(sound), np.array(moved), nothing, nothing), count, share
    )


def test_a_match_is_used_from_99_percent_on():
    "A pair of 0.995 is used, one of 0.95 is not, and probabilities are kept"
    decision = decided([0.995, 0.95], [0.0, 0.0], [0, 1])
    assert decision.column.tolist() == [0, -1]
    assert decision.probability == pytest.approx([0.995, 0.0])
    assert decision.passes.tolist() == [1, 1]


def test_passes_decide_together_whether_a_point_was_moved():
    "Two passes that each doubt a point make it wrong, though a third by itself would use it"
    alone = decided([0.995], [0.004], [0], count=1)
    assert alone.wrong[0] < 0.1 and alone.column.tolist() == [0]
    doubted = decided([0.995, 0.05, 0.05], [0.004, 0.95, 0.95], [0, 0, 0], count=1)
    assert doubted.wrong[0] > 0.9
    assert doubted.column.tolist() == [-1, -1, -1]


def test_other_passes_tell_that_a_point_is_in_its_place():
    "Of two passes one finds the point in its place: for the other it is moved with 0.001 at most"
    nothing = np.zeros((2, 3))
    pairs = CandidatePairs(np.arange(3), np.zeros(2, int), nothing, np.ones(2, bool))
    marginals = Marginals(np.array([0.9999, 0.1]), np.array([1e-4, 0.89]), nothing, nothing)
    share = moved_share_by_others(pairs, marginals, 1, np.full(2, SETTINGS.moved_share))
    assert share[1] <= 1e-3
    assert share[0] > 0.5


def test_many_points_that_seem_wrong_are_left_to_the_estimate():
    "Three of 12 that one pass each finds elsewhere may be short drift, two are likelier wrong"
    for count, expected in ((2, -1), (3, 0)):
        sound = np.where(np.arange(12) < count, 0.005, 0.9999)
        moved = np.where(np.arange(12) < count, 0.994, 0.0)
        decision = decided(sound, moved, np.arange(12), count=12)
        assert decision.column[0] == expected and decision.column[11] == 11
        assert decision.wrong[0] > 0.9


def test_what_two_passes_find_elsewhere_is_no_drift():
    "Three of 12 points that are off in both of two passes were moved, however many they are"
    control = np.repeat(np.arange(12), 2)
    sound = np.where(control < 3, 0.005, 0.9999)
    moved = np.where(control < 3, 0.994, 0.0)
    decision = decided(sound, moved, control, count=12)
    assert decision.column[:6].tolist() == [-1] * 6 and decision.column[6] == 3


def test_shares_that_are_not_known():
    "Of two things any number is as probable under a mean of 1/2; one of them has half of its"
    assert [log_share(number, 2, 0.5) for number in range(3)] == pytest.approx(
        np.log([1 / 3, 1 / 6, 1 / 3])
    )
    assert log_share(1, 1, 0.05) == pytest.approx(np.log(0.05))
