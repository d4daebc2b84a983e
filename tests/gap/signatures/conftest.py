"""The short drive with nothing wrong, and its rows."""

import pytest

from mlscorr.gap.residuals import find_patches
from mlscorr.gap.residuals.pairing import patch_rows, target_rows
from mlscorr.targets import NO_POINTS, Candidates
from tests.beds.short_drive import observations, run, survey_of


@pytest.fixture(scope="session")
def clean():
    "A survey with nothing wrong: simulated, Survey, Rows of its targets, and their points"
    simulated, cloud, target = run()
    survey = survey_of(simulated)
    matched, points = observations(simulated, cloud, target)
    number = 1 + simulated.trajectory.segment(cloud.gps_time)
    candidates = Candidates(cloud, number, NO_POINTS, {})
    return survey, target_rows(survey, matched, candidates), cloud, points


@pytest.fixture(scope="session")
def patches(clean):
    "Patches of the clean survey, unread from files, and their Rows"
    survey, _, cloud, _ = clean
    found = find_patches(survey, chunks=lambda file: [cloud])
    return patch_rows(survey, found)
