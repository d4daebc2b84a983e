"""Remaining variance along a drive after further targets."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import Noise
from mlscorr.estimate import estimate_correction, with_ties
from mlscorr.estimate._prediction import predict_under
from mlscorr.estimate.placement import Outlook, with_fewer_rows
from tests.beds.tied_passes import tied_passes
from tests.estimate.test_outages import BELIEVED, START, survey
from tests.estimate.test_placement import GAPPED, slow_error


def variance(adjustment, parameters, rows):
    "3D variance of the position at epochs, by the solution itself"
    covariance = predict_under(adjustment, parameters, rows)[1]
    return np.einsum("qii->q", covariance[:, :3, :3])


@pytest.fixture(scope="module")
def gapped():
    "Adjustment of a drive that has no control from 76 to 164 s, and its first family"
    trajectory, matched = survey(np.random.default_rng(5), slow_error(5), GAPPED)
    estimate = estimate_correction(trajectory, matched, BELIEVED)
    return estimate.adjustment, estimate.families[0]


def observed_at(adjustment, row):
    "The adjustment with a target that is seen at an epoch as the first control point is"
    gps_time = adjustment.trajectory.gps_time[[row]]
    new = replace(
        adjustment.targets.select([0]),
        kind="new",
        gps_time=gps_time[:, None],
        stated=adjustment.errors.at(gps_time),
    )
    return adjustment.with_factor(new)


def test_a_target_leaves_what_a_solution_with_it_leaves(gapped):
    "Before and after, at all epochs, to 1e-6 of the variance, where all targets are alike"
    adjustment, family = gapped
    targets = adjustment.targets
    noise = targets.noise
    own = np.tile(noise.own[0], (len(targets), 1, 1))
    shared = np.tile(noise.shared[noise.group[0]], (len(noise.shared), 1))
    partials = np.tile(targets.partials[0], (len(targets), 1, 1, 1))
    alike = replace(targets, partials=partials, noise=Noise(own, noise.group, shared))
    adjustment = adjustment.with_factor(alike)
    rows = np.arange(0, len(adjustment.trajectory), 50)
    row = int(np.searchsorted(adjustment.trajectory.gps_time, START + 120.0))
    outlook = Outlook.of(adjustment, [family], rows, [[row]])
    np.testing.assert_allclose(outlook.variance, variance(adjustment, family[0], rows), rtol=1e-6)
    expected = variance(observed_at(adjustment, row), family[0], rows)
    np.testing.assert_allclose(outlook.with_target(0).variance, expected, rtol=1e-6)


def test_the_best_target_is_the_one_that_lowers_the_variance_most(gapped):
    "Of five along the drive, each observed in turn"
    adjustment, family = gapped
    rows = np.arange(0, len(adjustment.trajectory), 50)
    sights = [[len(adjustment.trajectory) * k // 6] for k in range(1, 6)]
    outlook = Outlook.of(adjustment, [family], rows, sights)
    left = [outlook.with_target(k).variance.mean() for k in range(5)]
    assert outlook.best(np.ones(len(rows), bool)) == int(np.argmin(left))


def sigma_ratio(estimate, fewer, step):
    "Median, over every so manieth epoch, of the sigma by fewer rows over that by all"
    rows = np.arange(0, len(fewer.trajectory), step)
    some, complete = (
        np.sqrt(variance(adjustment, estimate.families[0][0], rows))
        for adjustment in (fewer, estimate.adjustment)
    )
    return np.median(some / complete)


@pytest.mark.long
def test_fewer_rows_hold_the_drive_as_all_of_them_do():
    "A hundred ties, each as precise as the twelve that it stands for: its sigma to 10 %"
    case = tied_passes(1, number=1200)
    estimate = with_ties(estimate_correction(case.trajectory, case.matched), case.ties)
    fewer = with_fewer_rows(estimate.adjustment)
    assert len(fewer.ties) <= 100 and len(estimate.adjustment.ties) > 1000
    assert sigma_ratio(estimate, fewer, step=20) == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_hundreds_of_control_points_are_thinned_alike():
    "400 points, a third of them as precise as three each: sigma to 10 % in the median"
    times = np.linspace(2.0, 238.0, 400)
    trajectory, matched = survey(np.random.default_rng(2), slow_error(2), times)
    estimate = estimate_correction(trajectory, matched, BELIEVED)
    fewer = with_fewer_rows(estimate.adjustment)
    assert len(fewer.names) < 170
    assert sigma_ratio(estimate, fewer, step=40) == pytest.approx(1.0, abs=0.1)
