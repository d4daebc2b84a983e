"""Control points that a user keeps out of an estimate, or in it."""

import shutil
import warnings

import numpy as np
import pytest

import mlscorr
from mlscorr.io.surveys import read_survey
from mlscorr.survey import SurveyFileError


def move(folder, name, east):
    "Survey one point wrongly, by some metres to the east"
    lines = (folder / "control.csv").read_text().splitlines()
    column = lines[0].split(",").index("easting")
    for number, line in enumerate(lines):
        cells = line.split(",")
        if cells[0] == name:
            cells[column] = f"{float(cells[column]) + east:.4f}"
            lines[number] = ",".join(cells)
    (folder / "control.csv").write_text("\n".join(lines) + "\n")


@pytest.fixture
def folder(street, tmp_path):
    return shutil.copytree(street, tmp_path / "survey")


def rows_of(result, name):
    return [row for row in result.targets if row.name == name]


def test_an_excluded_point_is_reported_and_takes_no_part(folder, tmp_path):
    "A point off by 0.2 m keeps its residual, to 2 cm, and the result is that of the others alone"
    name = read_survey(folder).control.name[1]
    good = mlscorr.correct(read_survey(folder).choosing(exclude=[name]))
    move(folder, name, 0.2)
    text = (folder / "survey.toml").read_text()
    changed = text.replace('file = "control.csv"', f'file = "control.csv"\nexclude = ["{name}"]')
    assert changed != text
    (folder / "survey.toml").write_text(changed)
    result = mlscorr.correct(read_survey(folder))
    (row,) = rows_of(result, name)
    assert (row.role, row.used, row.reason) == ("control", False, "excluded by the user")
    assert row.after[0] == pytest.approx(0.2, abs=0.02)  # m
    np.testing.assert_allclose(result.trajectory.position, good.trajectory.position, atol=1e-6)  # m
    (exclusion,) = result.exclusions
    assert exclusion.by == "check points"
    assert exclusion.without_point == pytest.approx(result.check["after"]["rmse_3d"])
    assert exclusion.with_point > exclusion.without_point + 0.01  # m
    report = result.write(tmp_path / "out", page=False)
    assert report["exclusions"][0]["name"] == name
    assert report["control"]["n_surveyed"] == 4 and report["control"]["n_scored"] == 3


def test_an_included_point_is_used_though_matching_refuses_it(folder):
    "A point surveyed 2 m off is refused as that of another object; included, it is used and warned"
    name = read_survey(folder).control.name[1]
    move(folder, name, 2.0)
    survey = read_survey(folder)
    with warnings.catch_warnings(action="ignore"):
        refused = mlscorr.match_targets(mlscorr.find_targets(survey), survey).refused
    assert name in [row.name for row in refused]
    with pytest.warns(UserWarning, match=f"{name} is used because include names it"):
        result = mlscorr.correct(survey.choosing(include=[name]))
    (row,) = rows_of(result, name)
    assert row.used and row.reason is None
    assert row.before[0] == pytest.approx(2.0, abs=0.1)  # m


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"exclude": ["T0I"]}, "the 4 control points; the nearest name is"),
        ({"include": ["T99"]}, "the 4 control points; the nearest name is"),
    ],
)
def test_a_name_that_is_none_is_refused_with_the_nearest(street, choice, words):
    "An unknown name is an error of survey.toml"
    with pytest.raises(SurveyFileError, match=words):
        read_survey(street).choosing(**choice)


def test_check_points_and_contradictions_are_refused(street):
    "A check point takes no part anyhow; a name can't be excluded and included"
    survey = read_survey(street)
    with pytest.raises(SurveyFileError, match="is a check point and never used"):
        survey.choosing(exclude=survey.check.name)
    with pytest.raises(SurveyFileError, match="both list"):
        survey.choosing(exclude=survey.control.name[:1], include=survey.control.name[:1])


def test_a_choice_can_be_taken_back(street):
    "Including an excluded point uses it again; excluding an included one leaves it out"
    survey = read_survey(street)
    first = survey.control.name[0]
    out = survey.choosing(exclude=[first])
    assert out.excluded.name == (first,) and first not in out.control.name
    assert set(out.surveyed.name) == set(survey.surveyed.name)
    back = out.choosing(include=[first])
    assert first in back.control.name and back.included == (first,) and not len(back.excluded)
