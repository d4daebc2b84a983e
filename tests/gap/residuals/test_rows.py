"""Rows share what they have in common: survey errors, items, the POS."""

import numpy as np
import pytest

from mlscorr.gap.residuals import Rows, background


def test_passes_share_the_survey_error_of_a_target(survey, pairing):
    "The rows' survey covariance is that of the surveyed points, the same in both passes"
    rows = pairing.rows.select(pairing.rows.channel == "target")
    design = rows.survey_design()
    covariance = (design @ design.T).toarray()
    np.testing.assert_allclose(np.diag(covariance), rows.survey, atol=1e-15)
    one, two = np.triu_indices(len(rows), 1)
    same = rows.survey_item[one] == rows.survey_item[two]
    assert not covariance[one[~same], two[~same]].any()
    sigma = rows.targets.sigma[rows.survey_item]
    wanted = np.sum(rows.direction[one] * sigma[one] ** 2 * rows.direction[two], axis=1)
    np.testing.assert_allclose(covariance[one[same], two[same]], wanted[same], atol=1e-15)


def test_rows_join_and_part_without_mixing_items(pairing):
    "Joined with itself, a set of rows has twice the items, each with its own pulses"
    rows = pairing.rows
    twice = Rows.concatenate([rows, rows])
    assert len(np.unique(twice.item)) == 2 * len(np.unique(rows.item))
    last = twice.select(np.arange(len(rows), 2 * len(rows)))
    np.testing.assert_array_equal(last.residual, rows.residual)
    np.testing.assert_allclose(last.pulses.xyz.sum(), rows.pulses.xyz.sum())


def test_the_background_has_a_leg_for_each_time(survey, pairing):
    "A target's drift sigma along its axis is the POS's own; shared planes have two legs"
    rows = pairing.rows
    legs = background(rows, survey)
    assert len(legs.row) == rows.metric.sum() + rows.two_times.sum()
    first = np.flatnonzero(rows.channel == "target")[0]
    leg = np.flatnonzero(legs.row == first)
    assert len(leg) == 1
    sigma = survey.trajectory.at(rows.gps_time[[first]]).position_sigma[0]
    total = np.sum(legs.position[leg] ** 2)
    assert total == pytest.approx(np.sum((rows.direction[first] * sigma) ** 2))
