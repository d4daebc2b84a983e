"""Fixtures that several tests of the estimate use."""

import pytest

from mlscorr.estimate import Objective
from mlscorr.estimate.posterior import choose_parameters
from tests.beds.pos_errors import smooth_case


@pytest.fixture(scope="session")
def small_case():
    "A drive with waves of 5 cm and 7 targets at random times"
    return smooth_case(11, n=7)


@pytest.fixture(scope="session")
def adjustment(small_case):
    "Its equations with a trend of order 1"
    return small_case.adjustment(order=1)


@pytest.fixture(scope="session")
def objective(adjustment):
    return Objective.of(adjustment)


@pytest.fixture(scope="session")
def posterior(adjustment):
    "Of its parameters, by eight points or a few more"
    return choose_parameters(adjustment, points=8)
