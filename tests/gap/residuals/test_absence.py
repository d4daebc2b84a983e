"""Evidence from targets that have no residual."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.gap.evidence.decision import with_absence
from mlscorr.gap.residuals import Absence, find_absence
from mlscorr.gap.residuals.absence import AbsentRun
from mlscorr.matching import Matches, Refusal
from mlscorr.survey import ControlPoints, Statement, Survey, TargetObservations, Trajectory

TIME = np.arange(0.0, 100.0, 0.1)  # s
CLEAN = {"none": 0.95, "time_offset": 0.03, "unknown": 0.02}


def reason(why):
    return Statement("not matched", values={"why": why})


def survey_of(names):
    "A straight drive of 10 m/s past a target 8 m beside it every 5 s"
    n = len(names)
    path = np.outer(TIME, [10.0, 0.0, 0.0])
    place = np.column_stack([50.0 * (1 + np.arange(n)), np.full(n, 8.0), np.zeros(n)])
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    looks = ("circle",) * n, np.full(n, 0.6)
    points = ControlPoints(names, place, np.full((n, 3), 0.003), *looks, up)
    trajectory = Trajectory(TIME, path, Rotation.identity(len(TIME)))
    none = points[np.zeros(n, bool)]
    return Survey("street", Path("survey.toml"), None, (), trajectory, None, points, none)


def matches_of(survey, missing, refusals=()):
    "Matches of all targets but some"
    rows = np.array([name not in missing for name in survey.control.name])
    points = survey.control[rows]
    n = int(rows.sum())
    observed = TargetObservations(
        points.name,
        np.ones(n, int),
        points.position[:, 0] / 10,
        points.position,
        np.tile(1e-6 * np.eye(3), (n, 1, 1)),
        points.normal,
        points.kind,
        points.size,
        np.full(n, 300),
    )
    return Matches(observed, observed[:0], tuple(refusals), np.ones(n), ())


NAMES = tuple(f"T{i:02d}" for i in range(15))


def test_a_lone_missing_target_is_no_run():
    "Two targets that are missing apart from each other, and one far off the road, say nothing"
    survey = survey_of(NAMES)
    absence = find_absence(survey, matches_of(survey, ("T04", "T09")))
    assert absence.runs == () and absence.missing == 2
    assert with_absence(CLEAN, absence) == CLEAN


def test_none_is_not_said_over_a_run_of_missing_targets():
    "Two neighbours that are missing, one of them refused: unknown leads, by names and times"
    survey = survey_of(NAMES)
    refusal = Refusal("T05", 1, reason("T05 isn't surely its target."), 30.2)
    (run,) = find_absence(survey, matches_of(survey, ("T04", "T05"), [refusal])).runs
    assert run.name == ("T04", "T05")
    assert run.gps_time == pytest.approx((25.0, 30.2), abs=0.1)
    assert run.reason[1] == refusal.reason
    absence = find_absence(survey, matches_of(survey, ("T04", "T05"), [refusal]))
    probability = with_absence(CLEAN, absence)
    assert next(iter(probability)) == "unknown"
    assert sum(probability.values()) == pytest.approx(1.0)
    assert probability["time_offset"] == CLEAN["time_offset"]
    assert "T05 isn't surely its target." in absence.warnings[0]


def test_longer_runs_are_less_by_chance():
    "Five in a row leave less than 1 % to none, two less than a half"
    survey = survey_of(NAMES)
    two, five = (find_absence(survey, matches_of(survey, NAMES[4:end])) for end in (6, 9))
    assert five.chance < two.chance < 1.0
    assert with_absence(CLEAN, five)["none"] < 0.01 < with_absence(CLEAN, two)["none"] < 0.49


def test_targets_out_of_sight_are_not_missed():
    "Neighbours 50 m off the road, where others were seen at 8 m, are not expected"
    survey = survey_of(NAMES)
    survey.control.position[4:7, 1] = 50.0
    assert find_absence(survey, matches_of(survey, NAMES[4:7])) == Absence((), 12, 0)


def test_a_target_hidden_in_two_passes_is_missed_once():
    "Two neighbours that both passes miss are a run of two, not of four: no less by chance"
    twice = AbsentRun(("T04", "T05", "T05", "T04"), (25.0, 30.0, 65.0, 70.0), ("",) * 4)
    once = AbsentRun(("T04", "T05"), (25.0, 30.0), ("",) * 2)
    assert "the 2 surveyed targets T04, T05 were" in twice.hint
    assert Absence((twice,), 30, 4).chance == pytest.approx(Absence((once,), 30, 2).chance, rel=0.2)
