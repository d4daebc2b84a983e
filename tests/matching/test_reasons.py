"""Unmatched observations have a sentence with numbers."""

import numpy as np
import pytest

from mlscorr.matching import match
from mlscorr.survey import Statement
from tests.matching.test_association import (
    EAST,
    ORIGIN,
    PLACES,
    control_points,
    observations,
    trajectory,
)
from tests.matching.test_marginals import drift, street


def test_the_sentence_of_an_ambiguity_gives_the_numbers():
    "The sentence gives points, distance, time and search radius"
    places = np.array([[5.0, 50.0, 1.0], [5.0, 50.31, 1.0]])
    found = match(
        observations(places[:1] + np.array([0, 0.15, 0])), control_points(places), trajectory()
    )
    assert len(found.matched) == 0
    sentence = found.refusals[0].reason
    assert "0.31 m apart, both match the observation at 357705.0 s" in sentence


def test_unseen_control_has_a_reason_with_the_nearest_find():
    "A control point that nobody saw says how far the nearest target found is"
    found = match(observations(PLACES[:1]), control_points(PLACES[:2]), trajectory())
    (refusal,) = found.refusals
    assert (refusal.name, refusal.pass_number) == ("T02", None)
    assert refusal.reason.startswith("No circle of 0.60 m was found near it")
    assert "was found at 357705.0 s, 100.00 m away (it is T01)" in refusal.reason


def test_a_find_that_is_another_point_is_named():
    "Two circles surveyed 4 m apart, of which one was seen: the other learns that it is the first"
    places = np.vstack([PLACES, PLACES[4] + 4.0 * EAST])
    found = match(observations(PLACES), control_points(places), trajectory())
    (refusal,) = found.refusals
    assert refusal.name == "T11" and refusal.pass_number is None
    assert refusal.reason.startswith("Each circle of 0.60 m found near it (search radius 10.00 m)")
    assert "was found at 357745.0 s, 4.00 m away (it is T05)" in refusal.reason


def test_a_find_that_was_refused_says_why():
    "A circle 6 m from an unseen point, where its neighbours are 0.1 m off: found, but another one"
    seen = PLACES + 0.1
    seen[4] = PLACES[4] + 6.0 * EAST
    found = match(observations(seen), control_points(PLACES), stated(0.05))
    assert "T05" not in found.matched.name and len(found.matched) == 9
    (refusal,) = found.refusals
    assert refusal.name == "T05"
    assert "unmatched circle of 0.60 m was found at 357745.0 s, 6.00 m away" in refusal.reason
    assert refusal.reason.endswith(found.reasons[0])
    assert "The observation is another object (misclosure 6.00 m" in found.reasons[0]


def test_a_find_of_another_kind_is_no_find_of_a_point():
    "A square 8 m from an unseen circle: no circle was found, and the square is the nearest target"
    seen = np.vstack([PLACES[:4], PLACES[4:5] + 8.0 * EAST])
    kinds = ("circle",) * 4 + ("square",)
    found = match(observations(seen, kinds), control_points(PLACES[:5]), trajectory())
    (refusal,) = found.refusals
    assert refusal.name == "T05"
    assert refusal.reason.startswith("No circle of 0.60 m was found near it")
    assert (
        "The nearest target, a square of 0.60 m, was found at 357745.0 s, 8.00 m" in refusal.reason
    )


def test_nothing_observed_gives_every_control_a_reason():
    "No observation at all is no crash"
    found = match(observations(np.empty((0, 3))), control_points(PLACES), trajectory())
    assert len(found.matched) == 0
    assert {refusal.reason for refusal in found.refusals} == {"No target was found in the cloud."}
    assert len(found.refusals) == 10


def test_two_finds_as_near_as_each_other_are_refused():
    "Two finds 0.5 m to either side of one surveyed point: the sentence says so"
    seen = PLACES[[0, 0]] + [[0.0, 0.5, 0.0], [0.0, -0.5, 0.0]]
    found = match(observations(seen), control_points(PLACES[:1]), trajectory())
    assert len(found.matched) == 0
    assert "Two observations 1.00 m apart" in found.refusals[0].reason
    assert "both match T01" in found.refusals[0].reason


def test_exchanged_points_of_two_kinds_are_named():
    "A circle and a square whose names were exchanged are refused, and each names the other"
    places = street()
    kinds = np.array(["circle"] * 30, dtype=object)
    kinds[20] = "square"
    listed = kinds.copy()
    listed[[5, 20]] = kinds[[20, 5]]
    seen = observations(places + drift(places[:, 1], 0.5), tuple(kinds))
    control = control_points(places, tuple(listed))
    found = match(seen, control, trajectory(lambda t: np.full(len(t), 0.2)))
    assert len(found.matched) == 28
    assert {refusal.name for refusal in found.refusals} == {"T06", "T21"}
    for refusal in found.refusals:
        assert refusal.why.key == "other appearance"
        assert {refusal.name, *refusal.why.values["exchanged"]} == {"T06", "T21"}
        assert "seem to be exchanged" in refusal.reason


def test_a_wrong_size_is_told():
    "A point taken down as 0.3 m whose target has 0.6 m is refused, and both sizes are given"
    places = street()
    size = np.full(30, 0.6)
    size[7] = 0.3
    control = control_points(places, size=size)
    found = match(observations(places + 0.1), control, trajectory())
    (refusal,) = found.refusals
    assert refusal.name == "T08"
    assert "is a circle of 0.60 m and T08 is a circle of 0.30 m" in refusal.reason


def test_a_look_alike_beside_a_hidden_target_is_not_used():
    "A sign 0.9 m from a target that nobody saw is no target, says its reason"
    places = street()
    moving = drift(places[:, 1], 0.5)
    seen = places + moving
    seen[12] += [0.0, 0.0, 0.9]
    found = match(
        observations(seen), control_points(places), trajectory(lambda t: np.full(len(t), 0.2))
    )
    assert "T13" not in found.matched.name
    assert len(found.matched) == 29
    assert found.reasons[0].startswith("T13 is 0.")
    assert "or the observation is another" in found.reasons[0]


def stated(sigma):
    "A drive that states a sigma (m) throughout"
    return trajectory(lambda t: np.full(len(t), sigma))


def test_every_observation_has_a_name_or_a_reason():
    "Named ones have no reason; each of the others one sentence that ends with a full stop"
    places = street()
    kept = np.delete(np.arange(30), [3, 11])
    found = match(observations(places + 0.1), control_points(places[kept]), trajectory())
    assert len(found.matched) == 28 and len(found.unmatched) == len(found.reasons) == 2
    for reason in found.reasons:
        assert reason.endswith(".") and "No surveyed point remains" in reason


def test_the_nearest_point_of_a_lone_find_is_named():
    "With kind, size and distance, and whether another observation of the pass has it"
    seen = np.vstack([PLACES, [[5.0, 55.0, 1.0]]])
    found = match(observations(seen), control_points(PLACES), trajectory(), search_radius=2.0)
    (reason,) = found.reasons
    assert "for the circle of 0.60 m at 357705.5 s (search radius 2.00 m)" in reason
    assert "the nearest, T01, already matched in this pass, a circle of 0.60 m" in reason
    assert reason.endswith("is 5.00 m away.")


def test_without_control_each_find_says_so():
    "No surveyed point at all: kind, size and time of what was found"
    found = match(observations(PLACES[:2]), control_points(PLACES[:0]), trajectory())
    assert found.reasons == (
        "No point was surveyed for the circle of 0.60 m at 357705.0 s.",
        "No point was surveyed for the circle of 0.60 m at 357715.0 s.",
    )
    assert found.refusals == ()


def test_reasons_follow_the_order_of_observations():
    "Observations given backward have their own reasons, and the same refusals"
    places = street()
    seen = observations(places + 0.1)
    control = control_points(np.delete(places, [4, 20], axis=0))
    forward = match(seen, control, trajectory())
    backward = match(seen[np.arange(30)[::-1]], control, trajectory())
    assert forward.reasons == backward.reasons[::-1]
    assert "357709.5" not in forward.reasons[0] or forward.reasons[0] != forward.reasons[1]
    assert set(forward.refusals) == set(backward.refusals)


def test_a_refused_point_says_when_and_in_which_pass():
    "Time and pass of the observation that was refused; none of either where nothing was found"
    places = street()
    surveyed = places.copy()
    surveyed[10] += [0.8, 0.0, 0.0]
    surveyed[20] += [0.0, 0.0, 500.0]
    seen = observations(places + drift(places[:, 1], 0.5))
    found = match(seen, control_points(surveyed), stated(0.2))
    by_name = {refusal.name: refusal for refusal in found.refusals}
    assert by_name["T11"].pass_number == 1
    assert by_name["T11"].gps_time == pytest.approx(seen.gps_time[10])
    assert by_name["T21"].pass_number is None and by_name["T21"].gps_time is None
    assert by_name["T21"].reason.startswith("No circle of 0.60 m was found near it")


def test_neighbours_are_named_with_their_times():
    "Both where there are both, one at the end of a drive, and how well they tell the place"
    places = street()
    surveyed = places.copy()
    surveyed[0] += [2.0, 0.0, 0.0]
    surveyed[15] += [2.0, 0.0, 0.0]
    found = match(observations(places + 0.1), control_points(surveyed), stated(0.05))
    first, middle = (refusal.why.values for refusal in found.refusals)
    assert first["neighbours"] == (("T02", 2.5),)
    assert middle["neighbours"] == (("T15", -2.5), ("T17", 2.5))
    assert first["sigma"] < 1.0 and middle["sigma"] < 1.0
    words = "Its neighbors T15 (-2.5 s) and T17 (+2.5 s) predict the misclosure with a sigma of 0."
    assert words in found.refusals[1].reason


def test_a_wrong_point_gives_probability_and_passes():
    "Seen in two passes, 1 m off each time: sure to three digits, by two observations"
    places = street(12)
    surveyed = places.copy()
    surveyed[6] += EAST
    later = places + np.array([0.0, 900.0, 0.0])
    seen = observations(places + 0.1)
    again = observations(places + 0.1, pass_number=2)
    again = type(again)(**{**vars(again), "gps_time": observations(later).gps_time})
    both = type(seen).concatenate([seen, again])
    found = match(both, control_points(surveyed), stated(0.2))
    reasons = [refusal.why for refusal in found.refusals if refusal.name == "T07"]
    assert [why.key for why in reasons] == ["wrong point"] * 2
    for why in reasons:
        assert why.values["observations"] == 2 and why.values["probability"] > 0.99
        assert why.values["off"] == pytest.approx(1.0, abs=0.1)


def test_places_in_sentences_are_those_of_the_survey():
    "UTM coordinates lose no centimetre: the misclosure of 0.31 m is told as that"
    places = street()
    surveyed = places.copy()
    surveyed[8] += [0.0, 0.0, 1.31]
    found = match(observations(places), control_points(surveyed), stated(0.05))
    (refusal,) = found.refusals
    assert refusal.why.values["misclosure"] == pytest.approx(1.31, abs=1e-6)
    assert "misclosure 1.31 m" in refusal.reason and refusal.name == "T09"
    assert np.abs(ORIGIN).max() > 1e6


def test_reasons_are_told_apart_by_their_keys():
    "Nothing found, no control, nothing of its kind, another point: a key each, and its values"
    nothing = match(observations(np.empty((0, 3))), control_points(PLACES[:1]), trajectory())
    assert [refusal.why for refusal in nothing.refusals] == [Statement("nothing found")]
    uncontrolled = match(observations(PLACES[:1]), control_points(PLACES[:0]), trajectory())
    (why,) = uncontrolled.why
    assert why.key == "no control"
    assert why.values == {"kind": "circle", "size": 0.6, "time": 357705.0}
    unseen = match(observations(PLACES[:1]), control_points(PLACES[:2]), trajectory())
    (refusal,) = unseen.refusals
    assert refusal.why.key == "none of its kind"
    assert refusal.why.values["away"] == pytest.approx(100.0)
    assert refusal.why.values["found_name"] == "T01"
