"""Extraction of targets from a whole cloud: files in, files out, with and without control."""

import csv
import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import read_chunks
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.pipeline.finding import fit_while_reading
from mlscorr.survey import PointCloud, Survey, Trajectory
from mlscorr.targets import SETTINGS, distinct, search_targets
from mlscorr.targets.regions import bright_regions
from tests.beds.documents import undocumented
from tests.beds.places import MLSCORR

CORNER = np.array([532_000.0, 3_374_000.0, 42.0])
START = 413_200.0
KEYS = [
    "name",
    "pass",
    "gps_time",
    "kind",
    "size",
    "size_sigma",
    "observed",
    "covariance",
    "normal",
    "points",
    "score",
    "matched",
    "reason",
]


def run(*arguments):
    return subprocess.run([MLSCORR, *map(str, arguments)], capture_output=True, text=True)


@pytest.fixture(scope="module")
def extracted(street, tmp_path_factory):
    "mlscorr extract --json on the street: (process, output folder)"
    out = tmp_path_factory.mktemp("extracted") / "out"
    return run("extract", street, "-o", out, "--json"), out


@pytest.fixture(scope="module")
def blind(street, tmp_path_factory):
    "The street's folder with an empty control file"
    folder = shutil.copytree(street, tmp_path_factory.mktemp("blind") / "survey")
    header = (folder / "control.csv").read_text().splitlines()[0]
    (folder / "control.csv").write_text(header + "\n")
    return folder


def distances(survey, rows):
    "Distances (surveyed, found) of the street's surveyed points from what was found. Units: m"
    surveyed = survey.surveyed
    place = np.array([row["observed"] for row in rows]).reshape(-1, 3)
    return np.linalg.norm(surveyed.position[:, None] - place, axis=2)


@pytest.mark.long
def test_extract_names_every_surveyed_target(street, extracted):
    "All five surveyed targets are found within 10 cm, matched by name, and exit code is 0"
    process, _ = extracted
    assert process.returncode == 0, process.stderr
    document = json.loads(process.stdout)
    assert document["schema"] == "mlscorr.targets/1"
    assert not undocumented(document)
    assert document["unseen"] == []
    survey = mlscorr.read_survey(street)
    names = [row["name"] for row in document["targets"] if row["matched"]]
    assert sorted(names) == sorted(survey.surveyed.name)
    assert distances(survey, document["targets"]).min(axis=1).max() < 0.1
    assert "5 of the 5 surveyed points" in process.stderr


@pytest.mark.long
def test_targets_json_csv_and_picture_hold_the_same_targets(extracted):
    "The files are those of the promise; JSON on stdout is the file's; the table has every row"
    process, out = extracted
    assert sorted(path.name for path in out.iterdir()) == [
        "log.txt",
        "targets.csv",
        "targets.json",
        "targets.png",
    ]
    document = json.loads((out / "targets.json").read_text(encoding="utf-8"))
    assert document == json.loads(process.stdout)
    assert all(list(row) == KEYS for row in document["targets"])
    with open(out / "targets.csv", encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["name"] for row in table] == [row["name"] or "" for row in document["targets"]]
    assert float(table[0]["easting"]) == pytest.approx(
        document["targets"][0]["observed"][0], abs=1e-4
    )
    for row in document["targets"]:
        assert np.linalg.eigvalsh(row["covariance"]).min() > 0
        assert np.linalg.norm(row["normal"]) == pytest.approx(1.0)
    assert (out / "targets.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_targets_are_found_without_control(street, blind):
    "With an empty control file, kinds and sizes are those of the street, to 3 cm, and no others"
    found = mlscorr.extract(mlscorr.read_survey(blind)).targets
    survey = mlscorr.read_survey(street)
    surveyed = survey.surveyed
    apart = distances(survey, found)
    best = apart.argmin(axis=1)
    assert apart.min(axis=1).max() < 0.1
    assert [found[i]["kind"] for i in best] == list(surveyed.kind)
    assert np.abs([found[i]["size"] for i in best] - surveyed.size).max() < 0.03
    assert not any(row["matched"] for row in found)
    others = np.setdiff1d(np.arange(len(found)), best)
    assert all(found[i]["score"] < 0.9 for i in others)


def test_the_section_control_may_be_missing(street, tmp_path):
    "Extraction needs no [control] at all; a correction says that it does"
    folder = shutil.copytree(street, tmp_path / "survey")
    settings = (folder / "survey.toml").read_text()
    start = settings.index("[control]")
    end = settings.index("[", start + 1)
    (folder / "survey.toml").write_text(settings[:start] + settings[end:])
    survey = mlscorr.read_survey(folder)
    assert len(survey.control) == len(survey.check) == 0
    with pytest.raises(ValueError, match=r"has no control points.*mlscorr extract"):
        mlscorr.correct(survey)


def flat_plate(rng, size=0.6, scale=1.0, middle=(0.0, 6.0, 1.5), points=900):
    "A bright plate on a darker wall that a scanner passes in a second: PointCloud, Trajectory"
    time = START + np.sort(rng.uniform(0.0, 1.0, 40 * points))
    x = 8.0 * (time - START - 0.5)
    z = rng.uniform(0.0, 4.0, len(time))
    xyz = np.column_stack([x, np.full(len(x), middle[1]), z])
    on_plate = (np.abs(x - middle[0]) < size / 2) & (np.abs(z - middle[2]) < size / 2)
    xyz[:, 1] += 0.003 * rng.standard_normal(len(x))
    intensity = np.where(on_plate, 9000, 3000) * rng.normal(1.0, 0.03, len(x)) * scale
    epochs = START + np.arange(-1.0, 2.0, 0.01)
    position = CORNER + np.outer(8.0 * (epochs - START - 0.5), [1.0, 0.0, 0.0]) + [0, 0, 2.0]
    zero = np.zeros(len(epochs))
    trajectory = Trajectory(epochs, position, attitude_from_angles(zero, zero, zero + np.pi / 2))
    return PointCloud(CORNER + xyz, time, intensity.astype(np.uint16)), trajectory


def objects(chunks, trajectory, shapes=(("square", None),)):
    "Objects that the search of some chunks finds"
    survey = Survey("street", None, None, (), trajectory, None, NO_POINTS, NO_POINTS)
    results = search_targets(chunks, survey, shapes, np.random.default_rng(0))
    return distinct([target for _, found in results for target in found])


@pytest.mark.parametrize("scale", [1.0, 0.25, 4.0])
def test_regions_do_not_depend_on_the_scale_of_the_intensity(scale):
    "Four times farther away in intensity, the plate is the same region, 0.6 m wide"
    cloud, _ = flat_plate(np.random.default_rng(1), scale=scale)
    (region,) = bright_regions(cloud.xyz, cloud.intensity)
    assert np.linalg.norm(region.centre - CORNER - [0.0, 6.0, 1.5]) < 0.03
    assert region.radius == pytest.approx(0.6 / np.sqrt(2), abs=0.04)
    assert region.likeness > 0.95


def test_regions_do_not_depend_on_the_order_of_points():
    "Shuffled points give the same regions"
    cloud, _ = flat_plate(np.random.default_rng(2))
    shuffled = cloud[np.random.default_rng(3).permutation(len(cloud))]
    pairs = zip(*(bright_regions(c.xyz, c.intensity) for c in (cloud, shuffled)), strict=True)
    for region, again in pairs:
        assert np.allclose(region.centre, again.centre)
        assert region.likeness == pytest.approx(again.likeness)


def test_a_target_cut_by_the_edge_of_a_chunk_is_found_whole():
    "Chunks that end within the plate give the same one object as the whole cloud, to 2 mm"
    cloud, trajectory = flat_plate(np.random.default_rng(4))
    whole = objects([cloud], trajectory)
    middle = int(np.searchsorted(cloud.gps_time, START + 0.5))
    parts = objects([cloud[:middle], cloud[middle:]], trajectory)
    assert len(whole) == len(parts) == 1
    assert np.linalg.norm(whole[0].position - parts[0].position) < 0.002
    assert abs(whole[0].points - parts[0].points) <= 2


def test_what_glitters_everywhere_is_bounded():
    "A cloud of which each second point is bright gives no more fits than the limit, and no target"
    rng = np.random.default_rng(5)
    cloud, trajectory = flat_plate(rng)
    glitter = replace(cloud, intensity=rng.choice([500, 60_000], len(cloud)).astype(np.uint16))
    assert len(bright_regions(glitter.xyz, glitter.intensity)) < SETTINGS.largest_fits
    assert objects([glitter], trajectory) == []


@pytest.mark.long
def test_targets_near_control_do_not_depend_on_how_many_points_are_read(street):
    "Read twenty thousand points at a time, the street's targets are the same to the last digit"
    survey = mlscorr.read_survey(street)
    found = fit_while_reading(survey, read_chunks)
    whole = found.targets
    near = found.near
    in_parts = fit_while_reading(survey, lambda file: read_chunks(file, 20_000))
    parts = in_parts.targets
    near_parts = in_parts.near
    assert near.points == near_parts.points > 1000
    assert [number for number, _ in whole] == [number for number, _ in parts]
    for (_, one), (_, other) in zip(whole, parts, strict=True):
        assert np.array_equal(one.position, other.position)


@pytest.fixture
def edited(street, monkeypatch):
    "The street's survey without control, its intensities replaced by a function of them"
    survey = replace(mlscorr.read_survey(street), control=NO_POINTS, check=NO_POINTS)

    def edit(function):
        def changed(file):
            for chunk in read_chunks(file):
                yield replace(chunk, intensity=function(chunk.intensity))

        monkeypatch.setattr("mlscorr.pipeline.extraction.read_chunks", changed)
        return survey

    return edit


def test_a_cloud_without_intensity_is_told(edited, tmp_path):
    "All intensities equal: a warning names the value and what was looked for instead"
    survey = edited(np.zeros_like)
    with pytest.warns(UserWarning, match=r"no useful intensity \(values: 0\).*by their edges"):
        result = mlscorr.extract(survey)
    document = result.write(tmp_path / "out")
    assert any("no useful intensity" in sentence for sentence in document["warnings"])


def test_intensity_of_eight_bits_serves(edited, street):
    "Intensities from 0 to 255 find the same five targets"
    found = mlscorr.extract(edited(lambda values: values >> 8)).targets
    assert distances(mlscorr.read_survey(street), found).min(axis=1).max() < 0.1


def test_a_cloud_without_targets_gives_an_empty_list(tmp_path, street):
    "An empty list is a result: exit code 0, all files, and a sentence that says it"
    survey = mlscorr.read_survey(street)
    folder = shutil.copytree(street, tmp_path / "survey")
    places = survey.surveyed.position
    leave_asphalt(folder / survey.clouds[0].path.name, places)
    header = (folder / "control.csv").read_text().splitlines()[0]
    (folder / "control.csv").write_text(header + "\n")
    process = run("extract", folder, "-o", tmp_path / "out")
    assert process.returncode == 0, process.stderr
    assert "Warning: No target-like object was found among" in process.stderr
    assert json.loads((tmp_path / "out" / "targets.json").read_text())["targets"] == []
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"log.txt", "targets.csv", "targets.json", "targets.png"}


def leave_asphalt(path, targets):
    "Keep the points of one dull intensity far from all targets, a tenth of them"
    import laspy

    cloud = laspy.read(path)
    far = np.linalg.norm(cloud.xyz[::10, None] - targets, axis=2).min(axis=1) > 3.0
    cloud.points = cloud.points[np.arange(0, len(cloud.points), 10)[far]]
    cloud.intensity = np.random.default_rng(7).integers(950, 1050, len(cloud.points))
    cloud.write(path)


@pytest.mark.parametrize(
    ("size", "meant"),
    [
        ("600", r"Then give 0\.6"),
        ("60", r"Then give 0\.6"),
        ("0.006", "decimal point may be misplaced"),
    ],
)
def test_a_size_in_the_wrong_unit_names_the_likely_one(street, tmp_path, size, meant):
    "Sizes that no target has are refused with the unit that is likely meant, exit code 3"
    folder = shutil.copytree(street, tmp_path / "survey")
    text = (folder / "control.csv").read_text()
    (folder / "control.csv").write_text(text.replace(",0.6,", f",{size},"))
    with pytest.raises(ValueError, match=meant):
        mlscorr.read_survey(folder)
