"""Statistics are those of numpy, and rows say in documents what they are."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.evaluate import PointCounts, Score, Statistics, TargetRow
from mlscorr.survey import Statement
from tests.beds.reports import because

PLACE = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
UNKNOWN = np.full(3, np.nan)


def residuals(n, seed=1):
    return np.random.default_rng(seed).normal(0.0, 0.03, (n, 3))


def row(name="T01", role="control", pass_number=1, used=None, why=None, observed=True):
    "A row of a surveyed point that was observed 30 cm off and corrected to 1 mm"
    if used is None:
        used = role == "control" and why is None
    seen = PLACE - 0.3 if observed else UNKNOWN
    vectors = (PLACE, seen, np.full(3, 0.004), np.full(3, 0.3), np.full(3, 0.001), UNKNOWN)
    return TargetRow(name, pass_number, 413_200.5, role, *vectors, used, why)


@settings(max_examples=40, deadline=None)
@given(n=st.integers(2, 20), seed=st.integers(0, 1000))
def test_squares_are_those_of_mean_and_scatter(n, seed):
    "RMSE^2 = mean^2 + std^2 (n - 1) / n on each axis, and in plan and space by Pythagoras"
    statistics = Statistics.of(residuals(n, seed))
    both = statistics.mean**2 + statistics.std**2 * (n - 1) / n
    np.testing.assert_allclose(statistics.rmse**2, both, rtol=1e-9)
    e, north, height, plan, space = statistics.rmse**2
    assert plan == pytest.approx(e + north) and space == pytest.approx(plan + height)
    assert (statistics.minimum <= statistics.mean).all()
    assert (statistics.mean <= statistics.maximum).all()


def test_order_and_sign_matter_where_they_should():
    "Turned round, means change sign and RMSE, lengths and scatter don't"
    values = residuals(7)
    once = Statistics.of(values)
    back = Statistics.of(-values[::-1])
    np.testing.assert_allclose(back.mean[:3], -once.mean[:3])
    np.testing.assert_allclose(back.mean[3:], once.mean[3:])
    np.testing.assert_allclose(back.rmse, once.rmse)
    np.testing.assert_allclose(back.std, once.std)
    np.testing.assert_allclose(back.minimum[:3], -once.maximum[:3])


@pytest.mark.parametrize("n, known", [(0, ()), (1, ("rmse", "mean", "min", "max"))])
def test_what_so_few_residuals_do_not_have_is_none(n, known):
    "Of one residual no scatter, of none nothing at all; and JSON can hold it"
    document = Statistics.of(residuals(n)).document()
    for name in ("rmse", "mean", "std", "min", "max"):
        assert (document[name] is not None) == (name in known)
        assert (document[f"{name}_3d"] is not None) == (name in known)
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_the_document_has_each_number_under_its_name():
    "Axes in lists of three, plan and space beside them"
    values = residuals(9)
    document = Statistics.of(values).document()
    assert document["rmse"] == pytest.approx(np.sqrt((values**2).mean(axis=0)))
    assert document["std"] == pytest.approx(values.std(axis=0, ddof=1))
    lengths = np.linalg.norm(values[:, :2], axis=1)
    assert document["max_horizontal"] == pytest.approx(lengths.max())
    assert document["mean_horizontal"] == pytest.approx(lengths.mean())
    assert document["rmse_3d"] == pytest.approx(np.sqrt((values**2).sum(axis=1).mean()))
    assert len(document) == 15


def test_the_table_has_a_line_for_each_axis():
    "E, N, H, horizontal, 3D down; RMSE, mean, std, least and largest across"
    statistics = Statistics.of(residuals(5))
    assert statistics.table.shape == (5, 5)
    np.testing.assert_array_equal(statistics.table[:, 0], statistics.rmse)
    np.testing.assert_array_equal(
        statistics.table[2],
        [
            statistics.rmse[2],
            statistics.mean[2],
            statistics.std[2],
            statistics.minimum[2],
            statistics.maximum[2],
        ],
    )


def test_a_score_tells_before_after_and_left_out():
    "Its number is that after the correction; left-out ones stand beside it, or not at all"
    before, after, left = (Statistics.of(residuals(n)) for n in (8, 8, 5))
    plain = Score(before, after).document()
    full = Score(before, after, left).document()
    assert plain["n"] == full["n"] == 8 and "leave_one_out" not in plain
    assert full["leave_one_out"]["n"] == 5
    assert full["before"] == before.document() and full["after"] == after.document()


@pytest.mark.parametrize(
    ("role", "used", "observed", "group"),
    [
        ("control", True, True, "control"),
        ("control", False, True, "unused"),
        ("check", False, True, "check"),
        ("check", False, False, "unused"),
    ],
)
def test_rows_belong_to_a_group(role, used, observed, group):
    "Control that took part, check points that were observed, and all else"
    assert row(role=role, used=used, why=because("hidden"), observed=observed).group == group


@pytest.mark.parametrize(
    "given_row",
    [
        row(),
        row(observed=False, why=because("hidden")),
        TargetRow.unobserved(
            "T09", None, "control", PLACE, because("No target was found."), scanned=False
        ),
    ],
)
def test_a_row_comes_back_from_its_document(given_row):
    "Written as JSON and read, it is the same to the last bit, unknown vectors included"
    text = json.dumps(given_row.document(), allow_nan=False)
    back = TargetRow.read(json.loads(text))
    for name in vars(given_row).keys() - {"why"}:
        np.testing.assert_array_equal(getattr(back, name), getattr(given_row, name))
    assert back.reason == given_row.reason
    assert back.group == given_row.group and back.is_observed == given_row.is_observed


def test_a_point_without_observation_knows_its_place_alone():
    "Surveyed, with a reason; nothing observed, corrected or used"
    unseen = TargetRow.unobserved("T09", 2, "check", PLACE, because("hidden by a van"))
    assert not unseen.is_observed and not unseen.used and unseen.scanned
    assert unseen.gps_time is None and unseen.group == "unused"
    assert np.isnan([unseen.observed, unseen.before, unseen.after, unseen.left_out]).all()


ROWS = [
    row("T01"),
    row("T01", pass_number=2),
    row("T02", why=because("outlier")),
    row("T03", why=because("too far off")),
    row("T03", pass_number=2),
    TargetRow.unobserved("T04", None, "control", PLACE, because("hidden")),
    TargetRow.unobserved("T05", None, "control", PLACE, because("far away"), scanned=False),
    row("C1", "check", why=Statement("check point")),
    TargetRow.unobserved("C2", None, "check", PLACE, because("hidden too")),
]


def test_points_are_counted_once_whatever_their_passes():
    "Five control points: three seen, of these two used in one pass at least, one hidden"
    counts = PointCounts.of(ROWS, "control")
    assert (counts.surveyed, counts.observed, counts.scored) == (5, 3, 2)
    assert counts.missing == (("T04", because("hidden")),)
    assert counts.refused == (("T02", because("outlier")),)
    check = PointCounts.of(ROWS, "check")
    assert (check.surveyed, check.observed, check.scored) == (2, 1, 1)
    assert check.missing == (("C2", because("hidden too")),) and check.refused == ()


def test_counts_do_not_hang_on_the_order_of_rows():
    "Backward: the same numbers and the same names"
    for role in ("control", "check"):
        forward, backward = (PointCounts.of(rows, role) for rows in (ROWS, ROWS[::-1]))
        assert forward.document() == backward.document()


def test_counts_stand_in_the_report_under_their_names():
    "n_surveyed, n_seen, n_scored, n_unseen, and each unseen one with its reason"
    document = PointCounts.of(ROWS, "control").document()
    assert document == {
        "n_surveyed": 5,
        "n_seen": 3,
        "n_scored": 2,
        "n_unseen": 1,
        "unseen": [{"name": "T04", "reason": "hidden"}],
    }
