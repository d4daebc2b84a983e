"""Planned rows are those that a drive gives."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.plan import planned_rows
from tests.beds.short_drive import run, survey_of


@pytest.fixture(scope="module")
def survey():
    return survey_of(run()[0])


def test_each_target_is_seen_once_a_pass(survey):
    "Of each target and pass there is at most one item, of three rows without residuals"
    rows = planned_rows(survey)
    visits = np.column_stack([rows.survey_item, rows.covariates["pass"]])
    assert len(np.unique(visits, axis=0)) == len(np.unique(rows.item)) == len(rows) / 3 >= 4
    assert set(rows.covariates["pass"]) == {1.0, 2.0}
    assert not rows.residual.any()


def test_targets_are_seen_when_the_drive_saw_them(survey):
    "The scan plane sweeps over each target in the tenth of a second in which points lie on it"
    simulated, cloud, target = run()
    rows = planned_rows(survey)
    for item in np.unique(rows.item):
        row = np.flatnonzero(rows.item == item)[0]
        name = rows.targets.name[rows.survey_item[row]]
        on = cloud.gps_time[target == simulated.targets.name.index(name)]
        assert np.abs(on - rows.gps_time[row]).min() < 0.1


def test_without_a_mounting_nothing_can_be_planned(survey):
    "The sentence says what to give"
    with pytest.raises(ValueError, match="Set lever_arm and boresight"):
        planned_rows(replace(survey, mounting=None))


def test_targets_out_of_sight_are_refused(survey):
    "A kilometre off, none comes near: the CRS is asked for"
    far = replace(survey.control, position=survey.control.position + 1000.0)
    with pytest.raises(ValueError, match="same CRS"):
        planned_rows(replace(survey, control=far, check=far[[]]))


def test_without_a_target_none_is_said_to_be_out_of_sight(survey):
    "Neither control nor a reference surface is named: the sentence asks for them, not for a CRS"
    none = survey.control[[]]
    with pytest.raises(ValueError, match=r"has neither targets nor .* Add \[control\]"):
        planned_rows(replace(survey, control=none, check=none))
