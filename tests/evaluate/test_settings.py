"""The standard's numbers decide where they should."""

import numpy as np
import pytest

from mlscorr.evaluate._accuracy import positional_accuracy
from mlscorr.evaluate._settings import SETTINGS


@pytest.mark.parametrize("more, conformant", [(-1, False), (0, True)])
def test_the_number_of_check_points_is_that_of_the_standard(more, conformant):
    "30 make a conformant test (ASPRS Edition 2), 29 don't"
    assert SETTINGS.check_points == 30
    n = SETTINGS.check_points + more
    document = positional_accuracy(np.full((n, 3), 0.02), np.full((n, 3), 0.001), n)
    assert document["conformant"] == conformant


@pytest.mark.parametrize("ratio, told", [(0.45, False), (0.55, True)])
def test_check_points_must_be_twice_as_accurate(ratio, told):
    "A survey of 0.45 of the product's error passes without a word, one of 0.55 is told"
    assert SETTINGS.accuracy_ratio == 2.0
    residuals = np.tile([0.02, 0.02, 0.02], (40, 1))
    sigma = np.full((40, 3), 0.02 * ratio)
    statement = positional_accuracy(residuals, sigma, 40)["statement"]
    assert any("twice as accurate" in sentence for sentence in statement) == told
