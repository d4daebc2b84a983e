"""Geometries that the tests of the inference share."""

import gap_study
import pytest

from mlscorr.gap.signatures import signatures


@pytest.fixture(scope="session")
def study():
    "The feature-level study, whose geometries and drifts are used here"
    return gap_study


@pytest.fixture(scope="session")
def with_surface(study):
    "Two passes, 24 targets, 80 patches on a reference surface; signatures of all effects"
    g = study.geometry(3, targets=24, patches=80)
    return g, signatures(g.rows, g.survey)[0]


@pytest.fixture(scope="session")
def with_planes(study):
    "Two passes, 24 targets, 60 planes that both saw, no reference surface"
    g = study.geometry(4, targets=24, patches=60, shared=True)
    return g, signatures(g.rows, g.survey)[0]
