"""New weights, and each observation left out, without solving all anew."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import (
    Noise,
    collocate_by_knots,
    collocate_rows_dense,
    leave_each_out,
    reweight,
)
from tests.collocation.linked_rows import Street

STREET = Street("matern32", 60.0, targets=5, ties=30)
SOLVED = collocate_by_knots(STREET.rows)


def test_weights_divide_the_variance_of_the_noise():
    "Reweighted, and solved with that noise from the start: the same to 1e-9"
    weights = [np.full(10, 1.0), np.random.default_rng(1).uniform(0.01, 2.0, 30)]
    control, ties = STREET.rows
    noise = Noise(ties.noise.own / weights[1][:, None, None])
    expected = collocate_by_knots([control, replace(ties, noise=noise)])
    solved = reweight(SOLVED, weights)
    assert solved.log_likelihood == pytest.approx(expected.log_likelihood, abs=1e-9)
    for here, there in zip(STREET.predict(solved), STREET.predict(expected), strict=True):
        assert np.abs(here - there).max() < 1e-9


def test_means_alone_are_those_with_sigmas():
    "Means alone are those that come with covariances, to the last digit"
    solved = collocate_by_knots(STREET.rows)
    mean = solved.predict_mean(*STREET.asked_rows)
    assert (mean == solved.predict(*STREET.asked_rows)[0]).all()
    dense = collocate_rows_dense(STREET.rows)
    assert (dense.predict_mean(*STREET.asked_rows) == STREET.predict(dense)[0]).all()


def test_a_millionth_of_weight_leaves_a_wrong_tie_out():
    "A tie that is wrong by 5 m moves the result by less than 0.1 mm"
    control, ties = STREET.rows
    wrong = ties.misclosure.copy()
    wrong[7] += 5.0
    weights = [np.ones(10), np.ones(30)]
    weights[1][7] = 1e-10
    with_wrong = reweight(collocate_by_knots([control, replace(ties, misclosure=wrong)]), weights)
    without = reweight(SOLVED, weights)
    assert np.abs(STREET.predict(with_wrong)[0] - STREET.predict(without)[0]).max() < 1e-4
    with pytest.raises(ValueError, match="1 of 30 weights are not positive"):
        reweight(SOLVED, [np.ones(10), np.append(np.ones(29), 0.0)])


def test_redundancy_numbers_say_what_a_residual_shows_of_an_error():
    "An error of a tie shows in its residual by its redundancy number: R V^-1 less the trend's part"
    left_out = leave_each_out(SOLVED)
    control, ties = STREET.rows
    wrong = ties.misclosure.copy()
    wrong[3] += 1.0
    moved = collocate_by_knots([control, replace(ties, misclosure=wrong)])
    residual = ties.noise.own.ravel() * (moved.weights - SOLVED.weights)[30:]
    assert left_out[1].redundancy[3, 0] == pytest.approx(residual[3], abs=1e-6)
    assert ((left_out[1].redundancy > 0) & (left_out[1].redundancy < 1)).all()


def test_an_observation_that_holds_the_trend_has_nothing_to_be_compared_with():
    "Of a single target no other tells the datum: not a number"
    control, _ = STREET.rows
    alone = replace(
        control,
        gps_time=control.gps_time[:1],
        misclosure=control.misclosure[:1],
        noise=control.noise.select([0]),
        design=control.design[:1],
        signals=[replace(s, mixing=s.mixing[:1]) for s in control.signals],
    )
    assert np.isnan(leave_each_out(collocate_by_knots([alone]))[0].residual).all()
