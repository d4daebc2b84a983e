"""Assumed properties of instruments without a description."""

import numpy as np
import pytest

from mlscorr.survey import Pos, Scanner


def test_beliefs_are_of_the_order_of_the_data_sheets():
    "Millimetres and thousandths of a degree for the scanner, centimetres and arc minutes for POS"
    assert 0.001 < Scanner().range_noise < 0.02  # m
    assert np.degrees(Scanner().angle_noise) == pytest.approx(0.002)
    assert 0.01 < Pos().position_sigma < 0.1  # m
    assert np.all(np.degrees(Pos().attitude_sigma) < 1 / 60)


def test_beliefs_of_two_surveys_are_separate_arrays():
    "No survey's sigmas are those of another one"
    assert Pos().attitude_sigma is not Pos().attitude_sigma
