"""Made-up surveys of features."""

import pytest
from gap_training.features import geometry


@pytest.fixture(scope="module")
def small():
    "Two passes, 14 targets and 30 planes that both saw"
    return geometry(3, targets=14, patches=30, shared=True, duration=45.0)


def test_a_survey_has_the_rows_that_were_asked_for(small):
    "Three rows a target and pass, planes compared between passes, roughness of each look"
    rows = small.rows
    assert (rows.channel == "target").sum() % 3 == 0
    assert rows.two_times.sum() == (rows.channel == "shared").sum() > 10
    assert not rows.residual.any()
    assert small.survey.trajectory.passes.shape == (2, 2)
