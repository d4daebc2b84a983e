"""Gross errors in control, what the control points can't tell, and input that is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from test_correction import (
    CONSTANT,
    EPOCHS,
    START,
    Case,
    even,
    outage_case,
    rms,
    smooth_case,
    waves,
)

from mlscorr.correction import estimate_correction
from mlscorr.evaluation import model_section
from mlscorr.survey import Trajectory


def test_two_wrong_control_points_do_not_hide_each_other():
    "Two of 16 wrong by 0.5 m at once, in any directions: both named in 3 of 4 surveys, no other"
    both, others = 0, 0
    for seed in range(4):
        rng, case = np.random.default_rng([seed, 1]), smooth_case(seed)
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


def test_a_fifth_of_the_control_points_may_be_wrong():
    "Three of 16 wrong: the result is that of the 13 good ones, to a millimetre"
    differences = []
    for seed in range(2):
        rng, case = np.random.default_rng([seed, 3]), smooth_case(seed, sigma=0.05)
        numbers = rng.choice(np.arange(1, 15), 3, replace=False)
        good = np.setdiff1d(np.arange(16), numbers)
        clean = estimate_correction(case.recorded, case.observations[good], case.control)
        for number in numbers:
            case.spoil(number, rng.choice([-1, 1], 3) * rng.uniform(0.2, 0.5, 3))
        moved = case.estimate().correction.corrected.position
        differences.append(rms(moved - clean.correction.corrected.position))
    assert max(differences) < 1e-3  # m


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
        assert wrong <= named or any("follow each other" in text for text in estimate.warnings)


def test_what_tests_state_is_what_they_find():
    "Over good surveys w is at most standard normal, redundancies lie in [0, 1]"
    w = []
    for seed in range(3):
        for test in smooth_case(seed).estimate().tests:
            w.append(test.w)
            assert ((test.redundancy > 0) & (test.redundancy < 1)).all()
            assert test.detectable == pytest.approx(4.13 * test.sigma, rel=0.01)
    assert 0.7 < rms(w) < 1.15


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


def test_orders_and_families_are_set_side_by_side():
    "Orders 0 to 3 in three families, probabilities sum to one, and the report has them all"
    estimate = smooth_case(2).estimate()
    pairs = {(one.order, one.parameters.family) for one in estimate.alternatives}
    assert len(pairs) == len(estimate.alternatives) == 12
    assert sum(one.probability for one in estimate.alternatives) == pytest.approx(1.0)
    section = model_section(estimate)
    assert {row["order"] for row in section["orders"]} == {0, 1, 2, 3}
    assert len(section["tests"]) == 16
    assert section["global_test"]["passed"]


def test_a_shift_needs_no_slope():
    "Where only a constant is wrong, order 0 is more probable than order 3"
    rng = np.random.default_rng(5)
    stated = np.full((len(EPOCHS), 3), 0.01)
    estimate = Case(EPOCHS, CONSTANT, even(12), rng, stated).estimate()
    share = [sum(a.probability for a in estimate.alternatives if a.order == n) for n in (0, 3)]
    assert share[0] > share[1]


def test_components_that_targets_cannot_tell_are_told():
    "Targets level beside the car tell roll and heading; pitch, about their line, isn't told"
    rng = np.random.default_rng(6)
    sigma = np.radians(np.full((len(EPOCHS), 3), 0.2))
    stated = np.full((len(EPOCHS), 3), 0.005)
    guards = Case(EPOCHS, CONSTANT, even(16), rng, stated, None, sigma).estimate().guards
    assert guards.determined[3:].tolist() == [True, False, True]
    assert guards.variance_ratio[4] > 0.7


def two_passes(case):
    "The same drive with 60 s less in the middle: a gap of the trajectory"
    keep = (EPOCHS < 70.0) | (EPOCHS > 130.0)
    old = case.recorded
    sigma = None if old.position_sigma is None else old.position_sigma[keep]
    return Trajectory(old.gps_time[keep], old.position[keep], old.attitude[keep], sigma)


def test_a_pass_without_control_is_named():
    "All control in the first of two passes: corrected, and the second is named with its times"
    case = Case(EPOCHS, CONSTANT, np.linspace(3.0, 65.0, 8), np.random.default_rng(7))
    estimate = estimate_correction(two_passes(case), case.observations, case.control)
    text = f"The pass from {START + 130.1:.1f} to {START + 200:.1f} s has no control point"
    assert any(sentence.startswith(text) for sentence in estimate.warnings)
    assert estimate.guards.passes_without_control == ((START + 130.1, START + 200.0),)


def test_a_long_gap_between_control_points_is_told():
    "120 s without a target in the middle of a drive are named"
    times = np.append(np.linspace(3, 35, 8), np.linspace(165, 197, 8))
    case = Case(EPOCHS, waves(np.random.default_rng(8)), times, np.random.default_rng(8))
    guards = case.estimate().guards
    assert np.diff(guards.gap) == pytest.approx(130.0)


@pytest.mark.parametrize(("times", "text"), [
    ([100.0, 150.0], "Only 2 control points take part"),
    (np.full(8, 100.0), "All 8 control points were seen within 0.0 s"),
])  # fmt: skip
def test_too_little_control_is_told(times, text):
    "A correction is given, and a sentence on what it can't know"
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(9))
    estimate = case.estimate()
    assert any(text in sentence for sentence in estimate.warnings)
    assert np.isfinite(estimate.correction.corrected.position).all()


@pytest.mark.parametrize("sigma", [-0.01, np.nan, 0.0])
def test_control_without_a_sigma_is_refused(sigma):
    "Negative, missing, or zero with a zero of its observation: one sentence with the name"
    case = smooth_case(1)
    stated = case.control.sigma.copy()
    stated[3] = sigma
    case.control = replace(case.control, sigma=stated)
    case.observations = replace(case.observations, covariance=np.zeros((16, 3, 3)))
    with pytest.raises(ValueError, match=r"1 of 16 observed control points .*first: T04"):
        case.estimate()


def test_negative_sigmas_of_the_pos_are_refused():
    "The number of epochs and the likely cause are told"
    case = smooth_case(1)
    sigma = case.recorded.position_sigma.copy()
    sigma[5:8] = -1.0
    case.recorded = replace(case.recorded, position_sigma=sigma)
    with pytest.raises(ValueError, match="3 of 2001 trajectory epochs have a negative"):
        case.estimate()


def test_sigmas_missing_in_part_are_filled_and_told():
    "Zeros over 10 s of a constant sigma: the same result as without them, and a sentence"
    case = smooth_case(1)
    expected = case.remaining(case.estimate())
    sigma = case.recorded.position_sigma.copy()
    sigma[500:600] = 0.0
    case.recorded = replace(case.recorded, position_sigma=sigma)
    estimate = case.estimate()
    assert case.remaining(estimate) == pytest.approx(expected, abs=1e-9)
    assert estimate.warnings[0].startswith("100 of 2001 trajectory epochs state a position_sigma")
