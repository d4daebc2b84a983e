"""A survey of two scanners with mountings of their own: files in, corrected and calibrated out."""

import json
import re
import shutil
import tomllib
import warnings
from dataclasses import replace

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.correction import PointSigma
from mlscorr.estimate import corrected_mounting, prior_correction
from mlscorr.evaluate import BeamCheck
from mlscorr.io.clouds import read_chunks
from mlscorr.surfaces import FeatureCollector
from mlscorr.ties import tie_passes
from tests.beds import scanner_pair
from tests.beds.documents import undocumented

pytestmark = pytest.mark.long

LACKS = np.array(  # right, forward, up: m and deg, of each scanner's recorded mounting
    [[0.03, -0.02, 0.0, 0.3, -0.3, 0.4], [-0.02, 0.0, 0.0, -0.4, 0.2, -0.3]]
)


def wrong(mounting, lacks):
    "A mounting that lacks as much"
    return corrected_mounting(mounting, -np.append(lacks[:3], np.radians(lacks[3:])))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    "Folder of a street driven there and back with a left and a right scanner, both mounted wrong"
    simulated = scanner_pair.simulated(10.0, control=5, points=300)
    mountings = tuple(map(wrong, simulated.mountings, LACKS))
    survey = replace(simulated, mountings=mountings)
    return scanner_pair.write(survey, tmp_path_factory.mktemp("two scanners"))


@pytest.fixture(scope="module")
def survey(site):
    "The street as it is read"
    return mlscorr.read_survey(site)


@pytest.fixture(scope="module")
def commanded(site, tmp_path_factory):
    "The command on that street, its control points alone: the folder that it writes, what it says"
    out = tmp_path_factory.mktemp("calibrated") / "out"
    with warnings.catch_warnings(action="ignore"):  # a short site tells little
        command = ["calibrate", str(site), "-o", str(out), "--clouds", "--no-ties"]
        done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    return out, done.output


@pytest.fixture(scope="module")
def corrected(commanded, tmp_path_factory):
    "The corrected survey of calibrated scanners, and the folder with its clouds and their sigmas"
    out = tmp_path_factory.mktemp("corrected")
    with warnings.catch_warnings(action="ignore"):  # four points near each other tell little
        result = mlscorr.correct(mlscorr.read_survey(commanded[0]), ties="off")
        result.write(out, sigma=True, page=False)
    return result, out


@pytest.fixture(scope="module")
def together(site, tmp_path_factory):
    "With what two passes and two scanners both saw, and the drift: the folder, what is said"
    out = tmp_path_factory.mktemp("together") / "out"
    with warnings.catch_warnings(action="ignore"):
        done = CliRunner().invoke(app, ["calibrate", str(site), "-o", str(out), "--with-drift"])
    assert done.exit_code == 0, done.output
    return out, done.output


@pytest.mark.parametrize("name", ["commanded", "together"])
def test_both_scanners_are_calibrated(name, request):
    "Two boresights and lever arms are found within 3 sigmas, in the terminal as in the document"
    out, said = request.getfixturevalue(name)
    terminal = dict(re.findall(r"^Scanner (\d)$(.*?)(?=^Scanner \d$|\Z)", said, re.M | re.S))
    content = json.loads((out / "calibration.json").read_text())
    assert list(content["scanners"]) == ["1", "2"]
    assert undocumented(content) == {"1", "2"}  # the names of the scanners
    assert content["clouds"] and all(row["bytes"] > 0 for row in content["clouds"])
    for (scanner, part), lacks in zip(content["scanners"].items(), LACKS, strict=True):
        lsc = part["lsc"]
        for key, truth in (("lever_arm", lacks[:3]), ("boresight", lacks[3:])):
            error = np.array(lsc[key]["correction"]) - truth
            assert (np.abs(error) < 3 * np.array(lsc[key]["sigma"])).all()
            assert max(lsc[key]["sigma"]) < (0.05 if key == "lever_arm" else 0.5)  # m, deg
        assert {"lsc", "ls", "determined", "targets", "mounting"} <= set(part)
        right = f"{lsc['lever_arm']['correction'][0]:9.4f}"
        assert f"{'lever arm right (m)':34s}{right}" in terminal[scanner]


def test_what_both_scanners_saw_tells_the_one_beside_the_other(together, commanded):
    "Lever arm to 3 mm, better than by targets that both saw, and walls in one place to 3 mm"
    rows = [
        json.loads((out / "calibration.json").read_text()) for out in (together[0], commanded[0])
    ]
    tied, targets = (content["relative"]["2"] for content in rows)
    assert tied["beside"] == "1" and targets["fit_sigma"] is None
    error = np.array(tied["lever_arm"]["correction"]) - (LACKS[1] - LACKS[0])[:3]
    assert np.abs(error).max() < 0.003  # m
    for part in ("lever_arm", "boresight"):
        assert max(tied[part]["sigma"]) < 0.8 * max(targets[part]["sigma"])
    assert tied["fit_sigma"] < 0.003  # m
    pairs = [row["scanners"] for row in rows[0]["ties"]["pairs"]]
    assert [1, 1] in pairs and [2, 2] in pairs and [1, 2] in pairs
    assert "Walls scanned by both scanner 1 and scanner 2 agree to" in together[1]


def test_one_trajectory_is_written_by_all_scanners(site, together):
    "trajectory.csv with sigmas; both scanners' check points are scored with the same drift"
    out, _ = together
    recorded = mlscorr.read_survey(site).trajectory
    columns = np.genfromtxt(out / "trajectory.csv", delimiter=",", names=True)
    assert np.allclose(columns["gps_time"], recorded.gps_time)
    assert 0 < columns["sigma_easting"].max() < 0.05  # m
    content = json.loads((out / "calibration.json").read_text())
    first, second = (part["with_drift"] for part in content["scanners"].values())
    assert first["position_rms"] == second["position_rms"]
    assert max(second["control"]["after"]["rmse"]) < 0.03  # m
    written = mlscorr.read_survey(out)
    for scanner, part in zip(written.scanners, content["scanners"].values(), strict=True):
        calibrated = part["mounting"]["calibrated"]["lever_arm"]
        assert np.allclose(scanner.mounting.lever_arm, calibrated, rtol=0, atol=1e-5)  # m


@pytest.fixture
def thinned(site, tmp_path):
    "The street with a second scanner that has 200 points of it in all"
    folder = shutil.copytree(site, tmp_path / "thin")
    for name in ("pass-1-scanner-2.laz", "pass-2-scanner-2.laz"):
        las = laspy.read(folder / name)
        las.points = las.points[np.arange(0, len(las), len(las) // 100)]
        las.write(folder / name)
    return mlscorr.read_survey(folder)


@pytest.mark.parametrize(
    ("ties", "fault"), [(True, "can't be calibrated: 0 con"), (False, r"0 control poi")]
)
def test_a_scanner_that_nothing_tells_is_named(thinned, ties, fault):
    "200 points show no target and no plane: the sentence has its name, and what to drive"
    with warnings.catch_warnings(action="ignore"), pytest.raises(ValueError, match=fault) as raised:
        mlscorr.calibrate(thinned, ties=ties)
    assert str(raised.value).startswith("Scanner 2: ")
    assert "both sides of it, near and far" in str(raised.value)


def test_the_written_survey_has_each_calibrated_mounting(survey, commanded, corrected):
    "Every file lies anew under its own scanner, with the mounting of that and its sigmas"
    written = tomllib.loads((commanded[0] / "survey.toml").read_text())
    assert "mounting" not in written
    calibrated = corrected[0].survey
    for new, old, lacks in zip(calibrated.scanners, survey.scanners, LACKS, strict=True):
        assert [f.path for f in new.clouds] == [commanded[0] / f.path.name for f in old.clouds]
        change = new.mounting.lever_arm - old.mounting.lever_arm
        assert np.abs(change - lacks[:3]).max() < 0.05  # m
        assert new.mounting.covariance is not None


def test_clouds_of_both_scanners_come_to_where_things_are(site, survey, corrected):
    "After calibration and correction points of every file lie within centimetres of the truth"
    result, out = corrected
    truth = np.load(site / "truth.npz")["point_xyz"]
    first = 0
    for file in survey.clouds:
        las = laspy.read(out / file.path.name)
        apart = np.median(np.linalg.norm(las.xyz - truth[first : first + len(las)], axis=1))
        assert apart < 0.05  # m
        first += len(las)
    assert max(result.check["after"]["rmse"]) < 0.03  # m


def test_sigmas_of_points_are_those_of_their_scanner(corrected):
    "Each file has the sigmas by the mounting and the noise of the scanner that wrote it"
    result, out = corrected
    for scanner in result.survey.scanners:
        sigma = PointSigma.of(result.estimate.correction, scanner.scanner, scanner.mounting)
        file = scanner.clouds[0]
        las = laspy.read(out / file.path.name)
        known = sigma.at(las.xyz, np.array(las.gps_time) + file.time_constant)
        assert np.allclose(
            las.sigma_easting, known[:, 0], rtol=0, atol=6e-5
        )  # m, the file's rounding


def test_a_note_says_which_files_each_scanner_wrote(survey):
    "By the names of survey.toml"
    assert any("1 wrote pass-1.laz, pass-2.laz; 2 wrote" in note for note in survey.notes)


def test_beams_are_judged_by_the_mounting_of_their_file(survey, corrected):
    "Each cloud lies in the scan plane of its own scanner, and not in that of the other"
    assert not any("scan plane" in sentence for sentence in corrected[0].warnings)
    first, second = survey.scanners
    exchanged = replace(first, mounting=second.mounting), replace(second, mounting=first.mounting)
    check = BeamCheck(replace(survey, scanners=exchanged))
    for file in survey.clouds[:2]:
        for _ in check.watched(read_chunks)(file):
            pass
    assert all("off the scan plane" in sentence for sentence in check.warnings())
    assert len(list(check.warnings())) == 2


def test_two_scanners_tie_a_pass_to_itself(commanded):
    "Calibrated, both see the walls of one pass within seconds, and most such ties hold"
    survey = replace(mlscorr.read_survey(commanded[0]), search_radius=0.1)  # m, for speed
    there = survey.trajectory.passes[0, 1]
    collector = FeatureCollector(survey)
    for file in survey.clouds:
        for chunk in read_chunks(file):
            collector.add(file, chunk[chunk.gps_time < there])
    believed = prior_correction(survey.trajectory, survey.pos)
    tied = tie_passes(survey, believed, collector.features()).ties
    assert tied.used.sum() > 20
    assert (np.sort(tied.ties.scanner) == [0, 1]).all()
    assert np.diff(tied.ties.gps_time).max() < 10.0  # s


def test_what_takes_one_scanner_says_so(survey):
    "Diagnosis and plan refuse two scanners, with the way out"
    for command, verb in ((mlscorr.diagnose, "a diagnosis"), (mlscorr.plan, "a plan")):
        with pytest.raises(ValueError, match=rf"2 scanners \(1, 2\), and {verb} rests on one"):
            command(survey)


def test_a_scanner_without_a_mounting_is_named(survey):
    "Calibration says which scanner lacks its mounting"
    bare = replace(survey.scanners[0], mounting=None)
    with pytest.raises(ValueError, match=r"Scanner 1: .* has no \[mounting\]"):
        mlscorr.calibrate(replace(survey, scanners=(bare, survey.scanners[1])))
