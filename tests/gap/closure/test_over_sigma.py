"""Errors over the sigma that the simulator gives them."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.closure.closure import OverSigma, errors_over_sigma
from mlscorr.gap.closure.folds import Folds
from mlscorr.gap.evidence import Observations, Predicted
from mlscorr.gap.residuals import background


def test_errors_that_are_simulated_are_about_one_sigma(late):
    "With the clock in the simulator no axis is beyond what chance makes"
    folds = late.folds(late.cause("time_offset"))
    errors = errors_over_sigma(late.rows, late.observations, folds, np.random.default_rng(1))
    assert errors.axes == ("E", "N", "H")
    assert errors.beyond == ()
    assert min(errors.after) > 0.3 and max(errors.after) < max(errors.before)


def test_a_height_of_eight_sigma_is_not_closed(late):
    "Heights that are eight times their simulated sigma are said so, easting and northing are not"
    folds = late.folds(late.cause("time_offset"))
    rows = late.rows
    up = rows.covariates["axis"] == 2
    moved = np.where(up & rows.metric, rows.residual + 0.2, rows.residual)
    late_and_high = replace(rows, residual=moved)
    errors = errors_over_sigma(late_and_high, late.observations, folds, np.random.default_rng(1))
    assert errors.beyond == ("H",)
    assert errors.after[2] > 5


@pytest.mark.parametrize(("after", "beyond"), [(1.5, ()), (1.9, ()), (2.4, ()), (2.6, ("H",))])
def test_twice_the_sigma_may_be_chance(after, beyond):
    "Beyond is what is more than 1.96 sigma and more than chance makes of this survey"
    errors = OverSigma(("E", "H"), (9.0, 9.0), (1.0, after), (1.3, 2.5))
    assert errors.beyond == beyond


@pytest.mark.long
def test_planes_of_two_passes_tell_nothing_of_sigma(case):
    "Planes without a surveyed position take no part; targets and surfaces count in full"
    survey, _, rows, _ = case
    both = Observations.of(rows, background(rows, survey))
    kept = rows.select(~rows.two_times)
    single = Observations.of(kept, background(kept, survey))
    nothing = [Predicted.nothing(r) for r in (rows, kept)]
    errors = [
        errors_over_sigma(
            r,
            o,
            Folds(*np.zeros((2, len(r)), int), (p,), "", p, np.zeros((len(r), 0))),
            np.random.default_rng(1),
        )
        for r, o, p in zip((rows, kept), (both, single), nothing, strict=True)
    ]
    assert rows.two_times.sum() > 50
    assert errors[0].before == pytest.approx(errors[1].before, rel=0.05)
