"""Moves of the whole cloud: each recovers what it can express."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.baselines import RAW, fit_affine, fit_horizontal_and_height, fit_rigid, fit_shift
from mlscorr.estimate import estimate_correction
from mlscorr.evaluate import misclosures
from mlscorr.survey import PointCloud
from tests.beds.streets import SHIFT, SIGMA, START, observed, on_a_line, targets, trajectory


def moved(place, change):
    "Places after a shift and a small change of the matrix, about a point far from their mean"
    origin = START + np.array([-150.0, 90.0, 4.0])
    return place + SHIFT + (place - origin) @ change.T


TURN = Rotation.from_rotvec([0.002, -0.001, 0.004]).as_matrix() - np.eye(3)
SCALED = 1.0003 * Rotation.from_rotvec([0.0, 0.0, 0.004]).as_matrix() - np.eye(3)
PLAN_AND_PLANE = np.vstack([SCALED[:2], [0.01, -0.02, 0.0]])
KNOWN = [  # a method, and a change of the matrix that it can express
    (fit_shift, np.zeros((3, 3))),
    (fit_horizontal_and_height, PLAN_AND_PLANE),
    (fit_rigid, TURN),
    (fit_affine, np.array([[0.01, 0.02, -0.01], [0.0, -0.01, 0.03], [0.02, 0.01, 0.005]])),
]


@pytest.mark.parametrize(("fit", "change"), KNOWN, ids=lambda one: getattr(one, "__name__", ""))
def test_each_transformation_is_recovered_at_map_coordinates(fit, change):
    "Points that took no part come to their places within a micrometre, at UTM size"
    rng = np.random.default_rng(1)
    place, time = targets(rng)
    correction = fit(observed(place, time, moved(place, change)))
    other, at = targets(rng, 50)
    cloud = correction.apply(PointCloud(other, at, np.arange(50)))
    assert np.abs(cloud.xyz - moved(other, change)).max() < 1e-6
    assert np.array_equal(cloud.intensity, np.arange(50))


@pytest.mark.parametrize("fit", [fit_shift, fit_horizontal_and_height, fit_rigid, fit_affine])
def test_the_order_of_the_targets_changes_nothing(fit):
    "Shuffled targets give the same corrected places to a nanometre"
    rng = np.random.default_rng(2)
    place, time = targets(rng)
    matched = observed(place, time, moved(place, TURN) + rng.normal(0, 0.01, (16, 3)))
    cloud = PointCloud(place, time, np.zeros(16))
    shuffled = matched[rng.permutation(16)]
    ordered, other = (fit(given).apply(cloud).xyz for given in (matched, shuffled))
    assert np.abs(ordered - other).max() < 1e-9


def test_the_height_is_shifted_alone_where_targets_lie_on_a_line():
    "On a line the plan is still solved, and the height is a mean shift without inclination"
    place, time = on_a_line(9, None)
    correction = fit_horizontal_and_height(observed(place, time, place + SHIFT))
    assert correction.shift == pytest.approx(SHIFT, abs=1e-6)
    assert np.abs(correction.change).max() < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("seed", range(5))
def test_a_constant_shift_is_removed_by_shift_rigid_and_collocation_alike(seed):
    "Without POS drift, collocation is at most 2 mm worse than the correct model"
    rng = np.random.default_rng(seed)
    place, time = targets(rng)
    noise = np.hypot(SIGMA, 0.001)
    control = observed(place + rng.normal(0.0, noise, place.shape), time, place + SHIFT)
    other, at = targets(rng, 30)
    check = observed(other + rng.normal(0.0, noise, other.shape), at, other + SHIFT)
    corrections = {
        "shift": fit_shift(control),
        "rigid": fit_rigid(control),
        "lsc": estimate_correction(trajectory(), control).correction,
    }
    rmse = {
        name: np.sqrt(np.mean(misclosures(check, correction) ** 2, axis=0))
        for name, correction in corrections.items()
    }
    for name in ("rigid", "lsc"):
        assert np.all(rmse[name] < rmse["shift"] + 0.002), rmse
    assert rmse["lsc"].max() < 0.006


def test_raw_leaves_every_coordinate_as_it_was():
    "The cloud as recorded keeps every bit"
    place, time = targets(np.random.default_rng(11))
    assert np.array_equal(RAW.apply(PointCloud(place, time, np.zeros(16))).xyz, place)
