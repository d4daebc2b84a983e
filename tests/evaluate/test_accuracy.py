"""The accuracy in the terms of the standard."""

import numpy as np
import pytest

from mlscorr.evaluate._accuracy import accuracy_statements, positional_accuracy


def keys(found):
    "Keys of the statements on an accuracy"
    return [statement.key for statement in accuracy_statements(found)]


def test_survey_error_counts_into_the_accuracy():
    "RMSE_H^2 = RMSE_E^2 + RMSE_N^2 + the survey's; the class is the next whole centimetre"
    residuals = np.tile([0.03, -0.04, 0.02], (40, 1))
    sigma = np.tile([0.012, 0.0, 0.015], (40, 1))
    found = positional_accuracy(residuals, sigma, 40)
    assert found["rmse_horizontal"] == pytest.approx(np.hypot(0.05, 0.012))
    assert found["rmse_vertical"] == pytest.approx(0.025)
    assert found["rmse_3d"] == pytest.approx(np.hypot(found["rmse_horizontal"], 0.025))
    assert (found["class_horizontal_cm"], found["class_vertical_cm"]) == (6, 3)
    assert found["conformant"]


def test_an_accuracy_of_exactly_a_class_belongs_to_it():
    "3 cm is the 3-cm class, not the next one for a rounding error"
    found = positional_accuracy(np.tile([0.0, 0.03, 0.01], (30, 1)), np.zeros((30, 3)), 30)
    assert (found["class_horizontal_cm"], found["class_vertical_cm"]) == (3, 1)


@pytest.mark.parametrize(("points", "conformant"), [(29, False), (30, True)])
def test_fewer_than_30_check_points_are_no_conformant_test(points, conformant):
    "It says so, however often each was seen"
    residuals = np.full((60, 3), 0.01)
    found = positional_accuracy(residuals, np.full((60, 3), 0.001), points)
    assert found["conformant"] == conformant
    expected = "too few"
    if conformant:
        expected = "tested"
    assert keys(found)[0] == expected


def test_points_left_out_in_turn_are_an_estimate_and_no_test():
    "However many: they took part in the correction"
    found = positional_accuracy(np.full((50, 3), 0.01), np.zeros((50, 3)), 50, "leave_one_out")
    assert not found["conformant"]
    assert keys(found) == ["left out", "class", "class"]


def test_without_any_point_the_accuracy_is_not_determined():
    "No number is made up"
    found = positional_accuracy(np.empty((0, 3)), np.empty((0, 3)), 0)
    assert (
        found["rmse_horizontal"] is None
        and found["class_vertical_cm"] is None
        and found["based_on"] is None
    )
    assert keys(found) == ["not determined"]


@pytest.mark.parametrize(("ratio", "doubtful"), [(0.45, False), (0.55, True)])
def test_check_points_must_be_twice_as_accurate(ratio, doubtful):
    "A survey of 0.45 of the product's error passes without a word, one of 0.55 is named"
    residuals = np.tile([0.02, 0.02, 0.02], (40, 1))
    sigma = np.full((40, 3), 0.02 * ratio)
    found = positional_accuracy(residuals, sigma, 40)
    assert ("inaccurate points" in keys(found)) == doubtful
