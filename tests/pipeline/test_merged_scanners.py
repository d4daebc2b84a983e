"""One LAZ of two scanners, told apart by point_source_id: the same as two files of theirs."""

import json
import re
import shutil
import tomllib
import warnings

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.correction import Correction
from mlscorr.estimate import corrected_mounting
from mlscorr.io.clouds import count_sources, read_chunks, read_layout
from mlscorr.io.surveys import write_survey_copy
from mlscorr.pipeline.clouds import write_clouds
from tests.beds import scanner_pair

pytestmark = pytest.mark.long

FILES = {11: ["pass-1.laz", "pass-2.laz"], 12: ["pass-1-scanner-2.laz", "pass-2-scanner-2.laz"]}


@pytest.fixture(scope="module")
def apart(tmp_path_factory):
    "Folder of a street driven there and back with two scanners, each with files of its own"
    survey = scanner_pair.simulated(6.0, control=4, points=250)
    return scanner_pair.write(survey, tmp_path_factory.mktemp("two files") / "survey")


@pytest.fixture(scope="module")
def merged(apart, tmp_path_factory):
    "The same with all points in one file, in order of time, and the scanner of each in its id"
    folder = shutil.copytree(apart, tmp_path_factory.mktemp("one file") / "survey")
    clouds = {name: laspy.read(folder / name) for names in FILES.values() for name in names}
    whole = laspy.LasData(clouds["pass-1.laz"].header)
    points = []
    for number, names in FILES.items():
        for name in names:
            clouds[name].point_source_id[:] = number
            points.append(clouds[name].points.array)
            (folder / name).unlink()
    points = np.concatenate(points)
    points = points[np.argsort(points["gps_time"], kind="stable")]
    whole.points = laspy.ScaleAwarePointRecord(
        points, whole.header.point_format, whole.header.scales, whole.header.offsets
    )
    whole.write(folder / "merged.laz")
    text = (folder / "survey.toml").read_text()
    text = re.sub(r'files = \["pass-1.laz", "pass-1-.*', 'files = ["merged.laz"]', text)
    text = re.sub(r'files = \["pass-1.laz".*', "point_source_ids = [11]", text)
    text = re.sub(r'files = \["pass-1-scan.*', 'files = ["merg*"]\npoint_source_ids = [12]', text)
    (folder / "survey.toml").write_text(text)
    return folder


def written(folder, out, sigma=False):
    "Points that correct writes, of each scanner in order of time, and its report"
    with warnings.catch_warnings(action="ignore"):  # four points near each other tell little
        result = mlscorr.correct(mlscorr.read_survey(folder), ties="off")
        result.write(out, sigma=sigma, page=False)
    return points_of(out), json.loads((out / "report.json").read_text())


def points_of(out):
    "Rows (n, 3) of each scanner from two files, or by their ids from one"
    if (out / "merged.laz").exists():
        las = laspy.read(out / "merged.laz")
        return [las.points[las.point_source_id == number] for number in FILES]
    return [[laspy.read(out / name) for name in names] for names in FILES.values()]


def xyz(points):
    if isinstance(points, list):
        return np.concatenate([las.xyz for las in points])
    return np.column_stack([points.x, points.y, points.z])


def test_points_are_counted_and_read_by_scanner(apart, merged):
    "Each scanner has its own points, as many as in its files, and all of the file is of one"
    survey = mlscorr.read_survey(merged)
    other = mlscorr.read_survey(apart)
    assert survey.points == other.points == laspy.read(merged / "merged.laz").header.point_count
    assert [cloud.point_source_ids for cloud in survey.clouds] == [(11,), (12,)]
    assert survey.scanner_numbers.tolist() == [0, 1]
    for cloud, names, number in zip(survey.clouds, FILES.values(), FILES, strict=True):
        chunks = list(read_chunks(cloud, 10_000))
        assert sum(map(len, chunks)) == cloud.points
        place = np.concatenate([chunk.xyz for chunk in chunks])
        files = [laspy.read(apart / name) for name in names]
        assert np.array_equal(place, np.concatenate([las.xyz for las in files]))
        counts = count_sources(read_layout(merged / "merged.laz"))
        assert counts[number] == cloud.points
    assert any("1 wrote merged.laz (point_source_id 11); 2 wrote" in note for note in survey.notes)


def test_a_merged_cloud_is_corrected_as_two_files_are(apart, merged, tmp_path):
    "Targets, coordinates and sigmas are the same; the file keeps its points in their order"
    two, before = written(apart, tmp_path / "two", sigma=True)
    one, report = written(merged, tmp_path / "one", sigma=True)
    for files, points in zip(two, one, strict=True):
        assert np.abs(xyz(points) - xyz(files)).max() < 1e-6  # m
        sigma = np.concatenate([las.sigma_height for las in files])
        assert np.array_equal(np.asarray(points.sigma_height), sigma)
    assert report["targets"] == before["targets"]
    assert report["coverage"] == before["coverage"]
    (row,) = report["files"]
    assert (row["name"], row["points"]) == ("merged.laz", sum(f["points"] for f in before["files"]))
    old, new = (laspy.read(folder / "merged.laz") for folder in (merged, tmp_path / "one"))
    for name in ("gps_time", "intensity", "point_source_id"):
        assert np.array_equal(old[name], new[name])


def test_points_of_each_scanner_move_by_its_own_mounting(apart, merged, tmp_path):
    "Two mountings that are calibrated: the one file holds what the files of both would"
    for folder in (apart, merged):
        survey = mlscorr.read_survey(folder)
        out = tmp_path / folder.parent.name
        moved = {
            name: Correction(
                survey.trajectory,
                survey.trajectory,
                part.mounting,
                corrected_mounting(part.mounting, np.array([0.1, 0.0, 0.0, 0.0, 0.0, turn])),
            )
            for (name, part), turn in zip(survey.by_scanner.items(), (0.01, -0.02), strict=True)
        }
        out.mkdir()
        files = write_clouds(survey, out, moved, lambda points: None)
        assert sum(points for _, points, _ in files) == survey.points
        mountings = [correction.corrected_mounting for correction in moved.values()]
        names = [[file.path.name for file in part.clouds] for part in survey.by_scanner.values()]
        write_survey_copy(survey.path, out / "survey.toml", out, mountings, names)
    two, one = (tmp_path / folder.parent.name for folder in (apart, merged))
    recorded = points_of(merged)
    for files, points, before in zip(points_of(two), points_of(one), recorded, strict=True):
        assert np.abs(xyz(points) - xyz(files)).max() < 1e-6  # m
        assert np.linalg.norm(xyz(points) - xyz(before), axis=1).max() > 0.1  # m
    document = tomllib.loads((one / "survey.toml").read_text())
    assert document["cloud"]["files"] == ["merged.laz"]
    assert "files" not in document["scanner"][0]
    assert document["scanner"][1]["files"] == ["merged.laz"]
    for scanner, mounting in zip(mlscorr.read_survey(one).scanners, mountings, strict=True):
        assert scanner.mounting.lever_arm == pytest.approx(mounting.lever_arm, abs=1e-5)


def test_check_looks_at_a_merged_cloud(merged):
    "No fault: the file is counted once, its scanners are two"
    checked = mlscorr.check(merged)
    assert checked.faults == ()
    amounts = {amount.what: amount for amount in checked.read}
    assert amounts["scanners"].number == 2
    assert "headers of 1 cloud file" in amounts["points"].source


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[12]", "[11, 12]", r"point_source_id 11 of merged\.laz is of scanners 1 and 2"),
        ("[12]", "[13]", r"\d+ of the \d+ points of merged\.laz .* \(12; those named are 11, 13\)"),
        ("[11]", "[11, 12]", r"point_source_id 12 of"),
        (
            "point_source_ids = [12]",
            "",
            r"merged\.laz \(1, 2\).* or give the point_source_ids of "
            "each",
        ),
        ("point_source_ids = [11]", "", r"scanner\.0: files is missing: list .* point_source_ids"),
        ("[11]", "[]", r"scanner\.0\.point_source_ids = \[\] .*at least 1"),
    ],
)
def test_ids_that_do_not_part_the_points_are_refused(merged, tmp_path, old, new, message):
    "Ids of two scanners, ids of none (points are counted), files claimed whole and in part"
    folder = shutil.copytree(merged, tmp_path / "wrong")
    text = (folder / "survey.toml").read_text()
    (folder / "survey.toml").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=message):
        mlscorr.read_survey(folder)
    assert any(re.search(message, fault.sentence) for fault in mlscorr.check(folder).faults)


def test_a_scanner_without_points_is_refused(merged, tmp_path):
    "A third scanner whose ids no point has is named, with its ids and the file"
    folder = shutil.copytree(merged, tmp_path / "wrong")
    with (folder / "survey.toml").open("a") as described:
        described.write('[[scanner]]\nname = "roof"\npoint_source_ids = [7, 5]\n')
    with pytest.raises(ValueError, match=r"No point of merged\.laz has .* roof in .* \(5, 7\)"):
        mlscorr.read_survey(folder)


def test_one_scanner_may_have_several_ids(merged, tmp_path):
    "Lines of one scanner: with all of its ids named it is one scanner, and the file is whole"
    folder = shutil.copytree(merged, tmp_path / "lines")
    text = (folder / "survey.toml").read_text()
    start = text.rindex("[[scanner]]")
    end = text.index("[control]")
    text = (text[:start] + text[end:]).replace("[11]", "[11, 12]")
    (folder / "survey.toml").write_text(text)
    survey = mlscorr.read_survey(folder)
    assert survey.scanners == () and survey.clouds[0].point_source_ids is None


def test_scanners_of_one_file_are_calibrated_as_those_of_two(apart, merged):
    "Targets, planes and poles of each scanner by its ids: both mountings to 1e-7 of m and rad"
    with warnings.catch_warnings(action="ignore"):  # six seconds tell little
        two, one = (mlscorr.calibrate(mlscorr.read_survey(folder)) for folder in (apart, merged))
    assert one.calibration.ties.used.sum() > 50
    for expected, part in zip(two.by_scanner.values(), one.by_scanner.values(), strict=True):
        assert len(part.matched_control) == len(expected.matched_control) > 3
        change = part.calibration.lsc.correction - expected.calibration.lsc.correction
        assert np.abs(change).max() < 1e-7  # m, rad
