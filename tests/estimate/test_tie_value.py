"""Information from control points and from ties."""

import numpy as np
import pytest

from mlscorr.estimate import estimate_correction, tie_value, with_ties
from tests.beds.tied_passes import tied_passes


@pytest.fixture(scope="module")
def estimates():
    survey = tied_passes(1)
    alone = estimate_correction(survey.trajectory, survey.matched)
    return survey, alone, with_ties(alone, survey.ties)


def test_without_ties_control_brings_all(estimates):
    "An estimate by control points alone owes them everything"
    assert tie_value(estimates[1]).share == {"control": 1.0}


def test_shares_add_up_and_planes_bring_the_most(estimates):
    "300 planes tell more of two passes than 5 control points of one"
    share = tie_value(estimates[2]).share
    assert sum(share.values()) == pytest.approx(1.0)
    assert share["plane"] > share["control"] > 0.0
    assert share["pole"] == 0.0


def test_fewer_control_points_would_have_sufficed_than_there_are(estimates):
    "The number lies between one and all, and is the first whose median sigma is within a tenth"
    survey, _, tied = estimates
    number = tie_value(tied).sufficient
    assert 1 <= number <= len(survey.matched)
    names = np.array(survey.matched.name)
    chosen = names[np.linspace(0, len(names) - 1, number).round().astype(int)]
    fewer = tied.adjustment.without([name for name in names if name not in chosen])
    assert len(fewer.names) == number
