"""Slopes of the likelihood, beside its differences."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import (
    FAMILIES,
    INTEGRATED,
    Covariance,
    Signal,
    collocate_rows_dense,
    likelihood_changes,
)
from tests.collocation.linked_rows import Street


@pytest.mark.parametrize("family", [*FAMILIES, INTEGRATED])
def test_the_likelihood_changes_as_its_differences_do(family):
    "With scale and correlation time a ten thousandth larger it changes as two solutions differ"
    street = Street(family, 40.0)
    scaled = []
    slower = []
    for part in street.rows:
        drift, *others = part.signals
        larger = Signal(1.0001 * drift.mixing, drift.covariance, drift.clock)
        time = Covariance(family, 1.0001 * drift.covariance.correlation_time)
        scaled.append(replace(part, signals=[larger, *others]))
        slower.append(replace(part, signals=[Signal(drift.mixing, time, drift.clock), *others]))
    solved = collocate_rows_dense(street.rows)
    changes = likelihood_changes(solved, street.rows, [scaled, slower, street.rows])
    apart = [collocate_rows_dense(rows).log_likelihood for rows in (scaled, slower)]
    differences = np.array([*apart, solved.log_likelihood]) - solved.log_likelihood
    assert np.abs(differences[:2]).min() > 1e-5  # so that there is something to recover
    np.testing.assert_allclose(changes, differences, rtol=0.01, atol=1e-8)


def test_the_likelihood_changes_with_the_sigma_of_the_trend():
    "With coefficients believed a thousandth larger it changes as two solutions differ"
    street = Street("matern32", 40.0)
    parameters = street.rows[0].design.shape[2]
    prior_rows = np.eye(parameters, parameters + 1) / 0.2
    solved = collocate_rows_dense(street.rows, prior_rows)
    given = street.rows, [street.rows] * 2, [prior_rows / 1.001, prior_rows]
    change, none = likelihood_changes(solved, *given)
    difference = collocate_rows_dense(street.rows, prior_rows / 1.001).log_likelihood
    difference -= solved.log_likelihood
    assert abs(difference) > 1e-5 and none == 0.0
    assert change == pytest.approx(difference, rel=0.01)
