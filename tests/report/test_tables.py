"""What the report says in words and numbers."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support
from mlscorr.evaluate import TargetRow
from mlscorr.report import tables
from tests.beds.reports import because, drive, fabricate

ROLES = ("control", "check")


def held(report):
    "The same report of a drive that control points hold everywhere"
    return replace(report, support=Support())


def test_no_factor_is_boasted_of_where_the_cloud_may_be_as_far_off_as_it_was():
    "An extrapolated part, a missing check point or points left as they were take it away"
    report = held(fabricate(drive())[2])
    lost = TargetRow.unobserved(
        "C9", None, "check", np.zeros(3), because("No target is left for it.")
    )
    untouched = replace(report.coverage, points_outside_trajectory=7)
    assert "times closer" in tables.verdict(report)[0][0]
    for other in (
        fabricate(drive())[2],
        replace(report, targets=[*report.targets, lost]),
        replace(report, coverage=untouched),
    ):
        assert "times closer" not in " ".join(tables.verdict(other)[0])
    assert tables.verdict(replace(report, targets=[*report.targets, lost]))[1]


def test_the_verdict_gives_centimetres_where_they_tell_enough():
    "The sentence as the surveyor would say it"
    report = held(fabricate(drive())[2])
    for statistics, rmse in (
        (report.check.before, [0.7081, 0.2043, 0.2398]),
        (report.check.after, [0.0602, 0.0401, 0.0353]),
    ):
        statistics.rmse[:] = [*rmse, np.hypot(*rmse[:2]), np.linalg.norm(rmse)]
    assert tables.verdict(report) == (
        [
            "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places "
            "(10 times closer), as independent check points tell.",
            "Check points: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), "
            "2 points that took no part in the estimate.",
        ],
        False,
    )


@pytest.mark.parametrize(("sigma", "worse"), [(0.030, False), (0.005, True)])
@pytest.mark.parametrize("checks", [True, False], ids=["check", "left out"])
def test_a_rise_within_its_own_sigma_speaks_against_nothing(sigma, worse, checks):
    "From 8 to 16 mm on each axis, where it is known to 30 mm: no verdict; to 5 mm: a red one"
    report = held(fabricate(drive(), checks=checks)[2])
    known = {role: replace(getattr(report, role), sigma=np.full(3, sigma)) for role in ROLES}
    report = replace(report, **known)
    before, after, _ = report.judgement
    for statistics, rmse in ((before, 0.008), (after, 0.016)):
        statistics.rmse[:] = [rmse] * 3 + [rmse * 2**0.5, rmse * 3**0.5]
    sentences, speaks_against = tables.verdict(report)
    assert speaks_against == worse
    assert ("changed less than these targets tell" in sentences[0]) != worse
    assert ("made the cloud worse" in sentences[0]) == worse


def test_multiple_passes_are_counted_as_observations_of_points():
    "Eight observations of four points are not eight points"
    report = fabricate(drive(), 8, checks=False, names=["A", "B", "C", "D"] * 2)[2]
    assert tables.count(report, "control") == "8 observations of 4 points"


@pytest.mark.parametrize(
    ("changes", "labels"),
    [
        ({}, ["Check points, before", "Check points, after", "Control points, before"]),
        ({"checks": False}, ["Control points, before", "Control points, left out in turn"]),
        ({"count": 0}, ["Control points, before", "Control points, after (fit)"]),
    ],
)
def test_the_independent_rows_come_first(changes, labels):
    "Check points before control points; what there is none of has no row"
    rows = tables.rmse_rows(fabricate(drive(), **changes)[2])
    assert [row.label for row in rows][: len(labels)] == labels
    strong = [row.label for row in rows if row.strong]
    assert strong == [label for label in strong if "in turn" in label or "Check" in label]


def test_statistics_stand_in_the_order_of_their_heads():
    "Mean, std, RMSE, least and largest of each quantity, to 1e-12 m"
    report = fabricate(drive())[2]
    title, n, rows = tables.statistics_rows(report)[0]
    check = np.array([row.after for row in report.targets if row.role == "check"])
    assert (title, n, rows[2][0]) == ("Check points", len(check), "Height (vertical)")
    height = check[:, 2]
    expected = [height.mean(), height.std(ddof=1), np.sqrt(np.mean(height**2))]
    np.testing.assert_allclose(rows[2][2][:3], expected, atol=1e-12)
    np.testing.assert_allclose(rows[2][2][3:], [height.min(), height.max()], atol=1e-12)


def test_check_points_that_were_not_seen_are_not_said_to_be_none():
    "A surveyed one without an observation, none that was surveyed, and no surveyed point at all"
    report = fabricate(drive(), checks=False)[2]
    lost = TargetRow.unobserved(
        "C9", None, "check", np.zeros(3), because("No target is left for it.")
    )
    seen = tables.verdict(replace(report, targets=[*report.targets, lost]))[0][1]
    assert seen.startswith("No check point was seen. Control points, each left out in turn")
    assert tables.verdict(report)[0][1].startswith("There are no check points. Control points,")
    nothing = fabricate(drive(), count=0)[2]
    assert tables.verdict(nothing)[0][0].startswith("There is no surveyed point that could tell")
    assert tables.verdict(replace(nothing, targets=[lost]))[0][0].startswith("No target was found")
