"""Every surveyed point and pass has its row, with what is known of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mlscorr.correction import Correction
from mlscorr.estimate import TargetTest
from mlscorr.evaluate import PointCounts, surveyed_rows, unseen_rows
from mlscorr.evaluate.scores import target_rows
from mlscorr.matching import Refusal
from mlscorr.survey import PointCloud, Statement, Survey
from mlscorr.targets import NO_POINTS, Candidates
from tests.beds.streets import SHIFT, SIGMA, TIME, observed, targets, trajectory


def reason(why):
    return Statement("not matched", values={"why": why})


@pytest.fixture(scope="module")
def correction():
    "One that moves all by SHIFT"
    drive = trajectory()
    return Correction(drive, replace(drive, position=drive.position + SHIFT))


@pytest.fixture(scope="module")
def matched():
    place, time = targets(np.random.default_rng(1))
    return observed(place, time, place + SHIFT)


def test_control_stands_before_check(matched, correction):
    "In the order of the observations, each with its role; check points took no part"
    rows = surveyed_rows(matched[:10], matched[10:], correction, ())
    assert [row.name for row in rows] == list(matched.name)
    assert [row.role for row in rows] == ["control"] * 10 + ["check"] * 6
    assert [row.used for row in rows] == [True] * 10 + [False] * 6
    assert {row.why.key for row in rows[10:]} == {"check point"}


def test_outliers_give_their_statistic(matched, correction):
    "Rejected control points are not used, in all passes, and say by how much"
    twice = matched[np.append(np.arange(16), 4)]
    test = TargetTest("T04", 41.26, 16.27, *np.full((3, 1, 3), np.nan))
    rows = surveyed_rows(twice, matched[:0], correction, [test])
    wrong = [row for row in rows if not row.used]
    assert [row.name for row in wrong] == ["T04", "T04"]
    assert {row.why.key for row in wrong} == {"outlier"}
    assert wrong[0].why.values == {"statistic": 41.26, "critical": 16.27}


def test_rows_hold_misclosures_and_their_sigma(matched, correction):
    "Surveyed - observed as recorded and as corrected; sigma by survey and extraction"
    left_out = np.full((16, 3), 0.01)
    left_out[3] = np.nan
    rows = target_rows(matched, correction, "control", [None] * 16, left_out)
    for i, row in enumerate(rows):
        np.testing.assert_allclose(row.before, SHIFT, atol=1e-9)
        np.testing.assert_allclose(row.after, 0.0, atol=1e-9)
        np.testing.assert_allclose(row.surveyed - row.observed, row.before, atol=1e-9)
        np.testing.assert_allclose(row.sigma, np.hypot(SIGMA, 1e-3))
        assert np.isnan(row.left_out).all() == (i == 3)
        assert row.gps_time == matched.gps_time[i] and row.pass_number == 1


def survey_of(matched):
    points = matched.surveyed
    drive = trajectory()
    return Survey("street", Path("survey.toml"), None, (), drive, None, points[:12], points[12:])


def candidates(unplaced=None):
    "Candidates of a cloud: points without a pose, and nothing else"
    return Candidates(NO_POINTS, np.zeros(0, int), NO_POINTS if unplaced is None else unplaced, {})


def test_unseen_points_have_the_reason_of_the_matching(matched):
    "Role and place from the survey; whether points of the cloud lie about it"
    survey = survey_of(matched)
    refusals = [Refusal("T02", 1, reason("hidden")), Refusal("T14", None, reason("not there"))]
    first, second = unseen_rows(survey, refusals, candidates(), {"T14"})
    assert (first.name, first.role, first.pass_number) == ("T02", "control", 1)
    assert not first.scanned
    assert (second.name, second.role, second.scanned) == ("T14", "check", True)
    assert (first.reason, second.reason) == ("hidden", "not there")
    np.testing.assert_array_equal(first.surveyed, matched.surveyed.position[2])
    assert not first.is_observed and not second.used


def test_an_observation_that_was_refused_leaves_its_time(matched):
    "So that what was found, and does not fit, is told apart from what nobody saw"
    refusals = [
        Refusal("T02", 1, reason("too far off"), TIME + 3.0),
        Refusal("T03", None, reason("not there")),
    ]
    refused, unseen = unseen_rows(survey_of(matched), refusals, candidates(), {"T02", "T03"})
    assert (refused.gps_time, unseen.gps_time) == (TIME + 3.0, None)
    assert not refused.is_observed and not refused.used
    counts = PointCounts.of([refused, unseen], "control")
    assert [name for name, _ in counts.misplaced] == ["T02"]
    assert [name for name, _ in counts.hidden] == ["T03"]
    assert len(counts.missing) == 2


def test_points_without_a_pose_are_the_better_reason(matched):
    "25 points about it in a gap: how many, when, and that nothing is interpolated there"
    survey = survey_of(matched)
    place = matched.surveyed.position[5] + np.random.default_rng(1).normal(0.0, 0.2, (25, 3))
    time = TIME + 41.0 + np.linspace(0.0, 2.5, 25)
    far = PointCloud(place + 500.0, time + 10.0, np.zeros(25))
    near = PointCloud(place, time, np.zeros(25))
    both = PointCloud.concatenate([near, far])
    refusals = [
        Refusal("T05", None, reason("not there")),
        Refusal("T09", None, reason("not there")),
    ]
    lost, other = unseen_rows(survey, refusals, candidates(both), ())
    assert lost.why.key == "no pose" and lost.scanned
    assert lost.why.values == {"points": 25, "start": TIME + 41.0, "end": TIME + 43.5}
    assert other.reason == "not there" and not other.scanned
