"""Robust weights of ties: the same by steps and at once, and by what more of them hold."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import estimate_correction, tie_factor
from mlscorr.estimate.tied import graduated, robust_ties, solved_ties, student
from tests.beds.tied_passes import tied_passes


@pytest.fixture(scope="module")
def tied():
    "The estimate by control alone, and its adjustment with ties"
    survey = tied_passes(1)
    alone = estimate_correction(survey.trajectory, survey.matched)
    adjustment = alone.adjustment
    return alone, adjustment.with_factor(tie_factor(adjustment.errors, survey.ties))


def test_weights_put_beside_others_are_those_of_a_new_solution(tied):
    "To 1e-6 of a sigma with the same knots, to a fiftieth (RMS) with those of other weights"
    alone, adjustment = tied
    weighed = graduated(adjustment, alone.parameters)
    for each in (weighed, weighed.graded((student,))):
        solved = each.adjustment.solve(each.parameters, each.solved)
        np.testing.assert_allclose(replace(each, solved=solved).ratio, each.ratio, atol=1e-6)
        again = solved_ties(each.adjustment, each.parameters)
        assert np.sqrt(np.mean((again.ratio - each.ratio) ** 2)) < 0.02


def test_control_that_believes_in_hardly_any_drift_does_not_outweigh_the_ties(tied):
    "A centimetre that changes in ten minutes, where ties tell of decimetres: they are believed"
    alone, adjustment = tied
    none = dict.fromkeys(("jitter_scale", "bias_scale", "attitude_scale"), 0.01)
    stiff = replace(alone.parameters, family="matern52", drift_scale=0.02, drift_time=600.0, **none)
    lost = graduated(adjustment, stiff).weight < 0.25  # beyond the cut of 4 sigmas
    assert lost.mean() > 0.05
    weighed = robust_ties(adjustment, stiff)
    assert (weighed.weight < 0.25).mean() < 0.01
    assert weighed.parameters.drift_scale > 0.5
    weighed = robust_ties(adjustment, alone.parameters)
    assert weighed.parameters == alone.parameters and (weighed.weight < 0.25).mean() < 0.01
