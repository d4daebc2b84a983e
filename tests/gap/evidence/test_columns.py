"""Columns of effects and unknown errors: their scale, their blocks and prior weights."""

import numpy as np
import pytest

from mlscorr.gap.evidence import SETTINGS, Observations, column_table, unknown_blocks
from mlscorr.gap.evidence.evidence import is_of_one_target


@pytest.fixture(scope="module")
def table(with_surface):
    g, signs = with_surface
    sigma = Observations.of(g.rows, g.background).sigma
    return column_table(g.rows, signs, unknown_blocks(g.rows, g.survey), sigma)


def test_each_columns_rms_is_a_metre(with_surface, table):
    "Over the rows that it changes, so that the amplitudes of all effects mean the same"
    metric = with_surface[0].rows.metric
    for label in table.effects:
        for block in (b for b in table.blocks if b.label == label):
            for column in table.columns[metric][:, block.columns].T:
                changed = column[np.abs(column) > SETTINGS.changed * np.abs(column).max()]
                assert np.sqrt(np.mean(changed**2)) == pytest.approx(1.0)


def test_the_prior_weights_of_a_label_add_up_to_what_of_it_can_be_seen(table):
    "All of an effect that is always there, at most all of one with many moments"
    for label in table.labels:
        weight = sum(block.weight for block in table.blocks if block.label == label)
        if label in table.steady or label == "unknown":
            assert weight == pytest.approx(1.0)
        assert 0 < weight <= 1 + 1e-12


def test_a_vector_acts_along_all_axes_or_one_of_them(table):
    "A lever arm's error has a block of all its columns, and one of each of these"
    every, *single = [b for b in table.blocks if b.label == "lever_arm"]
    assert len(every.columns) > 1
    assert [b.columns.tolist() for b in single] == [[column] for column in every.columns]


def test_an_error_of_a_single_target_is_its_outliers_to_tell(with_surface):
    "An outlier moves all views of one target and nothing else; an effect moves two targets"
    rows = with_surface[0].rows
    first, second = np.unique(rows.survey_item[rows.metric & (rows.survey_item >= 0)])[:2]
    alone = (rows.survey_item == first)[:, None].astype(float)
    assert is_of_one_target(rows, alone)
    assert not is_of_one_target(rows, alone + (rows.survey_item == second)[:, None])
