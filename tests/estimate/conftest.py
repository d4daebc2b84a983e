"""What several tests of the estimate stand on."""

import pytest

from mlscorr.estimate import Objective
from mlscorr.estimate.posterior import choose_parameters
from tests.beds.pos_errors import smooth_case


@pytest.fixture(scope="session")
def small_case():
    "A drive with waves of 5 cm and 7 targets at random times"
    return smooth_case(11, n=7)


@pytest.fixture(scope="session")
def equations(small_case):
    "Its equations with a trend of order 1"
    return small_case.equations(order=1)


@pytest.fixture(scope="session")
def objective(equations):
    return Objective.of(equations)


@pytest.fixture(scope="session")
def posterior(equations):
    "Of its parameters, by eight points or a few more"
    return choose_parameters(equations, points=8)
