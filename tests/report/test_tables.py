"""The tables of a report."""

import numpy as np
import pytest

from mlscorr.report import tables
from tests.beds.reports import drive, fabricate


@pytest.mark.parametrize(
    ("changes", "labels"),
    [
        ({}, ["Check points, before", "Check points, after", "Control points, before"]),
        ({"checks": False}, ["Control points, before", "Control points, leave-one-out"]),
        ({"count": 0}, ["Control points, before", "Control points, after (fit)"]),
    ],
)
def test_the_independent_rows_come_first(changes, labels):
    "Check points before control points; what there is none of has no row"
    rows = tables.rmse_rows(fabricate(drive(), **changes)[2])
    assert [row.label for row in rows][: len(labels)] == labels
    strong = [row.label for row in rows if row.strong]
    assert strong == [label for label in strong if "leave-one-out" in label or "Check" in label]


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
