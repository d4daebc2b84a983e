"""A survey and its twin, read once."""

import pytest

from tests.beds.twin_clouds import sampled, twins


@pytest.fixture(scope="session")
def pair(tmp_path_factory):
    "Survey, its sample, and that of its twin"
    survey, simulated = twins(tmp_path_factory.mktemp("twins"), 3)
    return survey, sampled(survey), sampled(simulated)
