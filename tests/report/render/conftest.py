"""The street, its correction and its pictures, made once."""

import pytest

import mlscorr
from mlscorr.report.render import PictureOptions, draw
from mlscorr.survey import PointCloud
from tests.beds.street_of_points import SIZE


@pytest.fixture(scope="package")
def survey(street):
    return mlscorr.read_survey(street)


@pytest.fixture(scope="package")
def estimated(survey):
    "The correction of the street and its targets' rows"
    result = mlscorr.correct(survey)
    return result.estimate.correction, result.targets


@pytest.fixture(scope="package")
def chunk(survey):
    "All points of the street"
    return PointCloud.concatenate(
        [c for file in survey.clouds for c in mlscorr.io.clouds.las.read_chunks(file)]
    )


@pytest.fixture(scope="package")
def drawn(survey, estimated):
    return list(draw(survey, *estimated, PictureOptions(SIZE)))
