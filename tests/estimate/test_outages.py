"""A POS that doesn't state when it drifts: its re-acquisitions and the control points do."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.baselines import fit_linear
from mlscorr.estimate import (
    estimate_correction,
    position_adjustment,
    position_prior,
    with_drift_history,
    with_ties,
)
from mlscorr.estimate.adjustment import with_reacquisitions
from mlscorr.estimate.factors import REACQUISITION
from mlscorr.survey import Matched, Pos, Ties
from tests.beds.lying_pos import START, TIME, survey, walk
from tests.beds.pos_errors import EPOCHS, Case, outage

BELIEVED = Pos(position_sigma=0.5)  # m, without any sigma column


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


EVEN = np.linspace(3.0, 237.0, 16)


@pytest.fixture(scope="module")
def outages():
    "Four drives with an outage from 80 to 140 s that no sigma states: (error, matched, estimate)"
    cases = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        error = walk(rng, 80.0, 140.0)
        trajectory, matched = survey(rng, error, EVEN)
        cases.append((error, matched, estimate_correction(trajectory, matched, BELIEVED)))
    return cases


def test_drift_that_no_sigma_states_is_corrected(outages):
    "A tenth of the raw error or less is left in the median, and no control point is an outlier"
    shares = []
    for error, _, estimate in outages:
        corrected = estimate.correction.corrected.position
        shares.append(rms(error - (corrected - estimate.correction.recorded.position)) / rms(error))
        assert not estimate.outliers
    assert np.median(shares) < 0.1


def test_its_sigma_is_honest(outages):
    "Over the drives 88 % or more of the true errors lie within 1.96 sigmas"
    within = []
    for error, _, estimate in outages:
        corrected = estimate.correction.corrected
        left = error - (corrected.position - estimate.correction.recorded.position)
        within.append(np.mean(np.abs(left) < 1.96 * corrected.position_sigma))
    assert np.mean(within) > 0.88


@pytest.mark.long
def test_a_solution_that_is_not_fixed_errs_by_what_it_states():
    "0.4 m from 50 to 110 s and from 150 to 190 s: less is left than linear interpolation leaves"
    left = []
    plain = []
    within = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        error = walk(rng, 0.0, 0.0)
        sigma = np.full((len(TIME), 3), 0.02)
        for begin, end in ((50.0, 110.0), (150.0, 190.0)):
            inside = (begin <= TIME) & (end > TIME)
            waves = np.sin(TIME[inside, None] / 25.0 + rng.uniform(0, 6, 3))
            error[inside] = 0.4 * rng.normal(size=3) + 0.2 * waves
            sigma[inside] = 0.4
        trajectory, matched = survey(rng, error, EVEN)
        trajectory = replace(trajectory, position_sigma=sigma)
        for fit, parts in ((fit_linear, plain), (corrected_by_estimate, left)):
            correction = fit(trajectory, matched)
            moved = correction.corrected.position - trajectory.position
            parts.append(rms(error - moved))
        within.append(np.mean(np.abs(error - moved) < 1.96 * correction.corrected.position_sigma))
    assert np.median(np.divide(left, plain)) < 0.9
    assert np.mean(within) > 0.88


def corrected_by_estimate(trajectory, matched):
    return estimate_correction(trajectory, matched).correction


def test_the_start_of_an_outage_is_found_between_control_points(outages):
    "Drift begins to grow within 25 s of the truth, and the path tells its end"
    for _, _, estimate in outages:
        errors = estimate.adjustment.errors
        assert errors.history.restarts == pytest.approx([START + 139.95], abs=0.3)
        assert errors.starts[0] == pytest.approx(START + 80.0, abs=25.0)


def test_control_in_a_smoothed_outage_leaves_the_rest_alone():
    "Two points in an outage whose sigma is a hump: beyond it less than 0.15 m in the median drive"
    left = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        error, sigma = outage(rng)
        case = Case(EPOCHS, error, np.array([80.0, 100.0]), rng, sigma)
        left.append(rms(case.remaining(case.estimate())[EPOCHS > 140.0]))
    assert np.median(left) < 0.15  # m


@pytest.mark.long
def test_nothing_that_control_does_not_tell_makes_the_head_surer_than_the_tail():
    "A constant error and sigma: 40 s before the first control are as open as 40 s after the last"
    error = np.tile([0.1, -0.05, 0.03], (len(TIME), 1))
    ends = []
    for times in (np.linspace(40.0, 237.0, 10), np.linspace(2.9, 199.9, 10)):
        trajectory, matched = survey(np.random.default_rng(0), error, times)
        stated = np.full((len(TIME), 3), 0.5)  # m
        trajectory = replace(trajectory, position_sigma=stated)
        estimate = estimate_correction(trajectory, matched)
        sigma = np.linalg.norm(estimate.correction.corrected.position_sigma, axis=1)
        ends.append(sigma[[0, -1]])
    head = ends[0][0]
    tail = ends[1][1]
    assert 0.7 < head / tail < 1.4
    assert head < 0.05  # m, where an error was the same for 200 s


@pytest.mark.long
def test_ties_tell_when_an_outage_began_where_no_control_point_does():
    "With control at both ends of the drive alone the start is found within 8 s in every drive"
    for seed in range(3):
        rng = np.random.default_rng(seed)
        error = walk(rng, 80.0, 140.0)
        trajectory, matched = survey(rng, error, EVEN[[0, 1, -2, -1]])
        alone = estimate_correction(trajectory, matched, BELIEVED)
        tied = with_ties(alone, ties_across(rng, error, trajectory, 400))
        assert tied.adjustment.errors.starts[0] == pytest.approx(START + 80.0, abs=8.0)
        left = [
            rms(error - (e.correction.corrected.position - trajectory.position))
            for e in (alone, tied)
        ]
        assert left[1] < 0.2 * left[0]


def ties_across(rng, error, trajectory, number):
    "Ties of what was seen before or in the outage and again after it, along E, N and H"
    first = np.sort(rng.uniform(5.0, 139.0, number))
    second = 235.0 - 0.6 * (first - 5.0)  # on the way back
    axis = np.eye(3)[rng.integers(3, size=number)]
    wrong = np.stack(
        [np.column_stack([np.interp(t, TIME, e) for e in error.T]) for t in (first, second)], axis=1
    )
    position = trajectory.at(START + first).position + np.array([0.0, 8.0, 2.0])
    return Ties(
        gps_time=START + np.column_stack([first, second]),
        place=np.stack([position, position], axis=1),
        direction=axis,
        misclosure=np.einsum("ni,ni->n", axis, wrong[:, 0] - wrong[:, 1])
        + 0.01 * rng.standard_normal(number),
        variance=np.full(number, 0.01**2),
        kind=np.full(number, "plane"),
        pass_number=np.ones((number, 2), int),
        scanner=np.zeros((number, 2), int),
        feature=np.arange(2 * number).reshape(number, 2),
    )


def test_a_step_tells_the_end_of_an_outage_without_control():
    "No control point in the last 40 s of an outage: its end is known to 10 cm all the same"
    rng = np.random.default_rng(7)
    error = walk(rng, 80.0, 140.0, 0.01)
    trajectory, matched = survey(rng, error, EVEN[(EVEN < 100.0) | (EVEN > 142.0)])
    corrected = estimate_correction(trajectory, matched, BELIEVED).correction.corrected
    last = np.searchsorted(TIME, 139.8)
    assert np.linalg.norm(error[last]) > 0.5  # m
    left = error[last] - (corrected.position - trajectory.position)[last]
    assert np.linalg.norm(left) < 0.1  # m


def test_a_step_into_an_error_does_no_harm():
    "A position that jumps away by 1 m and stays there is corrected to 2 cm on both sides"
    rng = np.random.default_rng(3)
    error = np.where(TIME[:, None] > 120.0, [0.8, -0.5, 0.3], 0.0) + walk(rng, 300.0, 300.0)
    trajectory, matched = survey(rng, error, EVEN)
    estimate = estimate_correction(trajectory, matched, BELIEVED)
    corrected = estimate.correction.corrected
    assert rms(error - (corrected.position - trajectory.position)) < 0.02  # m
    assert not estimate.outliers


def joined(trajectory, matched, after, away):
    "The same, with map coordinates that are elsewhere from a time on: no error steps with them"
    moved = (trajectory.gps_time > START + after)[:, None] * np.asarray(away)
    rows = np.searchsorted(trajectory.gps_time, matched.gps_time)
    observed = replace(matched.observations, position=matched.observations.position + moved[rows])
    surveyed = replace(matched.surveyed, position=matched.surveyed.position + moved[rows])
    return replace(trajectory, position=trajectory.position + moved), Matched(observed, surveyed)


def test_steps_that_control_contradicts_are_left_out():
    "The path steps by 3 m where control sees no error on either side: only the restart stays"
    rng = np.random.default_rng(3)
    error = walk(rng, 300.0, 300.0)
    times = np.sort(np.append(EVEN, [119.0, 119.5]))
    drive = survey(rng, error, times)
    trajectory, matched = joined(*drive, 119.65, [3.0, 0.0, 0.0])
    adjustment = position_adjustment(trajectory, matched, BELIEVED, 1, position_prior)
    history = adjustment.errors.history
    assert len(history.steps) == 1 and len(history.restarts) == 1
    with_step = with_reacquisitions(adjustment, history.steps)
    assert len(with_step.of_kind(REACQUISITION)) == 1
    assert with_drift_history(adjustment).of_kind(REACQUISITION) is None


def test_a_step_that_control_confirms_stays_beside_those_that_it_does_not():
    "A jump of a kilometre, the end of an outage, and a step that control contradicts: one is used"
    rng = np.random.default_rng(3)
    error = walk(rng, 80.0, 140.0)
    drive = survey(rng, error, np.sort(np.append(EVEN, [199.0, 199.5])))
    drive = joined(*drive, 40.0, [1000.0, 0.0, 0.0])
    trajectory, matched = joined(*drive, 199.65, [3.0, 0.0, 0.0])
    adjustment = position_adjustment(trajectory, matched, BELIEVED, 1, position_prior)
    assert len(adjustment.errors.history.steps) == 3
    steps = with_drift_history(adjustment).of_kind(REACQUISITION)
    assert steps.gps_time.mean() - START == pytest.approx(139.95, abs=0.3)  # s


def test_a_drive_joined_of_two_needs_no_step():
    "A jump of a kilometre is a restart, and nothing tells that the drift had grown to it"
    rng = np.random.default_rng(5)
    error = walk(rng, 300.0, 300.0)
    trajectory, matched = joined(*survey(rng, error, EVEN), 120.0, [1000.0, 0.0, 0.0])
    adjustment = position_adjustment(trajectory, matched, BELIEVED, 1, position_prior)
    assert len(adjustment.errors.history.steps) == 1
    assert with_drift_history(adjustment).of_kind(REACQUISITION) is None


def test_a_target_in_the_middle_of_a_step_has_it_in_its_noise():
    "GNSS returns just when a target is scanned: the target counts little and harms nothing"
    rng = np.random.default_rng(2)
    error = walk(rng, 80.0, 140.0, 0.02)
    trajectory, matched = survey(rng, error, np.sort(np.append(EVEN, 139.95)))
    adjustment = position_adjustment(trajectory, matched, BELIEVED, 1, position_prior)
    steps = adjustment.errors.history.steps
    inside = (matched.gps_time >= steps.before[0]) & (matched.gps_time <= steps.after[0])
    assert inside.sum() == 1
    noise = np.einsum("nii->n", adjustment.targets.noise.own)
    assert noise[inside][0] > 100 * noise[~inside].max()
