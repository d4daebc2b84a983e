"""Two results of correct side by side: known differences come back."""

import json
import shutil

import numpy as np
import pytest

import mlscorr
from mlscorr.io.trajectories import read_trajectory, write_trajectory_csv
from mlscorr.survey import Trajectory


@pytest.fixture
def pair(commanded, tmp_path):
    "Two folders with the same result: (first, second)"
    _, out = commanded
    return [shutil.copytree(out, tmp_path / name) for name in ("one", "two")]


def rewritten(folder, change):
    "Change the corrected trajectory of a result"
    path = folder / "trajectory.csv"
    write_trajectory_csv(path, change(read_trajectory(path)))


def reported(folder, change):
    "Change the report.json of a result"
    path = folder / "report.json"
    report = json.loads(path.read_text())
    change(report)
    path.write_text(json.dumps(report))


def moved(shift, seconds=0.0, rows=slice(None)):
    "A change of a trajectory: so many metres further, so many seconds later, some epochs alone"

    def change(t):
        sigmas = t.position_sigma[rows], t.attitude_sigma[rows]
        place = t.position[rows] + shift
        return Trajectory(t.gps_time[rows] + seconds, place, t.attitude[rows], *sigmas)

    return change


def test_a_shift_of_the_trajectory_comes_back(pair):
    "0.100 m in easting and -0.030 m in height are stated within 1e-4 m, at all epochs"
    rewritten(pair[1], moved([0.1, 0.0, -0.03]))
    section = mlscorr.compare_results(*pair).document["trajectory"]
    for name, shift in {"easting": 0.1, "northing": 0.0, "height": -0.03}.items():
        row = section["difference"][name]
        assert abs(row["median"] - shift) < 1e-4 and abs(row["largest"] - shift) < 1e-4
        assert abs(row["rms"] - abs(shift)) < 1e-4
    assert abs(section["difference"]["3d"]["largest"] - np.hypot(0.1, 0.03)) < 1e-4
    assert section["interpolated"] == 0 and section["epochs_only_in"] == {"first": 0, "second": 0}


def test_other_epochs_are_interpolated_and_counted(pair):
    "Every second epoch is missing in the second: the shift is found at all, half interpolated"
    rewritten(pair[1], moved([0.0, 0.1, 0.0], rows=slice(None, None, 2)))
    found = mlscorr.compare_results(*pair).difference
    assert found.interpolated == 400 and len(found.gps_time) == 801
    assert np.abs(found.position - [0.0, 0.1, 0.0]).max() < 5e-4  # what 0.02 s of a turn bend


def test_epochs_of_one_result_alone_are_counted(pair):
    "The last 100 epochs of the first have no partner, and take no part"
    rewritten(pair[1], moved(0.0, rows=slice(701)))
    section = mlscorr.compare_results(*pair).document["trajectory"]
    assert section["epochs"] == 701 and section["epochs_only_in"] == {"first": 100, "second": 0}
    assert section["difference"]["3d"]["largest"] == 0.0


def test_gaps_are_not_crossed(pair):
    "Nothing is interpolated across a gap of a second in the second result"
    keep = np.r_[0:301, 400:801]
    rewritten(pair[1], moved(0.0, rows=keep))
    section = mlscorr.compare_results(*pair).document["trajectory"]
    assert section["epochs"] == len(keep) and section["interpolated"] == 0
    assert section["epochs_only_in"]["first"] == 99


def test_equal_results_are_said_to_be_equal(pair):
    "A folder and its copy differ in nothing, and the page of that is green"
    document = mlscorr.compare_results(*pair).document
    assert document["rating"] == "green"
    assert not any(
        row["differs"] for name in ("model", "coverage", "files") for row in document[name]
    )
    assert max(row["change_3d"] for row in document["targets"]) == 0.0


def test_what_differs_in_reports_is_named(pair):
    "A refused target, a warning, another order and another input each have their row"

    def change(report):
        target = next(row for row in report["targets"] if row["name"] == "T02")
        target |= {"used": False, "reason": "it was knocked over"}
        target["after"][2] += 0.05
        report["model"]["order"] = 2
        report["model"]["warnings"].append("The control is thin.")
        report["inputs"][-1]["sha256"] = "0" * 64

    reported(pair[1], change)
    document = mlscorr.compare_results(*pair).document
    worst = document["targets"][0]
    assert worst["name"] == "T02" and abs(worst["change_3d"] - 0.05) < 1e-9
    assert worst["used"] == {"first": True, "second": False}
    assert worst["reason"]["second"] == "it was knocked over"
    assert document["warnings"] == {"first": [], "second": ["The control is thin."]}
    differing = {
        row["what"]: (row["first"], row["second"]) for row in document["model"] if row["differs"]
    }
    assert differing == {"order": (0, 2)}
    assert [row["name"] for row in document["files"] if row["differs"]] == ["control.csv"]
    assert document["rating"] == "amber"


@pytest.mark.long
def test_a_moved_control_point_comes_back(street, tmp_path):
    "A control point 0.100 m further east in the second survey is stated within 1e-4 m"
    outs = []
    for name, shift in (("as surveyed", 0.0), ("moved", 0.1)):
        folder = shutil.copytree(street, tmp_path / name)
        path = folder / "control.csv"
        header, *rows = (line.split(",") for line in path.read_text().splitlines())
        for row in rows:
            if row[0] == "T02":
                row[1] = f"{float(row[1]) + shift:.4f}"
        path.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
        outs.append(tmp_path / f"{name} corrected")
        mlscorr.correct(mlscorr.read_survey(folder)).write(outs[-1], page=False)
    document = mlscorr.compare_results(*outs).document
    row = next(row for row in document["targets"] if row["name"] == "T02")
    assert np.abs(np.array(row["surveyed"]["difference"]) - [0.1, 0.0, 0.0]).max() < 1e-4
    assert row["used"] == {"first": True, "second": False} and row["reason"]["second"]
    assert [row["name"] for row in document["files"] if row["differs"] and row["is_input"]] == [
        "control.csv"
    ]


def test_the_value_writes_a_document_and_a_page(pair, tmp_path):
    "Both files stand in the folder, the page holds its figure, and a frame has a row a target"
    rewritten(pair[1], moved([0.1, 0.0, 0.0]))
    result = mlscorr.compare_results(*pair)
    result.write(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"compare_results.json", "compare_results.html"}
    written = json.loads((tmp_path / "out" / "compare_results.json").read_text())
    assert written["schema"] == "mlscorr.compare_results/1"
    page = (tmp_path / "out" / "compare_results.html").read_text()
    assert "data:image/svg+xml" in page and "10.0 cm" in page
    assert len(result.to_frame()) == len(written["targets"]) == 5
    assert len(result.plot().axes) == 3
    assert "easting" in repr(result)


def test_different_surveys_are_refused_with_a_way_out(pair):
    "No common time, no common target, another CRS, the same folder twice"
    with pytest.raises(ValueError, match=r"Both results are .*two different folders"):
        mlscorr.compare_results(pair[0], pair[0])
    rewritten(pair[1], moved(0.0, seconds=3600.0))
    with pytest.raises(
        ValueError, match=r"do not overlap in time: \[.*\] s .*two results of one survey"
    ):
        mlscorr.compare_results(*pair)

    def rename(report):
        for row in report["targets"]:
            row["name"] += "-b"

    reported(pair[1], rename)
    with pytest.raises(ValueError, match=r"no common target: 5 in .*same control list"):
        mlscorr.compare_results(*pair)
    reported(pair[1], lambda report: report.update(crs="EPSG:32651"))
    with pytest.raises(ValueError, match=r"different CRS: EPSG:32650 in .*EPSG:32651"):
        mlscorr.compare_results(*pair)


def test_what_is_no_result_is_refused(pair, tmp_path, street):
    "A survey, a cut report, another document, a project"
    with pytest.raises(
        ValueError,
        match="not a result of mlscorr correct: it has no "
        r"report\.json",
    ):
        mlscorr.compare_results(pair[0], street)
    report = pair[1] / "report.json"
    whole = report.read_text()
    report.write_text(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"not a JSON document: .*interrupted"):
        mlscorr.compare_results(*pair)
    report.write_text(whole.replace("mlscorr.report/1", "mlscorr.report/9", 1))
    with pytest.raises(ValueError, match=r"schema 'mlscorr\.report/9', not"):
        mlscorr.compare_results(*pair)
    report.write_text('{"schema": "mlscorr.report/1"}')
    with pytest.raises(ValueError, match="check, control, coverage"):
        mlscorr.compare_results(*pair)
    report.rename(pair[1] / "project.json")
    with pytest.raises(ValueError, match=r"results of a project\. Compare the folders"):
        mlscorr.compare_results(*pair)
