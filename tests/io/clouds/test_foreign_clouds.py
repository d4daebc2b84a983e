"""E57 and PLY clouds in, LAZ out: the same points, times and results, or a sentence."""

import re
import shutil
import subprocess
import sys
import warnings

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.io.clouds import converted, read_chunks, read_layout, recorded_points
from mlscorr.io.settings import Settings
from mlscorr.io.store import glance
from mlscorr.io.surveys import FILE_NAME
from mlscorr.survey import CloudFile, PointCloud
from tests.beds.foreign_clouds import points_of, write_e57, write_ply

CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
CORNER = np.array([532_000.0, 3_374_000.0, 42.0])
WEEK = 604_800.0


def few(n=500, start=413_200.0):
    "Points about a corner at UTM size, with times and intensities"
    rng = np.random.default_rng(3)
    xyz = CORNER + rng.uniform(-50, 50, (n, 3))
    fields = dict(zip("xyz", xyz.T, strict=True))
    return fields | {
        "gps_time": start + np.linspace(0.0, 10.0, n),
        "intensity": rng.integers(0, 60_000, n).astype(float),
    }


def scan_of(fields, pose=None, columns=None, **more):
    "A scan of an E57 with these fields and further columns, in the axes of its pose"
    further = columns or {}
    xyz = np.column_stack([fields[axis] for axis in "xyz"])
    columns = dict(zip(CARTESIAN, xyz.T, strict=True)) | {
        "timeStamp": fields["gps_time"],
        "intensity": fields["intensity"],
    }
    if pose is not None:
        (w, z), shift = pose
        local = (xyz - shift) @ np.array([[w, -z, 0.0], [z, w, 0.0], [0.0, 0.0, 1.0]])
        columns |= dict(zip(CARTESIAN, local.T, strict=True))
        half = np.arctan2(z, w) / 2
        more["pose"] = ((np.cos(half), 0.0, 0.0, np.sin(half)), shift)
    return {"fields": columns | further, **more}


def read(path):
    "All points of a cloud as it is read, and its layout"
    layout = read_layout(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        chunks = list(read_chunks(CloudFile(path, layout.points, 0.0, "")))
    return PointCloud.concatenate(chunks), layout


def assert_same(cloud, fields, time_constant=0.0):
    "To half a resolution of 0.1 mm, times to the bit"
    assert np.abs(cloud.xyz - np.column_stack([fields[axis] for axis in "xyz"])).max() < 0.6e-4
    assert np.array_equal(cloud.gps_time, fields["gps_time"] + time_constant)
    assert np.array_equal(cloud.intensity, fields["intensity"])


# ---- a survey in three formats


@pytest.fixture(scope="module")
def fine(street, tmp_path_factory):
    "The street with a cloud at 0.1 mm, and its corrected points"
    folder = shutil.copytree(street, tmp_path_factory.mktemp("fine") / "survey")
    path = folder / "pass-1.laz"
    las = laspy.read(path)
    las.change_scaling(scales=[1e-4] * 3)
    las.xyz = las.xyz + np.random.default_rng(2).uniform(-5e-4, 5e-4, (len(las.points), 3))
    las.write(path)
    return folder, corrected(folder, folder.parent / "out")


def corrected(folder, out):
    "Output of correct for a survey"
    mlscorr.correct(mlscorr.read_survey(folder)).write(out, page=False)
    las = laspy.read(out / "pass-1.laz")
    return np.asarray(las.xyz), np.asarray(las.gps_time), np.asarray(las.intensity)


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".e57", ".ply"])
def test_a_survey_is_corrected_whatever_its_cloud_is_written_in(fine, suffix, tmp_path):
    "By init, check and correct the same points within 0.2 mm, as LAZ of the same stem"
    laz, expected = fine
    folder = shutil.copytree(laz, tmp_path / "survey")
    fields = points_of(folder / "pass-1.laz")
    (folder / "pass-1.laz").unlink()
    toml = (folder / FILE_NAME).read_text().replace("pass-1.laz", f"pass-1{suffix}")
    (folder / FILE_NAME).write_text(toml)
    path = folder / f"pass-1{suffix}"
    if suffix == ".ply":
        write_ply(path, fields)
    else:
        half = len(fields["x"]) // 3
        parts = [
            {name: v[k] for name, v in fields.items()} for k in (slice(half), slice(half, None))
        ]
        write_e57(path, [scan_of(parts[0], ((0.6, 0.8), CORNER)), scan_of(parts[1])])
    before = path.read_bytes()
    if suffix == ".ply":
        started = mlscorr.init(folder, tmp_path / "other.toml")
        assert f'files = ["survey/pass-1{suffix}"]' in started.text
    else:
        checked = mlscorr.check(folder)
        assert not checked.faults and not checked.warnings, checked
        assert any("5 of 5 tested targets" in note for note in checked.notes)
        assert checked.read[0].number == len(fields["x"])
    run = CliRunner().invoke(
        app, ["correct", str(folder), "-o", str(tmp_path / "out"), "--no-report"]
    )
    assert run.exit_code == 0, run.stderr
    assert f"pass-1{suffix} was read through LAZ at 0.1 mm, {len(fields['x'])} points" in run.stderr
    las = laspy.read(tmp_path / "out" / "pass-1.laz")
    assert np.abs(las.xyz - expected[0]).max() < 2e-4
    assert np.array_equal(las.gps_time, expected[1])
    assert np.array_equal(las.intensity, expected[2])
    assert path.read_bytes() == before
    assert not list(folder.glob("*.laz"))


# ---- what is read


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_is_read_in_all_its_forms(form, tmp_path):
    "Text and both orders of bytes, names of CloudCompare, colours; further fields are named"
    fields = few()
    names = {"gps_time": "scalar_GpsTime", "intensity": "scalar_Intensity"}
    table = {names.get(name, name): values for name, values in fields.items()}
    colours = {name: np.arange(500) % 256 for name in ("red", "green", "blue")}
    table |= colours | {"nx": np.zeros(500)}
    kinds = dict.fromkeys(colours, "u1") | {"nx": "f4"}
    path = write_ply(tmp_path / "a.ply", table, kinds, form)
    cloud, layout = read(path)
    assert_same(cloud, fields)
    assert layout.point_format == 7 and not layout.is_standard
    las = laspy.read(converted(path).path)
    assert np.array_equal(las.red, colours["red"] * 257)
    assert "with times by scalar_GpsTime; without its nx." in converted(path).note


def test_scans_of_an_e57_are_placed_and_invalid_points_left_out(tmp_path):
    "Poses are applied; marked points and those without a time are counted; rows are named"
    fields = few()
    bad = np.arange(500) % 100 == 0
    more = {
        "cartesianInvalidState": 2 * bad,
        "rowIndex": np.arange(500),
    }
    path = write_e57(tmp_path / "a.e57", [scan_of(fields, ((0.8, -0.6), CORNER), more)])
    cloud, _ = read(path)
    assert_same(cloud, {name: values[~bad] for name, values in fields.items()})
    assert ("5 invalid points were omitted; without its rowIndex. The corrected") in converted(
        path
    ).note


@pytest.mark.parametrize(
    ("start", "end", "stamps", "constant"),
    [
        (1.4e9, 1.4e9 + 10.0, np.linspace(0.0, 10.0, 500), 1.4e9 - 1e9),  # as the standard has it
        (1.4e9, None, np.linspace(0.0, 10.0, 500), 1.4e9 - 1e9),
        (1.4e9, 1.4e9 + 10.0, 413_200.0 + np.linspace(0.0, 10.0, 500), 0.0),
        (None, None, 413_200.0 + np.linspace(0.0, 10.0, 500), 0.0),
        (None, None, 1.4e9 + np.linspace(0.0, 10.0, 500), -1e9),
    ],
)
def test_times_of_an_e57_count_from_its_start_where_they_fit(
    start, end, stamps, constant, tmp_path
):
    "From acquisitionStart by the standard, as they are where they are seconds of week all the same"
    fields = few() | {"gps_time": stamps}
    header = {key: value for key, value in (("start", start), ("end", end)) if value is not None}
    cloud, layout = read(write_e57(tmp_path / "a.e57", [scan_of(fields, **header)]))
    assert np.abs(cloud.gps_time - stamps - constant).max() < 1e-6
    assert layout.is_standard == (constant != 0.0)


@pytest.mark.parametrize(
    ("intensity", "stored", "words"),
    [
        (np.linspace(0.0, 1.0, 500), (0, 65_535), "intensities of 0 to 1 as 65535"),
        (np.linspace(-20.0, 5.0, 500), (0, 65_535), r"of -20 to 5 as 2621.4 \(value - -20\)"),
        (np.linspace(0.0, 255.0, 500), (0, 255), "points with times by gps_time. The corrected"),
    ],
)
def test_intensities_come_into_16_bits_and_their_scale_is_said(intensity, stored, words, tmp_path):
    "Shares, decibels and bytes: the largest and the smallest stay apart"
    path = write_ply(tmp_path / "a.ply", few() | {"intensity": intensity})
    cloud, _ = read(path)
    assert (cloud.intensity.min(), cloud.intensity.max()) == stored
    assert re.search(words, converted(path).note), converted(path).note


def test_a_large_cloud_is_looked_at_by_its_first_points(tmp_path, monkeypatch):
    "Within a glance; its number of points is that of its header, and it is said"
    monkeypatch.setattr("mlscorr.io.clouds.conversion.SETTINGS", Settings(chunk_points=60))
    path = write_ply(tmp_path / "a.ply", few())
    with glance(100):
        cloud, layout = read(path)
        assert len(cloud) == layout.points == 120
        assert recorded_points(CloudFile(path, 120, 0.0, "")) == 500
        assert "the first 120 points of 500" in converted(path).note
    assert len(read(path)[0]) == 500


def test_what_was_converted_goes_with_the_program(tmp_path):
    "No file stays in the folder for temporary files"
    path = write_ply(tmp_path / "a.ply", few())
    place = tmp_path / "temporary"
    place.mkdir()
    program = (
        "import sys; from pathlib import Path; "
        "from mlscorr.io.clouds.las_checks import read_layout; "
        "layout = read_layout(Path(sys.argv[1])); print(layout.path.stat().st_size > 0)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, path],
        env={"TMPDIR": str(place), "PYTHONPATH": ":".join(filter(None, sys.path))},
        capture_output=True,
        text=True,
    )
    assert (run.stdout, run.stderr) == ("True\n", "")
    assert not list(place.iterdir())


# ---- what is refused


def no_time(path):
    fields = few()
    fields["stamp"] = fields.pop("gps_time")
    return write_ply(path, fields)


def cut(path, write, *arguments):
    write(path, *arguments)
    path.write_bytes(path.read_bytes()[:-1000])
    return path


def without(path, name):
    scan = scan_of(few())
    del scan["fields"][name]
    return write_e57(path, [scan_of(few()), scan])


REFUSED = {
    "a.ply without a time": (
        no_time,
        "have no times.* The file has x, y, z, intensity, stamp: export it with gps_time",
    ),
    "b.ply in single precision": (
        lambda path: write_ply(path, few(), dict.fromkeys("xyz", "f4")),
        r"coordinates \(m\) in single precision: at 33740\d\d they are rounded to steps of 0.25",
    ),
    "c.ply with times in single precision": (
        lambda path: write_ply(path, few(), {"gps_time": "f4"}),
        r"times \(s\) in single precision: at 413210 they are rounded to steps of 0.031",
    ),
    "d.ply cut off": (
        lambda path: cut(path, write_ply, few()),
        "truncated: it has 475 of the 500 points",
    ),
    "e.ply of text cut off": (
        lambda path: cut(path, write_ply, few(), None, "ascii"),
        "point 0",
    ),
    "f.ply in nanoseconds": (
        lambda path: write_ply(path, few() | {"gps_time": np.full(500, 1.7e18)}),
        "seem to be milli-, micro- or nanoseconds. Export them in seconds",
    ),
    "f2.ply with a point at zero": (
        lambda path: write_ply(path, {k: v * (np.arange(500) != 7) for k, v in few().items()}),
        r"has 1 points more than 215 km from its first one, .* as at 0, 0, 0\. Export it in "
        "meters without",
    ),
    "g.ply that is none": (lambda path: path.write_text("ply\n") and path, "no header from ply to"),
    "h.ply without points": (
        lambda path: path.write_text("ply\nformat ascii 1.0\nend_header\n") and path,
        "first element is not vertex",
    ),
    "i.e57 without a time": (
        lambda path: without(path, "timeStamp"),
        "have no times in scan 2 of 2, .* The file has cartesianX, .*: export it with the field",
    ),
    "j.e57 without places": (
        lambda path: without(path, "cartesianY"),
        "Scan 2 of 2 of .* has no coordinates",
    ),
    "k.e57 in single precision": (
        lambda path: write_e57(path, [scan_of(few(), single=CARTESIAN)]),
        "coordinates .* in single precision",
    ),
    "l.e57 cut off": (
        lambda path: cut(path, write_e57, [scan_of(few())]),
        r"can't be read as E57 \(",
    ),
    "m.e57 that is none": (
        lambda path: path.write_bytes(bytes(5000)) and path,
        r"can't be read as E57 \(checksum",
    ),
}


@pytest.mark.parametrize(("write", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_used_is_refused(write, message, tmp_path, request):
    "No time, lost precision, cut off, other units: one sentence with what to export"
    path = write(tmp_path / request.node.callspec.id.split(" ")[0])
    with pytest.raises(ValueError, match=message) as refusal:
        read(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.long
def test_of_a_cloud_and_its_copy_in_another_format_the_laz_is_taken(street, tmp_path):
    "A PLY of the same points: init leaves it out, and a survey.toml that names both is refused"
    folder = shutil.copytree(street, tmp_path / "survey")
    (folder / FILE_NAME).unlink()
    write_ply(folder / "pass-1.ply", points_of(folder / "pass-1.laz"))
    started = mlscorr.init(folder)
    reasons = {role.path.name: role.reason for role in started.roles if role.role == "none"}
    assert "a copy of pass-1.laz" in reasons["pass-1.ply"]
    path = started.write()
    path.write_text(started.text.replace('"pass-1.laz"', '"pass-1.laz", "pass-1.ply"'))
    with pytest.raises(ValueError, match=r"pass-1\.ply, a copy of .*pass-1\.laz\. Remove"):
        mlscorr.read_survey(path)


@pytest.mark.parametrize(("largest", "expected"), [(255, 65_535), (65_535, 65_535)])
def test_colours_without_limits_are_scaled_by_their_field(largest, expected, tmp_path):
    "Half of the largest value is half of LAS's, whether a colour has 8 bits or 16"
    colour = np.linspace(0, largest, 101).round().astype(int)
    fields = {f"cartesian{axis}": 1.0 + np.arange(101.0) for axis in "XYZ"}
    fields |= {"timeStamp": 413_200.0 + np.arange(101.0), "intensity": np.ones(101)}
    fields |= {f"color{name}": colour for name in ("Red", "Green", "Blue")}
    path = write_e57(tmp_path / "a.e57", [{"fields": fields}])
    las = laspy.read(converted(path).path)
    assert las.red.max() == expected
    assert las.red[50] == pytest.approx(expected / 2, rel=0.01)
