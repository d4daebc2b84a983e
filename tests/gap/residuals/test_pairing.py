"""Like is compared with like: what the POS erred by, and nothing else, is in a clean survey."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.residuals import build_rows, find_patches
from mlscorr.gap.residuals.pairing import target_rows
from mlscorr.survey import PointCloud

ARRAYS = ("channel", "item", "gps_time", "position", "direction", "residual", "noise")


def pos_error(simulated, gps_time):
    "Recorded minus true pose at times (m,): position (m) and rotation about map axes (rad)"
    recorded = simulated.trajectory.at(gps_time)
    true = simulated.true_trajectory.at(gps_time)
    turn = (recorded.attitude * true.attitude.inv()).as_rotvec()
    return np.hstack([recorded.position - true.position, turn])


@pytest.mark.parametrize("channel, limit", [("target", 7e-3), ("surface", 3e-3), ("shared", 3e-3)])
def test_the_pos_error_explains_all_of_a_clean_survey(simulated, pairing, channel, limit):
    "Residuals less what POS and survey truly err by are millimetres, however large that is"
    rows = pairing.rows.select(pairing.rows.channel == channel)
    explained = np.sum(rows.partials * pos_error(simulated, rows.gps_time), axis=1)
    two = rows.two_times
    assert two.all() if channel == "shared" else not two.any()
    second = pos_error(simulated, rows.gps_time_2[two])
    explained[two] += np.sum(rows.partials_2[two] * second, axis=1)
    on_target = np.flatnonzero(rows.survey_item >= 0)
    error = dict(
        zip(simulated.targets.name, simulated.targets.position - simulated.true_centre, strict=True)
    )
    surveyed = np.array([error[rows.targets.name[i]] for i in rows.survey_item[on_target]])
    if len(on_target):
        explained[on_target] -= np.sum(rows.direction[on_target] * surveyed, axis=1)
    left = rows.residual - explained
    assert len(rows) >= (12 if channel == "target" else 100)
    assert np.std(rows.residual) > 0.012  # the POS error
    assert np.sqrt(np.mean(left**2)) < limit
    assert np.sqrt(np.mean(left**2 / rows.noise)) < 1.5  # as the extraction states


def test_check_points_are_kept_apart(survey, pairing):
    "Rows that the diagnosis may use hold control points alone, the others are check rows"
    surveyed = np.array(pairing.rows.targets.name)
    used = surveyed[pairing.rows.survey_item[pairing.rows.survey_item >= 0]]
    held_out = surveyed[pairing.check.survey_item]
    assert set(used) <= set(survey.control.name)
    assert len(held_out) and set(held_out) <= set(survey.check.name)
    assert (pairing.check.channel == "target").all()


def test_residuals_of_targets_are_minus_the_misclosure(survey, targets):
    "Observed - surveyed, in axes in which the extraction's noise is independent"
    matched, candidates = targets
    matched = replace(matched, covariance=matched.covariance + 4e-6 * skewed(len(matched)))
    rows = target_rows(survey, matched, candidates)
    axes = rows.direction.reshape(-1, 3, 3)
    surveyed = rows.targets.position[rows.survey_item[::3]]
    back = np.einsum("nij,ni->nj", axes, rows.residual.reshape(-1, 3))
    np.testing.assert_allclose(back, matched.position - surveyed, atol=1e-9)
    covariance = np.einsum("nij,ni,nik->njk", axes, rows.noise.reshape(-1, 3), axes)
    np.testing.assert_allclose(covariance, matched.covariance, atol=1e-12)
    np.testing.assert_array_equal(rows.covariates["axis"], np.tile([0, 1, 2], len(matched)))


def skewed(n):
    "A covariance that mixes the axes, (n, 3, 3)"
    return np.tile([[2.0, 0.5, 0.1], [0.5, 1.0, 0.0], [0.1, 0.0, 0.5]], (n, 1, 1))


def no_targets(targets):
    "No matched target, and what find_targets read"
    return targets[0][np.zeros(len(targets[0]), dtype=bool)], targets[1]


def test_without_mounting_or_reference_targets_and_planes_remain(survey, targets, patches):
    "Targets and shared planes need no mounting; what can't be compared is told"
    pairing = build_rows(replace(survey, mounting=None, reference=None), *targets, patches)
    assert {"target", "shared"} <= set(pairing.rows.channel)
    assert "surface" not in pairing.rows.channel
    assert any("reference" in note for note in pairing.notes)
    assert np.isfinite(pairing.rows.residual).all()
    assert np.isnan(pairing.rows.pulses.scanner_xyz).all()


def test_the_number_of_patches_is_bounded_and_spread(survey, targets, patches):
    "Fifty patches are fifty, from all of the time, and the same each time"
    pairings = [build_rows(survey, *targets, patches, limit=50).rows for _ in range(2)]
    for name in ARRAYS:
        np.testing.assert_array_equal(*(getattr(rows, name) for rows in pairings))
    surface = pairings[0].select(pairings[0].channel == "surface")
    assert len(surface) == 50
    time = surface.covariates["time"]
    span = survey.trajectory.gps_time[-1] - survey.trajectory.gps_time[0]
    assert time.min() < 2.0 and time.max() > span - 2.0


def test_there_must_be_something_to_compare(survey, targets):
    "A cloud without planes and targets is refused, with the way out"
    empty = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))
    assert find_patches(survey, chunks=lambda file: [empty]) is None
    with pytest.raises(ValueError, match="Survey targets, or set"):
        build_rows(survey, *no_targets(targets), None)
