"""Gross errors in control, what the control points can't tell, and input that is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Objective, estimate_correction
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.target_tests import _doubtful_pairs
from mlscorr.survey import Matched
from tests.beds import lying_pos
from tests.beds.pos_errors import (
    CONSTANT,
    EPOCHS,
    Case,
    even,
    outage_case,
    rms,
    smooth_case,
)


@pytest.mark.long
def test_two_wrong_control_points_do_not_hide_each_other():
    "Two of 16 wrong by 0.5 m at once, in any directions: both named in 3 of 4 surveys, no other"
    both = 0
    others = 0
    for seed in range(4):
        rng = np.random.default_rng([seed, 1])
        case = smooth_case(seed)
        numbers = rng.choice(16, 2, replace=False)
        for number in numbers:
            vector = rng.normal(size=3)
            case.spoil(number, 0.5 * vector / np.linalg.norm(vector))
        wrong = {case.control.name[number] for number in numbers}
        estimate = case.estimate()
        named = {outlier.name for outlier in estimate.outliers}
        both += wrong == named
        others += len(named - wrong)
        for outlier in estimate.outliers:
            assert outlier.statistic > outlier.critical
    assert both >= 3 and others == 0


@pytest.mark.long
def test_a_fifth_of_the_control_points_may_be_wrong():
    "Three of 16 wrong: the result is that of the 13 good ones, to a millimetre"
    differences = []
    for seed in range(2):
        rng = np.random.default_rng([seed, 3])
        case = smooth_case(seed, sigma=0.05)
        numbers = rng.choice(np.arange(1, 15), 3, replace=False)
        good = np.setdiff1d(np.arange(16), numbers)
        clean = estimate_correction(case.recorded, case.matched[good])
        for number in numbers:
            case.spoil(number, rng.choice([-1, 1], 3) * rng.uniform(0.2, 0.5, 3))
        moved = case.estimate().correction.corrected.position
        differences.append(rms(moved - clean.correction.corrected.position))
    assert max(differences) < 1e-3  # m


@pytest.mark.long
def test_neighbours_wrong_together_are_rejected_or_told():
    "Two targets in turn wrong by one vector never pass as drift without a sentence"
    for seed in range(3):
        case = smooth_case(seed, sigma=0.05)
        case.observations = case.observations[np.argsort(case.observations.gps_time)]
        first = 3 + seed
        for name in case.observations.name[first : first + 2]:
            case.spoil(case.control.name.index(name), [0.3, 0.2, -0.3])
        estimate = case.estimate()
        wrong = set(case.observations.name[first : first + 2])
        named = {outlier.name for outlier in estimate.outliers}
        assert wrong <= named or any(s.key.startswith("neighbours") for s in estimate.statements)


@pytest.mark.long
def test_a_target_that_is_wrong_in_one_of_two_passes_is_found_among_many():
    "Of 60 targets, each seen again 120 s later, the second look at one is off by 0.3 m: it goes"
    rng = np.random.default_rng(3)
    first = np.linspace(3.0, 117.0, 60)
    error = np.tile([0.1, -0.05, 0.03], (len(lying_pos.TIME), 1))
    looks = lying_pos.survey(rng, error, np.append(first, first + 120.0))
    names = 2 * looks[1].observations.name[:60]
    place = looks[1].observations.position + np.outer(np.arange(120) == 67, [0.3, 0.0, 0.0])
    observations = replace(looks[1].observations, name=names, position=place)
    matched = Matched(observations, replace(looks[1].surveyed, name=names))
    estimate = estimate_correction(looks[0], matched)
    assert [outlier.name for outlier in estimate.outliers] == ["T07"]
    assert len(estimate.tests) == 59 and {len(test.w) for test in estimate.tests} == {2}
    moved = estimate.correction.corrected.position - looks[0].position
    assert np.abs(moved - error).max() < 0.02  # m


@pytest.mark.long
def test_a_bias_that_the_pos_does_not_state_is_corrected_beside_one_that_it_does():
    "0.3 m that come and go over 30 s, under a sigma of 1.5 cm that knows of another place only"
    left = []
    for seed in range(3):
        case = outage_case(seed)
        bump = np.exp(-0.5 * ((EPOCHS - 160.0) / 20.0) ** 2)[:, None] * [0.2, -0.1, 0.3]
        rng = np.random.default_rng(seed)
        error = case.true.position - case.recorded.position + bump
        case = Case(EPOCHS, error, even(20), rng, case.recorded.position_sigma)
        left.append(rms(case.remaining(case.estimate())[EPOCHS > 130]))
    assert np.median(left) < 0.02  # m


def test_attitude_errors_larger_than_stated_are_found():
    "0.1 deg of heading where 0.02 are stated: position to 2 cm though targets are 14 m away"
    sigma = np.radians(np.tile([0.01, 0.01, 0.02], (len(EPOCHS), 1)))
    turn = np.radians(np.tile([0.0, 0.0, 0.1], (len(EPOCHS), 1)))
    rng = np.random.default_rng(1)
    stated = np.full((len(EPOCHS), 3), 0.01)
    case = Case(EPOCHS, CONSTANT, even(16), rng, stated, turn, sigma)
    estimate = case.estimate()
    assert estimate.parameters.attitude_scale > 1.5
    assert rms(case.remaining(estimate)) < 0.02  # m


def test_targets_of_very_many_passes_have_no_neighbour_in_their_block():
    "Seven seen 90 times each are a block each: no two are doubted together, and nothing breaks"
    times = np.repeat(even(7), 90) + np.tile(np.linspace(0.0, 1.5, 90), 7)
    case = Case(EPOCHS, 0.0 * CONSTANT, times, np.random.default_rng(1))
    names = tuple(f"T{i}" for i in range(7))
    case.control = replace(case.control[np.arange(0, 630, 90)], name=names)
    case.observations = replace(case.observations, name=tuple(np.repeat(names, 90).tolist()))
    adjustment = case.adjustment()
    objective = Objective.of(adjustment)
    assert [len(block.target_rows) for block in objective.blocks] == [1] * 7
    known = ((objective.parameters("exponential", objective.initial), 1.0),)
    assert list(_doubtful_pairs(adjustment, Posterior(known, known))) == []


def test_a_target_that_the_user_keeps_is_never_rejected():
    "Off by 0.5 m, it is rejected; kept in, it is used, and its test still says so"
    case = smooth_case(0)
    case.spoil(5, [0.5, 0.0, 0.0])
    assert [outlier.name for outlier in case.estimate().outliers] == ["T06"]
    kept = case.estimate(kept_in=("T06",))
    assert "T06" not in [outlier.name for outlier in kept.outliers]
    (test,) = [test for test in kept.tests if test.name == "T06"]
    assert test.excess > 1.0
