"""Refused control points in numbers tell of a POS that drifts, a few of blunders."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logit

from mlscorr.estimate import SETTINGS, Objective, position_adjustment, position_prior
from mlscorr.estimate.judgement import judge
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.target_tests import Screening, single_test
from mlscorr.survey import Matched, Pos
from tests.beds.pos_errors import EPOCHS, Case, even, rms, waves

STRONG = np.log(SETTINGS.strong_evidence)


def bumped_case(count, times=None):
    "A POS that errs by millimetres, but by decimetres for 14 s at some of 20 targets"
    rng = np.random.default_rng(count)
    places = even(20)[1::4]
    error = waves(rng, 0.002)
    for centre in places[:count]:
        share = np.clip((EPOCHS - centre + 7.0) / 14.0, 0.0, 1.0)[:, None]
        error = error + np.sin(np.pi * share) ** 2 * rng.choice([-0.4, 0.4], 3)
    sigma = np.full_like(error, 0.02)
    return Case(EPOCHS, error, even(20) if times is None else times, rng, sigma), error


def odds_of(adjustment, names, known=0):
    "Log odds that some of the refused targets are right beside drift"
    objective = Objective.of(adjustment)
    mode = ((objective.parameters("matern32", objective.initial), 1.0),)
    posterior = Posterior(mode, mode)
    others = (adjustment.without(set(names) - {name}) for name in names)
    tests = (single_test(part, name, posterior) for part, name in zip(others, names, strict=True))
    judged = judge(adjustment, Screening(posterior, tuple(tests), (), ()), known)
    return float(logit(max(judged.probability.values())))


@pytest.mark.long
def test_many_lone_deviations_are_drift():
    "A quarter of the points off by 0.7 m: used and named, and 95 % within 1.96 sigma says so"
    case, error = bumped_case(5)
    estimate = case.estimate()
    remaining = case.remaining(estimate)
    within = np.abs(remaining) < 1.96 * estimate.correction.corrected.position_sigma
    assert not estimate.outliers
    assert rms(remaining) < 0.5 * rms(error) and within.mean() > 0.9
    drifts = [s for s in estimate.statements if s.key == "unstated drift"]
    named = [name for drift in drifts for name in drift.values["names"]]
    assert named == ["T02", "T06", "T10", "T14", "T18"]


@pytest.mark.long
def test_many_lone_deviations_are_followed_as_straight_lines_follow_them():
    "A POS that swings out by decimetres for 14 s at a quarter of the points: no worse than lines"
    case, error = bumped_case(5)
    time = case.recorded.gps_time
    misclosure = case.matched.misclosure.T
    lines = np.column_stack([np.interp(time, case.matched.gps_time, axis) for axis in misclosure])
    assert rms(case.remaining(case.estimate())) < 1.05 * rms(error - lines)


@pytest.mark.long
def test_sigma_is_larger_where_refused_points_may_show_drift():
    "Three of 20 refused, drift as probable: 95 % of the drift beside them within 1.96 sigma"
    case, _ = bumped_case(3)
    estimate = case.estimate()
    refused = [case.control.name.index(outlier.name) for outlier in estimate.outliers]
    assert len(refused) == 3
    sigma = estimate.correction.corrected.position_sigma
    away = np.abs(EPOCHS[:, None] - even(20)).argmin(axis=1)
    is_beside = np.isin(away, refused)
    within = np.abs(case.remaining(estimate)) < 1.96 * sigma
    assert within[is_beside].mean() > 0.9 and within[~is_beside].mean() > 0.9
    is_far = ~np.isin(away, np.add.outer(refused, [-1, 0, 1]))
    assert np.median(sigma[is_far]) < 0.02  # m


def test_two_lone_deviations_of_twenty_are_blunders_rather():
    "More of them, or drift that was seen elsewhere in the drive, turn the odds"
    names = ["T02", "T06", "T10", "T14", "T18"]
    odds = [odds_of(bumped_case(count)[0].adjustment(), names[:count]) for count in (1, 2, 3, 5)]
    assert odds[1] < 0.0 < odds[2] < STRONG < odds[3]
    assert odds[0] < odds[1]
    assert odds_of(bumped_case(2)[0].adjustment(), names[:2], known=1) > STRONG


def test_a_target_beside_one_that_is_right_is_wrong():
    "Observations within a second share their drift: a lone deviation there is no drift"
    times = np.sort(np.append(even(20)[:-1], even(20)[1:18:4] + 0.6))
    case, _ = bumped_case(0, times)
    names = []
    for number in np.flatnonzero(np.diff(times) < 1.0):
        case.spoil(number, [0.4, -0.4, 0.4])
        names.append(case.control.name[number])
    assert len(names) == 5
    assert odds_of(case.adjustment(), names) < -STRONG


def test_a_target_that_deviates_alike_in_two_passes_is_wrong():
    "One error in both is likelier than two drifts that happen to be equal"
    times = even(20)
    case, _ = bumped_case(0, times)
    names = (*case.control.name[:10], *case.control.name[:10])
    odds = []
    for second in (1.0, -1.0):
        place = case.observations.position.copy()
        place[[1, 11]] += np.outer([1.0, second], [0.4, -0.4, 0.4])
        looked = replace(case.observations, position=place, name=names)
        matched = Matched(looked, replace(case.control, name=names))
        adjustment = position_adjustment(case.recorded, matched, Pos(), 0, position_prior)
        odds.append(odds_of(adjustment, ["T02"]))
    assert odds[0] < odds[1] - STRONG


@pytest.mark.parametrize("end", [0, -1])
def test_a_target_at_an_end_of_the_pass_is_judged_as_any_other(end):
    "A lone deviation in the first or last epoch of the recording is a blunder rather, too"
    times = even(20)
    times[end] = EPOCHS[end]
    case, _ = bumped_case(0, times)
    number = range(20)[end]
    case.spoil(number, [0.4, -0.4, 0.4])
    assert -STRONG < odds_of(case.adjustment(), [case.control.name[number]]) < 0.0
