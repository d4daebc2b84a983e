"""Knots stand as far apart as what the rows between them tell allows."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import Noise, collocate_by_knots
from mlscorr.collocation._knots import knot_step
from mlscorr.collocation.linked import LARGEST_SHARE, sufficient_steps
from mlscorr.estimate import SETTINGS
from tests.collocation.joint_states import ALL_FAMILIES
from tests.collocation.linked_rows import Street


@pytest.mark.parametrize(
    "tolerance, wider, apart", [(0.1, 0.02, 0.2), (SETTINGS.knot_tolerance, 0.03, 0.5)]
)
@pytest.mark.parametrize("time", [20.0, 100.0])
@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_fewer_knots_leave_the_result_and_its_sigmas(family, time, tolerance, wider, apart):
    "A half of what rows leave open moves positions by less than a tenth of a sigma, sigmas by 3 %"
    street = Street(family, time, ties=400)
    exact, fewer = (collocate_by_knots(street.rows, tolerance=each) for each in (0.0, tolerance))
    most = 1.0 if family == "exponential" else 0.8  # a metre of it needs a knot at each epoch
    assert fewer.solver.pattern.states <= most * exact.solver.pattern.states
    (mean, sigma), (there, spread) = street.predict(exact), street.predict(fewer)
    assert (np.abs(there - mean) / sigma).max() < 0.1
    assert spread == pytest.approx(sigma, rel=wider)
    assert fewer.log_likelihood == pytest.approx(exact.log_likelihood, abs=apart)


def test_without_tolerance_steps_are_those_of_the_signal_alone():
    "Whatever rows tell, r is the same share of each signal's sigma"
    rows = Street("matern32", 60.0).rows
    expected = [knot_step(signal.covariance) for signal in rows[0].signals]
    assert sufficient_steps(rows, 0.0) == expected
    assert sufficient_steps(rows[1:], 0.0) == expected


def test_more_noise_and_fewer_rows_need_fewer_knots():
    "Ten times the noise, or a tenth of the ties, lets smooth signals do with longer steps"
    street = Street("matern32", 60.0, ties=1000)
    ties = street.rows[1:]
    some = Street("matern32", 60.0, ties=100).rows[1:]
    noisy = [replace(ties[0], noise=Noise(100.0 * ties[0].noise.own))]
    steps = np.array(sufficient_steps(ties, 0.1))
    for other in (noisy, some):
        assert (np.array(sufficient_steps(other, 0.1)) > steps)[[0, 2]].all()
    largest = [knot_step(signal.covariance, LARGEST_SHARE) for signal in ties[0].signals]
    assert (
        sufficient_steps([replace(ties[0], noise=Noise(1e9 * ties[0].noise.own))], 0.1) == largest
    )


def test_what_no_row_sees_needs_the_fewest_knots():
    "A signal that no row tells of has the largest steps, and no row at all is no error"
    rows = Street("matern52", 60.0).rows
    hidden = [
        replace(
            part,
            signals=[
                *part.signals[:-1],
                replace(part.signals[-1], mixing=0 * part.signals[-1].mixing),
            ],
        )
        for part in rows
    ]
    last = rows[0].signals[-1].covariance
    assert sufficient_steps(hidden, 0.1)[-1] == knot_step(last, LARGEST_SHARE)
