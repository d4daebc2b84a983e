"""The report of a correction as a document."""

import hashlib
import json

import numpy as np
import pytest

from mlscorr.evaluate import TargetRow
from mlscorr.io.store import document
from mlscorr.report import FileRow
from mlscorr.report.correction_report import ordered, recomputed
from tests.beds.reports import because, drive, fabricate
from tests.beds.street_of_points import ORIGIN, shifted, target


def test_report_json_tells_the_accuracy_and_the_files(commanded):
    "The accuracy by the check point, and the hash of every file that was read and written"
    folder = commanded[1].parents[1] / "Erste Fahrt"
    out = commanded[1]
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    check = report["check"]["after"]
    assert report["accuracy"]["points"] == 1 and not report["accuracy"]["conformant"]
    assert report["accuracy"]["fit"]["rmse_horizontal"] == pytest.approx(check["rmse_horizontal"])
    assert report["accuracy"]["rmse_horizontal"] > check["rmse_horizontal"]
    assert [row["what"] for row in report["inputs"]][:4] == [
        "survey",
        "cloud",
        "trajectory",
        "control",
    ]
    for rows, place in ((report["inputs"], folder), (report["outputs"] + report["files"], out)):
        for row in rows:
            content = (place / row["name"]).read_bytes()
            assert row["sha256"] == hashlib.sha256(content).hexdigest()
    control = [row for row in report["targets"] if row["role"] == "control" and row["used"]]
    left_out = np.array([row["left_out"] for row in control])
    assert np.sqrt((left_out**2).mean(axis=0)) == pytest.approx(
        report["control"]["leave_one_out"]["rmse"]
    )


def test_rows_come_back_from_the_document():
    "A target in report.json is read as the same row, with its unknown numbers"
    rows = fabricate(drive())[2].targets
    rows.append(
        TargetRow.unobserved("LOST", 2, "check", ORIGIN, because("no returns within 0.5 m"))
    )
    for row in rows:
        content = json.loads(json.dumps(document("row", row.document())))
        again = TargetRow.read(content)
        assert document("row", again.document()) == content
        assert (again.group, again.is_observed) == (row.group, row.is_observed)
        np.testing.assert_array_equal(again.left_out, row.left_out)


def test_the_document_has_its_parts_in_order():
    "As scripts rely on: targets, scores, model, coverage, ties, files"
    report = fabricate(drive())[2]
    content = report.document()
    assert list(content) == [
        *("name", "crs", "notes", "targets", "control", "check", "accuracy", "model"),
        "datum",
        *("coverage", "ties", "weak", "drift", "jumps", "position_sigma", "assumed"),
        "next_control",
        *("files", "inputs", "outputs"),
        *("project", "recorded", "check_sigmas", "well_determined"),
    ]
    assert list(content["targets"][0])[:4] == ["name", "pass", "gps_time", "role"]
    for role, n in (("control", 6), ("check", 2)):
        assert [content[role][key] for key in ("n_surveyed", "n_seen", "n_scored")] == [n, n, n]
    assert list(content["weak"][0]) == ["from", "to", "length_m", "chainage", "sigma", "why"]
    assert content["coverage"]["points_untouched"] == 0
    assert content["coverage"]["share_extrapolated"] == pytest.approx(40_000 / 1_234_567)
    assert "leave_one_out" in content["control"] and "leave_one_out" not in content["check"]
    assert report.cloud_points == 1_234_567
    assert list(FileRow("a.csv", "ab", "targets", bytes=3).document()) == [
        "what",
        "name",
        "bytes",
        "sha256",
    ]


@pytest.mark.parametrize(
    ("changes", "kind"),
    [({}, "check"), ({"checks": False}, "leave-one-out"), ({"count": 1}, "fit")],
)
def test_a_verdict_rests_on_the_most_independent_points(changes, kind):
    "Check points, else those left out in turn, else the fit, else nothing"
    assert fabricate(drive(), **changes)[2].judgement[2] == kind
    assert fabricate(drive(), count=0)[2].judgement == (None, None, "nothing")


def test_rows_are_ordered_by_group_and_time():
    "Control, then check, then unused, each in time"
    rows = fabricate(drive())[2].targets
    rows.append(TargetRow.unobserved("LOST", None, "control", ORIGIN, because("hidden")))
    groups = [row.group for row in ordered(rows[::-1])]
    assert groups == sorted(groups, key=("control", "check", "unused").index)
    times = [row.gps_time for row in ordered(rows[::-1], "control")]
    assert times == sorted(times) and len(times) == 6


def test_misclosures_are_made_anew_by_another_correction():
    "A correction by 0.2 m east leaves 0.1 of 0.3 m, to 1e-6 m; unseen rows stay as they are"
    lost = TargetRow.unobserved("T2", None, "check", ORIGIN, because("hidden"))
    row, other = recomputed([lost, target("T1", ORIGIN)], shifted(np.array([0.2, 0.0, 0.0])))
    np.testing.assert_allclose(row.before, [0.3, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(row.after, [0.1, 0.0, 0.0], atol=1e-6)
    assert other is lost
