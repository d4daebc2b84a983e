"""First statements of a project on its drives."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support
from mlscorr.evaluate import TargetRow
from mlscorr.io.store import FileIdentity, TaskStore, digest
from mlscorr.pipeline.project.document import _reason, older_results
from mlscorr.pipeline.project.tasks import Written
from mlscorr.report import first_screen
from tests.beds.reports import because, drive, fabricate

CHANGES = {  # what a drive lacks, and what of its first screen says so
    "hidden check point": "1 check point was not found although the cloud covers the surroundings",
    "no check point": "No check point was surveyed: there is no independent test of this result.",
    "worse axis": "The RMSE of 2 points increased after the correction: N by 0.012 m.",
    "warning": "The clock may be wrong.",
}


@pytest.mark.parametrize("lack", CHANGES)
def test_a_doubt_is_told_by_its_reason(lack):
    "Not by the result, which may be good: 77 cm became 8 cm, and a check point is missing"
    checks = lack != "no check point"
    report = replace(fabricate(drive(), checks=checks)[2], support=Support())
    if lack == "hidden check point":
        lost = TargetRow.unobserved("C9", None, "check", np.zeros(3), because("C9 is hidden."))
        report = replace(report, targets=[*report.targets, lost])
    if lack == "worse axis":
        report.check.after.rmse[1] = report.check.before.rmse[1] + 0.012
    if lack == "warning":
        report.model["warnings"] = [CHANGES[lack]]
    content = first_screen(report)
    assert content["rating"] != "green"
    assert CHANGES[lack] in _reason({"rating": content["rating"], "meaning": ""}, content)


def test_files_of_earlier_reports_are_named(tmp_path):
    "Of other results, as they were written: no file that was replaced or changed, none of the same"

    def report(name, *files):
        outputs = tuple((file, FileIdentity.of(tmp_path / file)) for file in files)
        return Written({"name": name, "outputs": list(files)}, outputs)

    for name in ("page.html", "old.sbet", "new.csv", "notes.txt", "map.png"):
        (tmp_path / name).write_text(name)
    before = report("before", "old.sbet", "new.csv", "notes.txt")
    same = report("now", "new.csv", "map.png")
    now = report("now", "new.csv")
    (tmp_path / "notes.txt").write_text("of somebody, by now")
    store = TaskStore(tmp_path / "tasks")
    for number, each in enumerate((before, same, now)):
        store.put("reports", digest(number), (each, ()))
    assert older_results(store, [now]) == ["old.sbet"]


def test_the_first_warning_of_a_drive_is_told_beside_its_doubt():
    "A cloud of another survey is a warning, and the cause of all else that is wrong with the drive"
    report = replace(fabricate(drive(), checks=False)[2], support=Support())
    report.model["warnings"] = ["The points lie 400 km beside the trajectory."]
    content = first_screen(report)
    reason = _reason({"rating": content["rating"], "meaning": ""}, content)
    assert reason.startswith("No check point was surveyed")
    assert reason.endswith("the trajectory.")
