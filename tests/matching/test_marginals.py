"""Matches that agree with their neighbours in time."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import matching_study
import numpy as np
import pytest

from mlscorr.collocation import Covariance
from mlscorr.matching import SETTINGS, match
from mlscorr.matching._beliefs import Chain, build_chain
from mlscorr.matching._hypotheses import predict, start
from mlscorr.matching._marginals import join, marginals, use
from mlscorr.matching._pairs import CandidatePairs, find_pairs
from mlscorr.pos import PosErrors
from mlscorr.survey import SEARCH_RADIUS, Pos
from tests.matching.test_association import (
    ORIGIN,
    SPEED,
    START,
    control_points,
    observations,
    trajectory,
)

CORRELATION_TIME = 30.0  # s
METRE = lambda t: np.full(len(t), 1.0)  # noqa: E731 - a POS that states 1 m throughout


def street(n=30, step=25.0):
    "n targets of one kind on both sides of the road, every 25 m"
    along = step * np.arange(n) + 30.0
    return np.column_stack([5.0 * (-1.0) ** np.arange(n), along, np.full(n, 1.0)])


def drift(along, size=3.0, rng=None):
    "A smooth drift of up to size (m) in all directions, by sines of 100 to 200 s"
    rng = np.random.default_rng(0) if rng is None else rng
    seconds = along[:, None, None] / SPEED
    periods = rng.uniform(100, 200, (3, 3))
    phases = rng.uniform(0, 2 * np.pi, (3, 3))
    value = np.sin(2 * np.pi * seconds / periods + phases).sum(axis=1)
    return size * value / np.linalg.norm(value, axis=1).max()


def is_right(found, seen):
    "True for each matched observation of the target that was measured there"
    at = {tuple(ORIGIN + row): i for i, row in enumerate(seen)}
    return [
        name == f"T{at[tuple(position)] + 1:02d}"
        for name, position in zip(found.matched.name, found.matched.position, strict=True)
    ]


@pytest.mark.parametrize("seed", range(5))
def test_look_alikes_come_out_right_with_three_metres_of_drift(seed):
    """Five pairs 1.5 m apart, drift up to 3 m: all named right, where the nearest point is wrong.

    Only at the drive's ends, with neighbours on one side, may a target stay unnamed.
    """
    places = street()
    for i in range(3, 30, 6):
        places[i] = places[i - 1] + [0.0, 1.5, 0.0]
    seen = places + drift(places[:, 1], rng=np.random.default_rng(seed))
    found = match(observations(seen), control_points(places), trajectory(METRE))
    assert all(is_right(found, seen))
    assert set(control_points(places).name[2:28]) <= set(found.matched.name)
    assert found.probability.min() > 0.99
    nearest = np.linalg.norm(seen[:, None] - places, axis=2).argmin(axis=1)
    assert (nearest != np.arange(30)).sum() >= 2


def test_a_look_alike_that_is_all_the_evidence_is_refused():
    "One of two look-alikes, seen alone with metres of drift: both are refused, with the numbers"
    places = np.array([[5.0, 500.0, 1.0], [5.0, 501.5, 1.0]])
    seen = observations(places[:1] + np.array([0.3, 0.9, 0.1]))
    found = match(seen, control_points(places), trajectory(METRE))
    assert len(found.matched) == 0
    assert {refusal.name for refusal in found.refusals} == {"T01", "T02"}
    assert "1.50 m apart, both match the observation at 357750.1 s" in found.reasons[0]
    assert "No other target constrains the misclosure there" in found.reasons[0]


def test_a_moved_control_point_is_found():
    "A surveyed point 0.8 m off amid good ones is refused, with its neighbours; the rest is used"
    places = street()
    surveyed = places.copy()
    surveyed[10] += [0.8, 0.0, 0.0]
    seen = observations(places + drift(places[:, 1], 0.5))
    found = match(seen, control_points(surveyed), trajectory(lambda t: np.full(len(t), 0.2)))
    assert "T11" not in found.matched.name
    assert len(found.matched) == 29
    (refusal,) = found.refusals
    assert refusal.name == "T11"
    assert "T10 (-2.5 s) and T12 (+2.5 s)" in refusal.reason
    assert "Its coordinates are wrong" in refusal.reason
    assert refusal.why.values["off"] == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize("away", [0.02, 0.05])
def test_a_few_centimetres_are_left_to_the_outlier_test(away):
    "A surveyed point that is off by less than its neighbours' credible motion stays matched"
    places = street()
    surveyed = places.copy()
    surveyed[10] += [away, 0.0, 0.0]
    seen = observations(places + drift(places[:, 1], 0.5))
    found = match(seen, control_points(surveyed), trajectory(lambda t: np.full(len(t), 0.2)))
    assert len(found.matched) == 30


def test_two_visits_of_one_target_are_both_used():
    "A target seen again 20 s later, after a stop in front of it, keeps its name"
    places = street()
    seen = observations(np.vstack([places, places[14:15]]) + 0.2)
    later = seen.gps_time.copy()
    later[15:] += 20.0
    later[30] = seen.gps_time[14] + 20.0
    found = match(replace(seen, gps_time=later), control_points(places), trajectory())
    assert found.matched.name.count("T15") == 2
    assert len(found.matched) == 31


def test_drift_that_ends_abruptly_costs_no_target():
    "At GNSS re-acquisition 2 m of drift vanish: targets before and after keep their names"
    places = street()
    grown = np.where(places[:, 1] < 400.0, places[:, 1] / 400.0 * 2.0, 0.0)
    seen = places + np.outer(grown, [0.8, -0.6, 0.0])
    found = match(observations(seen), control_points(places), trajectory(METRE))
    assert found.matched.name == control_points(places).name


def test_every_observation_and_control_point_is_accounted_for():
    "Unseen control, observations without control: each left over has a reason, none is both"
    places = street()
    surveyed = control_points(places[:25])
    seen = observations(places[5:])
    found = match(seen, surveyed, trajectory())
    assert found.matched.name == surveyed.name[5:]
    assert [refusal.name for refusal in found.refusals] == list(surveyed.name[:5])
    assert len(found.reasons) == len(found.unmatched) == 5
    assert all("No surveyed point remains" in reason for reason in found.reasons)


def small_chain(rng):
    "Four observations with two pairs each, one belief, a straight drive"
    time = START + np.array([0.0, 4.0, 9.0, 10.0])
    truth = np.array([0.3, -0.2, 0.1])
    control = np.array([0, 1, 1, 2, 3, 4, 4, 5])
    misclosure = truth + rng.normal(0, 0.15, (8, 3))
    misclosure[1::2] += rng.normal(0, 0.5, (4, 3))
    pairs = CandidatePairs(
        np.arange(0, 9, 2), control, misclosure, np.array([1, 1, 1, 0, 1, 1, 1, 1], bool)
    )
    return Chain(
        gps_time=time,
        pass_number=np.ones(4, int),
        forward=np.tile([0.0, 1.0], (4, 1)),
        gain=np.tile([0.5, 0.4, 0.3, 0.5], (1, 1)).reshape(1, 4, 1) * np.ones(3),
        noise=np.full((1, 4, 3), 0.05**2),
        otherwise=np.full(4, np.log(1e-3)),
        rate=np.array([np.sqrt(3.0) / CORRELATION_TIME]),
        segment=np.zeros(4, int),
        pairs=pairs,
        pair_variance=np.full((8, 3), 0.01**2),
        moved_share=np.full(8, SETTINGS.moved_share),
    )


def by_enumeration(chain):
    "Probabilities of the pairs from every assignment and every set of restarts, with dense normals"
    total = {"sound": np.zeros(8), "moved": np.zeros(8), "all": 0.0}
    stays = np.exp(-np.diff(chain.gps_time) / SETTINGS.restart_time)
    lag = chain.gps_time[:, None] - chain.gps_time
    gain = chain.gain[0, :, 0]
    for restarts in itertools.product([False, True], repeat=3):
        part = np.append(0, np.cumsum(restarts))
        chance = np.prod(np.where(restarts, 1 - stays, stays))
        same = (part[:, None] == part) * Covariance("matern32", CORRELATION_TIME)(lag)
        signal = SETTINGS.constant_sigma**2 + np.outer(gain, gain) * same
        for choice in itertools.product(range(5), repeat=4):  # two sound, two moved, none
            weight = chance * density(chain, np.array(choice), signal)
            total["all"] += weight
            for row, one in enumerate(choice):
                if one < 4:
                    total["sound" if one < 2 else "moved"][2 * row + one % 2] += weight
    return total["sound"] / total["all"], total["moved"] / total["all"]


def density(chain, choice, signal):
    "Density of the misclosures under one assignment; zero where it uses a point twice in a visit"
    rows = np.flatnonzero(choice < 4)
    pair = 2 * rows + choice[rows] % 2
    is_moved = choice[rows] >= 2
    control = chain.pairs.control[pair]
    time = chain.gps_time[rows]
    twice = (control[:, None] == control) & (abs(time[:, None] - time) <= 2.0)
    alike = chain.pairs.same[pair]
    if (twice.sum() > len(rows)) or (is_moved & ~alike).any():
        return 0.0
    moved = SETTINGS.moved_share
    exchanged = SETTINGS.exchanged_share
    share = np.where(is_moved, moved, np.where(alike, (1 - moved) * (1 - exchanged), exchanged))
    weight = np.prod(share) * np.exp(chain.otherwise[choice == 4].sum())
    own = np.diag(0.05**2 + 0.01**2 + SETTINGS.moved_sigma**2 * is_moved)
    covariance = 2 * np.pi * (signal[np.ix_(rows, rows)] + own)
    values = chain.pairs.misclosure[pair]
    square = 2 * np.pi * np.sum(values * np.linalg.solve(covariance, values))
    return weight * np.exp(-0.5 * square) * np.linalg.det(covariance) ** -1.5


@pytest.mark.parametrize("seed", range(3))
def test_marginals_equal_the_sum_over_all_assignments(seed):
    "Hypotheses followed both ways give what 5 000 assignments, each with its dense normal, sum to"
    chain = small_chain(np.random.default_rng(seed))
    found = marginals(chain)
    sound, moved = by_enumeration(chain)
    assert found.sound == pytest.approx(sound, abs=5e-3)
    assert found.moved == pytest.approx(moved, abs=5e-3)


WRITTEN = json.loads(Path(__file__).with_name("written_marginals.json").read_text())


@pytest.mark.parametrize("name", WRITTEN)
def test_marginals_stay_as_they_were_written_down(name):
    "Surveys with look-alikes: the probabilities of all pairs are those of plain numpy, to 1e-9"
    cause, seed, sigma = json.loads(name)
    made = matching_study.make(seed, cause, sigma)
    seen = made.observations[np.argsort(made.observations.gps_time, kind="stable")]
    pos = Pos()
    pose = made.trajectory.at(seen.gps_time)
    errors = PosErrors.stated(made.trajectory, pos)
    pairs = find_pairs(seen, made.control, SEARCH_RADIUS)
    found = marginals(build_chain(seen, made.control, pose, errors, pairs))
    assert found.sound == pytest.approx(WRITTEN[name]["sound"], rel=0.0, abs=1e-9)
    assert found.moved == pytest.approx(WRITTEN[name]["moved"], rel=0.0, abs=1e-9)


@pytest.mark.long
def test_no_wrong_match_in_surveys_with_blunders():
    "Mis-numbered and moved control, look-alikes, drift to 3 m: none wrong, few refused, all told"
    causes = ("outages", "sinusoids", "mems")
    counts = [
        matching_study.score(matching_study.make(seed, causes[seed % 3]))
        for seed in range(1000, 1005)
    ]
    right, refused, wrong, moved_used, moved, others_used, others, silent = np.sum(counts, axis=0)
    assert wrong == 0 and others_used == 0 and silent == 0
    assert right / (right + refused) > 0.98
    assert moved_used < 0.05 * moved
    assert others > 30


def test_past_and_future_that_know_nothing_leave_the_prior():
    "Their prior counts once, and the weight is that of certainty"
    chain = small_chain(np.random.default_rng(1))
    both = join(start(chain), start(chain), chain)
    assert both.covariance == pytest.approx(np.tile(np.eye(3), (1, 3, 1, 1)))
    assert both.weight == pytest.approx([0.0], abs=1e-9)


def test_a_future_that_knows_nothing_leaves_the_past():
    "Mean, covariance and weight of the past's hypotheses come back"
    chain = small_chain(np.random.default_rng(1))
    past = predict(use(start(chain), chain, 0), chain, 0, 1)
    both = join(past, start(chain), chain)
    assert both.weight == pytest.approx(past.weight)
    assert both.mean == pytest.approx(past.mean)
    assert both.covariance == pytest.approx(past.covariance)


def test_one_point_in_use_on_both_sides_is_a_clash():
    "Point 4 a second before and a second after: one of the two is something else"
    chain = small_chain(np.random.default_rng(1))
    chain = chain._replace(gps_time=chain.gps_time[0] + np.array([0.0, 9.0, 9.5, 10.5]))
    past = predict(use(start(chain), chain, 2), chain, 2, 1)
    future = predict(use(start(chain), chain, 3), chain, 3, 1)
    both = join(past, future, chain)
    twice = (both.used[:, 0] == 4) & (both.used[:, 1] == 4)
    assert twice.any()
    assert both.weight[twice].max() < both.weight[~twice].max() - 16.0
