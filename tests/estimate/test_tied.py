"""Ties beside control points: what they add, which of them hold, and what they can't tell."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import (
    TieResiduals,
    estimate_correction,
    previewed_correction,
    prior_correction,
    tie_factor,
    with_ties,
)
from mlscorr.estimate.tied import sample
from mlscorr.ties import weigh_by_time
from tests.beds.tied_passes import tied_passes


def rms(left):
    "Root mean square of the length of vectors (n, 3). Units: m"
    return float(np.sqrt(np.mean(np.sum(left**2, axis=1))))


def corrected(survey):
    "Estimates by control alone, and with ties"
    alone = estimate_correction(survey.trajectory, survey.matched)
    return alone, with_ties(alone, survey.ties)


@pytest.fixture(scope="module")
def clean():
    survey = tied_passes(1)
    return survey, *corrected(survey)


def test_ties_carry_control_to_a_pass_without_any(clean):
    "Five points in one pass: 1 cm remains of decimetres in the pass back, within its sigmas"
    survey, alone, tied = clean
    back = survey.trajectory.gps_time > survey.trajectory.passes[1, 0]
    assert rms(survey.left(alone.correction)[back]) > 0.15  # m
    left = survey.left(tied.correction)[back]
    assert rms(left) < 0.015  # m
    sigma = tied.correction.corrected.position_sigma[back]
    assert np.mean(np.abs(left) < 2 * sigma) > 0.88


def test_ties_help_the_pass_that_has_control(clean):
    "Between control points the drift of both passes together is known better than of either"
    survey, alone, tied = clean
    there = survey.trajectory.gps_time <= survey.trajectory.passes[0, 1]
    before, after = (rms(survey.left(e.correction)[there]) for e in (alone, tied))
    assert after < 1.1 * before


def test_residuals_are_those_of_the_noise(clean):
    "Residuals of ties are their noise of 4 mm, and ties are refused only by chance"
    _, _, tied = clean
    assert tied.ties.used.mean() > 0.98
    assert np.sqrt(np.mean(tied.ties.after[tied.ties.used] ** 2)) == pytest.approx(0.004, rel=0.2)
    assert tied.ties.statements == ()


def test_wrong_ties_are_refused(clean):
    "A fifth wrong by 0.1 to 0.5 m costs less than a fifth of the accuracy"
    survey = tied_passes(1, wrong=0.2)
    _, tied = corrected(survey)
    wrong = np.abs(tied.ties.after) > 0.05  # m
    assert wrong.mean() == pytest.approx(0.2, abs=0.07)
    assert not tied.ties.used[wrong].any()
    expected = rms(clean[0].left(clean[2].correction))
    assert rms(survey.left(tied.correction)) < 1.2 * expected + 0.001  # m


def test_without_control_passes_agree_and_nothing_more_is_claimed():
    "Ties alone: passes agree to millimetres, the sigmas are still those of the POS"
    survey = tied_passes(2, control=())
    tied = with_ties(prior_correction(survey.trajectory), survey.ties)
    assert np.median(np.abs(survey.ties.misclosure)) > 0.1  # m
    assert np.median(np.abs(tied.ties.after)) < 0.005  # m
    sigma = np.linalg.norm(tied.correction.corrected.position_sigma, axis=1)
    assert np.median(sigma) > 0.1  # m
    assert "relative only" in [warning.key for warning in tied.statements]
    assert tied.alternatives == ()
    assert tied.support.contains(survey.trajectory.gps_time).all()


@pytest.mark.long
def test_a_wrong_control_point_is_named():
    "A point that is 0.4 m off is an outlier where ties hold its epoch to the other pass"
    times = (5.0, 15.0, 25.0, 35.0, 45.0, 55.0)
    survey = tied_passes(3, control=times)
    survey.matched.surveyed.position[2] += [0.25, 0.3, 0.0]  # m
    _, tied = corrected(survey)
    assert [outlier.name for outlier in tied.outliers] == ["T2"]
    (named,) = (s for s in tied.statements if s.key == "contradicts ties")
    assert (named.values["name"], named.values["is_used"]) == ("T2", False)
    assert rms(survey.left(tied.correction)) < 0.04  # m


@pytest.mark.long
def test_a_wrong_control_point_among_three_is_named_and_used():
    "Too few are left to tell which is wrong, so each that contradicts the ties has a warning"
    survey = tied_passes(3, control=(15.0, 30.0, 45.0), number=30)
    survey.matched.surveyed.position[1] += [0.25, 0.3, 0.0]  # m
    _, tied = corrected(survey)
    assert tied.outliers == ()
    assert tied.used.all()
    named = [s.values for s in tied.statements if s.key == "contradicts ties"]
    assert "T1" in [values["name"] for values in named]
    assert all(values["is_used"] for values in named)


@pytest.mark.long
def test_ties_that_contradict_each_other_are_not_used():
    "If more than half are wrong by up to meters, control alone decides, with a statement"
    survey = tied_passes(4, wrong=0.8, apart=3.0)
    alone, tied = corrected(survey)
    moved = tied.correction.corrected.position - alone.correction.corrected.position
    assert np.abs(moved).max() < 1e-9  # m
    assert tied.ties.statements[0].values == {"ties": 300}


@pytest.mark.long
def test_what_ties_of_a_second_share_is_held_down_by_their_weights():
    "An error of 1 cm per second harms a tenth less by weights, though more is left of the ties"
    harm = np.zeros((4, 2))
    residual = np.zeros((4, 2))
    for row, seed in enumerate((1, 2, 3, 4)):
        survey = tied_passes(seed, shared=0.01)
        alone = estimate_correction(survey.trajectory, survey.matched)
        for column, ties in enumerate((survey.ties, weigh_by_time(survey.ties))):
            correction = previewed_correction(alone, ties, with_sigmas=True)
            harm[row, column] = rms(survey.left(correction))
            after = TieResiduals.of(ties, np.ones(len(ties), bool), correction).after
            residual[row, column] = np.median(np.abs(after))
        sigma = correction.corrected.position_sigma
        assert np.mean(np.abs(survey.left(correction)) < 2 * sigma) > 0.92
    assert (harm[:, 1] < harm[:, 0]).all()
    assert harm[:, 1].mean() < 0.9 * harm[:, 0].mean()
    assert (residual[:, 0] < residual[:, 1]).all()


@pytest.mark.long
def test_order_of_ties_does_not_matter(clean):
    "Ties in any order give the same correction to 2 mm: other ones choose the parameters"
    survey, alone, tied = clean
    shuffled = survey.ties[np.random.default_rng(0).permutation(len(survey.ties))]
    other = with_ties(alone, shuffled).correction.corrected.position
    assert np.abs(other - tied.correction.corrected.position).max() < 2e-3  # m


def test_ties_that_choose_parameters_follow_the_time_in_which_they_were_seen():
    "A hundred of a street; of a city's drives a view along each axis of each interval; few rows"
    survey = tied_passes(1, number=6000)
    adjustment = estimate_correction(survey.trajectory, survey.matched).adjustment
    ties = tie_factor(adjustment.errors, survey.ties)
    chosen = []
    views = []
    for longer in (1, 10, 100):
        slower = replace(ties, gps_time=longer * ties.gps_time)
        few = sample(adjustment.with_factor(slower))
        intervals = longer * 2 * 58.0 / few.interval  # ties are 1 s from the ends of both passes
        chosen.append(len(few.ties))
        views.append(2 * len(few.ties) / 3 / intervals)
    assert chosen[0] == pytest.approx(100, rel=0.1)
    assert views[1] == pytest.approx(1.0, rel=0.1)
    assert views[2] < 0.5  # no more than can be solved quickly


def test_a_sample_of_ties_does_not_depend_on_the_origin_of_time():
    "The same ties are taken in week 2 300 of GPS as in the first"
    survey = tied_passes(1, number=6000)
    adjustment = estimate_correction(survey.trajectory, survey.matched).adjustment
    ties = tie_factor(adjustment.errors, survey.ties)
    slower = 10 * (ties.gps_time - ties.gps_time.min())
    taken = []
    for start in (0.0, 2300 * 604_800.0):
        later = adjustment.with_factor(replace(ties, gps_time=slower + start))
        taken.append(sample(later).ties.misclosure)
    np.testing.assert_array_equal(*taken)


@pytest.mark.long
def test_ties_do_not_outvote_control_that_agrees():
    "Facades 15 cm off, as by a turned scanner, against 16 good points: ties go, no point does"
    times = np.linspace(3.0, 57.0, 8)
    survey = tied_passes(1, control=(*times, *(times + 160.0)))
    facade = np.abs(survey.ties.direction[:, 1]) > 0.5
    alone = estimate_correction(survey.trajectory, survey.matched)
    ties = replace(survey.ties, misclosure=survey.ties.misclosure + 0.15 * facade)
    tied = with_ties(alone, ties)
    assert tied.outliers == () and not tied.ties.used.any()
    assert "no tie used" in [warning.key for warning in tied.statements]
    assert rms(survey.left(tied.correction)) < 0.02  # m


@pytest.mark.long
def test_without_control_a_shift_of_all_passes_stays_in_sigma():
    "GNSS states 2, 2 and 3 cm, which ties of both passes can't see: so much is claimed"
    survey = tied_passes(1)
    elapsed = survey.trajectory.gps_time - survey.trajectory.gps_time[0]
    raised = np.isin(elapsed // 10.0, (2.0, 19.0))[:, None]  # for 10 s of each pass
    sigma = np.where(raised, 1.0, [0.02, 0.02, 0.03])
    prior = prior_correction(replace(survey.trajectory, position_sigma=sigma))
    noise = 0.004 * np.random.default_rng(2).standard_normal(len(survey.ties))
    tied = with_ties(prior, replace(survey.ties, misclosure=noise))
    held = tied.correction.corrected.position_sigma[~raised[:, 0]]
    assert np.median(held, axis=0).min() > 0.02  # m
    assert tied.outliers == () and len(tied.adjustment.names) == 0
