"""Sparse rows solved in information form: what they share, what is refused, what is smooth."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import Covariance, Noise, Signal, SparseRows, collocate_by_knots
from tests.collocation.linked_rows import LENGTH, START, Street


def test_least_squares_needs_no_signal():
    "Without signals the trend is the mean, and its sigma that of the mean of all rows"
    n = 10
    none = []
    rows = SparseRows(
        START + np.arange(n)[:, None],
        np.full((n, 1), 0.3),
        Noise(np.full((n, 1, 1), 1e-4)),
        np.ones((n, 1, 1)),
        none,
    )
    solved = collocate_by_knots([rows])
    assert solved.trend == pytest.approx([0.3])
    assert np.sqrt(solved.trend_covariance) == pytest.approx(0.01 / np.sqrt(n))


def test_many_passes_of_a_target_share_its_survey_error():
    "A hundred passes of a target surveyed to 2 cm leave 2 cm, and cost no dense matrix"
    n = 100
    unit = np.ones((n, 1, 1))
    noise = Noise(1e-8 * unit, np.zeros(n, int), np.full((1, 1), 0.02))
    signal = Signal(1e-6 * unit, Covariance("matern32", 30.0))
    rows = SparseRows(START + np.arange(n)[:, None], np.ones((n, 1)), noise, unit, [signal])
    solved = collocate_by_knots([rows])
    assert solved.trend == pytest.approx([1.0], abs=1e-6)
    assert np.sqrt(solved.trend_covariance) == pytest.approx(0.02, rel=1e-3)


def test_the_order_of_rows_and_the_origin_of_time_do_not_matter():
    "Shuffled and a day later: the same to 1e-6 m"
    street = Street("matern32", 60.0, seed=3)
    before = street.predict(collocate_by_knots(street.rows))[0]
    order = np.random.default_rng(1).permutation(street.ties)
    control, ties = street.rows
    sides = (2 * order[:, None] + [0, 1]).ravel()
    shuffled = SparseRows(
        ties.gps_time[order],
        ties.misclosure[order],
        ties.noise.select(order),
        ties.design[order],
        [replace(signal, mixing=signal.mixing[sides]) for signal in ties.signals],
    )
    later = [replace(rows, gps_time=rows.gps_time + 86_400.0) for rows in (control, shuffled)]
    street.asked = street.asked + 86_400.0
    assert np.abs(street.predict(collocate_by_knots(later))[0] - before).max() < 1e-6


def test_a_likelihood_on_the_same_knots_is_smooth():
    "Second differences over steps of a thousandth of the correlation time are below 1e-3"
    base = collocate_by_knots(Street("matern52", 60.0).rows)
    street = Street("matern52", 60.0)
    values = []
    for time in 60.0 * (1 + 1e-3 * np.arange(5)):
        street.time = time
        values.append(collocate_by_knots(street.rows, base.solver).log_likelihood)
    assert np.abs(np.diff(values, 2)).max() < 1e-3


def test_knots_too_close_are_refused_in_a_sentence():
    "Matern 5/2 of an hour on knots for a twentieth of a second: no silent loss of digits"
    n = 3000
    gps_time = START + np.linspace(0.0, LENGTH, n)[:, None]
    unit = np.ones((n, 1, 1))

    def rows(time):
        signal = Signal(unit, Covariance("matern52", time))
        return [SparseRows(gps_time, np.zeros((n, 1)), Noise(1e-4 * unit), unit, [signal])]

    fine = collocate_by_knots(rows(1.0))
    with pytest.raises(ValueError, match=r"signal 1 \(matern52, 3600 s\) at a"):
        collocate_by_knots(rows(3600.0), fine.solver)
    assert np.isfinite(collocate_by_knots(rows(3600.0)).log_likelihood)


def test_what_cannot_be_solved_is_refused_in_a_sentence():
    "No number, no noise, no rank, weights of nothing, and knots of other rows are named"
    street = Street("exponential", 60.0)
    control, ties = street.rows
    solved = collocate_by_knots([control, ties])
    wrong = ties.misclosure.copy()
    wrong[4] = np.nan
    with pytest.raises(ValueError, match="1 of 60 observation epochs have a time, misclosure"):
        collocate_by_knots([control, replace(ties, misclosure=wrong)])
    with pytest.raises(ValueError, match="60 misclosures is not positive definite"):
        collocate_by_knots([control, replace(ties, noise=Noise(np.zeros((60, 1, 1))))])
    with pytest.raises(ValueError, match="60 misclosures do not determine 3 trend"):
        collocate_by_knots([ties])
    with pytest.raises(ValueError, match="72 observations refer to other epochs"):
        collocate_by_knots([control, replace(ties, gps_time=ties.gps_time[::-1])], solved.solver)


def test_no_tie_at_all_changes_nothing():
    "Control with an empty set of ties is control alone"
    street = Street("integrated", 60.0)
    control, ties = street.rows
    signals = [
        replace(s, mixing=s.mixing[:0], clock=None if s.clock is None else s.clock[:0])
        for s in ties.signals
    ]
    empty = SparseRows(
        ties.gps_time[:0],
        ties.misclosure[:0],
        ties.noise.select(slice(0)),
        ties.design[:0],
        signals,
    )
    solved = collocate_by_knots([control, empty])
    alone = collocate_by_knots([control])
    assert solved.log_likelihood == pytest.approx(alone.log_likelihood, abs=1e-9)
    assert np.abs(street.predict(solved)[0] - street.predict(alone)[0]).max() < 1e-9
