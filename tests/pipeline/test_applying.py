"""Removal of a found error from clouds, trajectory and survey.toml."""

import json
import shutil
import tomllib
import warnings

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.effects import make_effect
from mlscorr.io.surveys import write_survey_copy
from mlscorr.pipeline import read_effects
from mlscorr.pipeline.control_checks import reuse_warnings
from mlscorr.pipeline.found_effects import cloud_rows
from mlscorr.simulate import Scenario, simulate
from tests.beds.documents import undocumented

WRONG = {"time_offset": 0.05, "boresight": [0.2, -0.1, 0.3], "vertical_datum": 1.5}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    "Folder of a short drive with a late clock, a wrong boresight and heights of another datum"
    scenario = Scenario(
        drive={"duration": 5.0, "turns": 20.0},
        targets={"control": 3, "check": 1},
        scanner=[{"lines_per_second": 50, "points_per_line": 200, "range_noise": 0.0}],
        effects=[{"name": name, "magnitude": size} for name, size in WRONG.items()],
    )
    folder = tmp_path_factory.mktemp("site")
    simulate(scenario, np.random.default_rng(2)).write(folder)
    return folder


@pytest.fixture(scope="module")
def applied(site, tmp_path_factory):
    "Folder that the command writes by name and size, and its document"
    out = tmp_path_factory.mktemp("applied") / "out"
    sizes = ["time_offset=0.05", "boresight=0.2,-0.1,0.3", "vertical_datum=1.5"]
    done = CliRunner().invoke(app, ["apply", str(site), *sizes, "-o", str(out), "--json"])
    assert done.exit_code == 0, done.output
    return out, json.loads(done.stdout)


def test_points_come_to_where_they_were_measured(site, applied):
    "But for POS drift of a few mm: each is where it is, 1.5 m higher in the control's datum"
    truth = np.load(site / "truth.npz")["point_xyz"]
    las = laspy.read(applied[0] / "pass-1.laz")
    left = las.xyz - truth - [0.0, 0.0, 1.5]
    before = laspy.read(site / "pass-1.laz").xyz - truth
    assert np.median(np.linalg.norm(before, axis=1)) > 0.15  # m
    assert np.median(np.linalg.norm(left, axis=1)) < 0.02  # m


def test_the_written_survey_is_consistent(site, applied):
    "Trajectory, mounting and clouds agree: taking nothing more out would move no point"
    described = tomllib.loads((applied[0] / "survey.toml").read_text())
    assert described["trajectory"]["file"] == "trajectory.csv"
    before = mlscorr.read_survey(site)
    after = mlscorr.read_survey(applied[0])
    turn = (after.mounting.boresight * before.mounting.boresight.inv()).as_rotvec(degrees=True)
    assert np.allclose(turn, WRONG["boresight"], atol=1e-5)  # deg
    times = after.trajectory.gps_time[5:-5]
    then = before.trajectory.at(times - WRONG["time_offset"]).position
    assert np.allclose(after.trajectory.at(times).position - then, [0, 0, 1.5], atol=1e-4)  # m


def test_the_document_says_what_was_done(applied):
    "Effects and files, every field explained in the manual"
    content = applied[1]
    assert {e["name"]: e["magnitude"] for e in content["effects"]} == WRONG
    (file,) = content["files"]
    assert file["untouched"] < 0.01 * file["points"]
    assert not undocumented(content)


def test_what_was_found_is_read_from_documents(tmp_path):
    "Of a diagnosis the named causes, single or paired; of a calibration both parts of the mounting"
    path = tmp_path / "found.json"
    rows = [{"name": "time_offset magnitude", "estimate": -0.004}]
    rows += [{"name": f"boresight {part}", "estimate": 0.1} for part in ("right", "forward", "up")]
    label = "time_offset+boresight"
    gap = {"schema": "mlscorr.gap/1", "verdict": {"label": label}}
    path.write_text(json.dumps({**gap, "causes": [{"effect": label, "parameters": rows}]}))
    late, turned = read_effects(path).effects
    assert late == make_effect("time_offset", magnitude=-0.004)
    assert turned.magnitude == (0.1, 0.1, 0.1)
    path.write_text(json.dumps(calibration()))
    assert [effect.name for effect in read_effects(path).effects] == ["lever_arm", "boresight"]


def calibration():
    "Contents of a calibration.json for apply, without a forward lever arm"
    lsc = {
        "lever_arm": {"correction": [0, 0.1, 0], "sigma": [0.01, 0.03, 0.02]},
        "boresight": {"correction": [0, 0, 0.2], "sigma": [0.01, 0.02, 0.03]},
        "correlation": (0.5 * np.eye(6) + 0.5).tolist(),
    }
    determined = [True, False, True, True, True, True]
    return {"schema": "mlscorr.calibration/1", "lsc": lsc, "determined": determined}


def test_a_mounting_is_known_as_well_as_the_calibration_knows_it(site, tmp_path):
    "survey.toml has its sigmas and correlation, and on what they rest; with more applied, none"
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(calibration()))
    with warnings.catch_warnings(action="ignore"):
        survey = mlscorr.read_survey(site)
        found = read_effects(path)
        mlscorr.apply(survey, found).write(tmp_path / "out")
        known = mlscorr.read_survey(tmp_path / "out").mounting
    sigma = np.append([0.01, 0.03, 0.02], np.radians([0.01, 0.02, 0.03]))
    covariance = np.outer(sigma, sigma) * (0.5 * np.eye(6) + 0.5)
    np.testing.assert_allclose(known.covariance, covariance, rtol=1e-5)
    text = (tmp_path / "out" / "survey.toml").read_text()
    assert "# not determined: lever arm forward; its sigma depends" in text
    more = mlscorr.apply(survey, [found, make_effect("lever_arm", magnitude=[0.0, 0.1, 0.0])])
    assert more.correction.corrected_mounting.covariance is None


def test_what_was_found_in_other_clouds_is_refused(site, tmp_path):
    "The clouds out of which it was taken are others: it is not taken out of these once more"
    path = tmp_path / "calibration.json"
    with warnings.catch_warnings(action="ignore"):
        survey = mlscorr.read_survey(site)
        path.write_text(json.dumps(calibration() | {"clouds": cloud_rows(survey)}))
        mlscorr.apply(survey, [read_effects(path)]).write(tmp_path / "out")
        without = mlscorr.read_survey(tmp_path / "out")
        with pytest.raises(ValueError, match=r"None of the 1 clouds .* already removed from them"):
            mlscorr.apply(without, [read_effects(path)])


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (
            {"verdict": {"label": "none"}, "causes": []},
            "only cause that the diagnosis names is none",
        ),
        ({"verdict": {"label": "range_walk"}, "causes": [{"effect": "range_walk"}]}, "range_walk,"),
        ({}, "is not a gap.json or calibration.json"),
    ],
)
def test_a_document_that_names_nothing_to_take_out_is_refused(content, sentence, tmp_path):
    "With the reason, not with a traceback"
    path = tmp_path / "gap.json"
    path.write_text(json.dumps({"schema": "mlscorr.gap/1", **content}))
    with pytest.raises(ValueError, match=sentence):
        read_effects(path)


@pytest.mark.parametrize(
    ("found", "sentence"),
    [
        ("time_offset=late", "'late' is neither a number"),
        (
            "nosuch.json",
            "no file nosuch.json. Give a gap.json, a calibration.json, or NAME=SIZE",
        ),
        ("range_bias=0.1", "Give a gap.json"),
        ("boresight=40,0,0", "exceeds 10 deg"),
    ],
)
def test_a_wrong_size_is_refused_by_the_command(found, sentence, site, tmp_path):
    "Exit code 2 and a sentence, and no folder"
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["apply", str(site), found, "-o", str(out)])
    assert done.exit_code == 2
    assert sentence in " ".join(done.output.split())
    assert not out.exists()


def test_a_mounting_is_not_taken_out_twice(site, tmp_path):
    """A survey with a new mounting and the old clouds says so: no calibration counts it again.

    A clock offset can be taken out; the clouds are not as the mounting puts them after it either.
    """
    with warnings.catch_warnings(action="ignore"):
        old = mlscorr.read_survey(site)
        write_survey_copy(old.path, tmp_path / "survey.toml", tmp_path, [old.mounting])
        survey = mlscorr.read_survey(tmp_path)
        assert not list(reuse_warnings(old)) and not old.is_remounted
        for work in (
            mlscorr.calibrate,
            lambda survey: mlscorr.apply(survey, make_effect("boresight", magnitude=[0, 0, 0.1])),
        ):
            with pytest.raises(ValueError, match="written by mlscorr calibrate --clouds"):
                work(survey)
        late = mlscorr.apply(survey, make_effect("time_offset", magnitude=0.01))
        late.write(tmp_path / "out")
        (sentence,) = reuse_warnings(mlscorr.read_survey(tmp_path / "out"))
    assert "use the recorded mounting, not" in sentence


def test_what_cannot_be_taken_out_is_named(site):
    "With what its effect says to do"
    with warnings.catch_warnings(action="ignore"):
        survey = mlscorr.read_survey(site)
    with pytest.raises(ValueError, match="range_bias can't be removed"):
        mlscorr.apply(survey, [make_effect("range_bias", magnitude=0.01)])
    with pytest.raises(ValueError, match="No effect is given"):
        mlscorr.apply(survey, [])
    for strange in ("time_offset", ["time_offset"]):
        with pytest.raises(ValueError, match=r"^'time_offset' is not an effect"):
            mlscorr.apply(survey, strange)


def test_one_effect_need_be_in_no_list(site):
    """An effect by itself is taken out as the list of it is."""
    with warnings.catch_warnings(action="ignore"):
        survey = mlscorr.read_survey(site)
    late = make_effect("time_offset", magnitude=0.01)
    assert mlscorr.apply(survey, late).effects == mlscorr.apply(survey, [late]).effects == (late,)


@pytest.fixture
def short(site, tmp_path):
    "The site with a trajectory that ends early, and a reference surface"
    folder = shutil.copytree(site, tmp_path / "short")
    rows = (folder / "trajectory.csv").read_text().splitlines(keepends=True)
    (folder / "trajectory.csv").write_text("".join(rows[: len(rows) * 3 // 4]))
    return folder


def test_points_that_stay_as_they_are_end_with_a_code_of_their_own(short, tmp_path):
    "The trajectory ends early: the rest is counted with what it misses, and not all was done"
    out = tmp_path / "out"
    given = [
        "apply",
        str(short),
        "time_offset=0.01",
        "vertical_datum=0.1",
        "-o",
        str(out),
        "--json",
    ]
    with pytest.warns(UserWarning) as said:
        done = CliRunner().invoke(app, given)
    assert done.exit_code == 4, done.output
    (file,) = json.loads(done.stdout)["files"]
    words = f"{file['untouched']} of {file['points']} points outside the trajectory or in its gaps"
    assert file["untouched"] > 1000
    assert any(f"{words} keep time_offset," in str(warning.message) for warning in said)


def test_a_datum_moves_all_points(short, tmp_path):
    "It needs no time: points past the end of the trajectory go with the others, in one surface"
    (short / "wall.ply").write_text("ply\n")
    toml = (short / "survey.toml").read_text() + '\n[scene]\nreference = "wall.ply"\n'
    (short / "survey.toml").write_text(toml)
    las = laspy.read(short / "pass-1.laz")
    las.gps_time[:10] = np.nan
    las.write(short / "pass-1.laz")
    with warnings.catch_warnings(action="ignore"):  # of the early end
        survey = mlscorr.read_survey(short)
    sizes = {"horizontal_datum": [0.2, -0.1], "vertical_datum": 15.3}
    datum = [make_effect(name, magnitude=size) for name, size in sizes.items()]
    with pytest.warns(UserWarning) as said:
        document = mlscorr.apply(survey, datum).write(tmp_path / "out")
    assert document["files"][0]["untouched"] == 0
    way = laspy.read(tmp_path / "out" / "pass-1.laz").xyz - las.xyz
    np.testing.assert_allclose(way, np.tile([0.2, -0.1, 15.3], (len(way), 1)), rtol=0, atol=1e-6)
    (sentence,) = (str(w.message) for w in said if "wall.ply" in str(w.message))
    assert "Move it by E +0.200, N -0.100, H +15.300 m" in sentence
