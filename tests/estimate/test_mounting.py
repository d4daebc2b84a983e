"Lever arm and boresight from targets: truth recovered, honest sigmas, refusals, files to files."

import json
import shutil
import subprocess
import sys
import tomllib
import warnings
from dataclasses import replace

import laspy
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mlscorr
from mlscorr.effects import make_effect
from mlscorr.estimate import estimate_mounting, prior_mounting
from mlscorr.estimate.mounting import prior_sigma
from mlscorr.evaluate import misclosures
from mlscorr.frames import (
    attitude_from_angles,
    georeference,
    georeferenced_anew,
    mounting_partials,
    to_scanner,
)
from mlscorr.io.surveys import mounting_values, read_survey_file, write_survey_copy
from mlscorr.io.surveys.survey_sections import CalibratedMountingSection
from mlscorr.pipeline.calibration import warn_of_scanners
from mlscorr.pipeline.control_checks import reuse_warnings
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import Matched, Mounting, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs
from tests.beds.places import EXAMPLES, MLSCORR

START = 413_200.0  # s of week
CORNER = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
# m, one sigma of extraction and of the control points
NOISE = 0.003
SURVEYED = 0.002
# what the POS states
POSITION = 0.01
ATTITUDE = np.radians([0.005, 0.005, 0.01])
RECORDED = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], degrees=True)
)
LACKS = np.append([0.02, -0.015, 0.03], np.radians([0.05, -0.08, 0.2]))  # m, rad


class Site:
    """A drive past targets in one direction or in both, with a wrong mounting.

    noise scales extraction, survey and POS error together; the POS error is a sum of sines.
    """

    def __init__(self, seed, targets=10, passes=2, swing=0.1, noise=1.0, lacks=LACKS):
        rng = np.random.default_rng(seed)
        self.lacks = lacks
        true = self.drive(passes, swing)
        error = waves(rng, true.gps_time) * noise * POSITION
        turn = waves(rng, true.gps_time) * noise * ATTITUDE
        self.recorded = Trajectory(
            true.gps_time,
            true.position + error,
            attitude_from_angles(*turn.T) * true.attitude,
            np.full((len(true), 3), POSITION),
            np.tile(ATTITUDE, (len(true), 1)),
        )
        self.look(true, targets, passes, noise, rng)

    def drive(self, passes, swing):
        "60 s at 5 m/s, and after a pause the same way back"
        time = np.arange(0.0, 60.0, 0.1)
        heading = 0.7 + swing * np.sin(time / 9.0)
        step = 0.5 * np.column_stack([np.sin(heading), np.cos(heading), 0.0 * time])
        way = np.cumsum(step, axis=0)
        if passes == 2:
            way = np.vstack([way, way[::-1]])
            heading = np.append(heading, heading[::-1] + np.pi)
            time = np.append(time, time + 120.0)
        tilt = 0.01 * np.sin(time / 7), 0.02 * np.cos(time / 5)
        return Trajectory(START + time, CORNER + way, attitude_from_angles(*tilt, heading))

    def look(self, true, targets, passes, noise, rng):
        when = START + np.linspace(2.0, 58.0, targets)
        side = np.resize([-1.0, 1.0, 1.0, -1.0], targets)
        away = rng.uniform(5.0, 25.0, targets)
        body = np.column_stack(
            [side * away, rng.uniform(-10, 10, targets), rng.uniform(-2, 8, targets)]
        )
        there = true.at(when)
        centre = there.position + there.attitude.apply(body)
        back = START + 120.0 + 59.9 - (when - START)  # at the same places
        times = np.append(when, back) if passes == 2 else when
        number = np.tile(np.arange(targets), passes)
        seen = to_scanner(true, self.mounting, centre[number], times)
        seen += noise * NOISE * rng.normal(size=seen.shape)
        names = tuple(f"T{i:02d}" for i in range(1, targets + 1))
        surveyed = centre + noise * SURVEYED * rng.normal(size=centre.shape)
        self.control = surveyed_discs(names, surveyed, SURVEYED)
        self.observations = observed_discs(
            tuple(names[i] for i in number),
            times,
            georeference(self.recorded, RECORDED, seen, times),
            NOISE,
            pass_number=np.repeat(np.arange(1, passes + 1), targets),
        )

    @property
    def mounting(self):
        "The true one"
        turn = Rotation.from_rotvec(self.lacks[3:])
        return Mounting(RECORDED.lever_arm + self.lacks[:3], turn * RECORDED.boresight)

    @property
    def matched(self):
        return Matched.by_name(self.observations, self.control)

    def calibrate(self):
        return estimate_mounting(self.recorded, [RECORDED], self.matched)


def waves(rng, gps_time):
    "Sums of three sines of 15 to 150 s, RMS 1 each axis: no covariance function made them"
    period = np.exp(rng.uniform(np.log(15.0), np.log(150.0), (3, 3)))
    phase = rng.uniform(0, 2 * np.pi, (3, 3))
    waves = np.sin(2 * np.pi * (gps_time - START)[:, None, None] / period + phase)
    return waves.sum(axis=2) * np.sqrt(2 / 3)


@pytest.fixture(scope="module")
def sites():
    "20 sites with 10 targets, each seen in both directions, and their calibrations"
    return [(site, site.calibrate()) for site in map(Site, range(20))]


def test_the_partials_are_those_of_georeferencing():
    "Differences of Eq. 1 by lever arm and by turns about the body axes agree with Eq. 16-18"
    site = Site(1)
    times = site.observations.gps_time
    step = 1e-4
    seen = to_scanner(site.recorded, RECORDED, site.observations.position, times)
    partials = mounting_partials(site.recorded, RECORDED, site.observations.position, times)
    for axis in range(6):
        ends = []
        for sign in (1, -1):
            change = np.zeros(6)
            change[axis] = sign * step
            turn = Rotation.from_rotvec(change[3:])
            moved = Mounting(RECORDED.lever_arm + change[:3], turn * RECORDED.boresight)
            ends.append(georeference(site.recorded, moved, seen, times))
        assert np.allclose((ends[0] - ends[1]) / (2 * step), partials[:, :, axis], atol=1e-4)


@pytest.mark.long
def test_a_wrong_mounting_is_found_exactly_where_nothing_else_is_wrong():
    "Without noise 5 deg and 0.3 m are recovered to 0.1 mm and 0.0002 deg by both methods"
    lacks = np.append([0.3, -0.2, 0.1], np.radians([3.0, -2.0, 4.0]))
    calibration = Site(2, noise=0.0, lacks=lacks).calibrate()
    for estimate in (calibration.lsc, calibration.ls):
        assert np.abs(estimate.correction - lacks)[:3].max() < 1e-4  # m
        assert np.abs(np.degrees(estimate.correction - lacks))[3:].max() < 2e-4  # deg


@pytest.mark.long
def test_the_sigmas_are_honest(sites):
    "Over 20 sites errors over sigma have an RMS of about one, and nearly all are below two"
    ratio = np.array(
        [(calibration.lsc.correction - LACKS) / calibration.lsc.sigma for _, calibration in sites]
    )
    assert 0.6 < np.sqrt(np.mean(ratio**2)) < 1.2
    assert np.mean(np.abs(ratio) < 2) > 0.93


@pytest.mark.long
def test_collocation_is_as_good_as_least_squares_or_better(sites):
    "The RMS error over 20 sites, each component over its sigma, is no larger than that of LS"
    errors = [
        np.sqrt(
            np.mean(
                [
                    ((getattr(calibration, method).correction - LACKS) / calibration.lsc.sigma) ** 2
                    for _, calibration in sites
                ]
            )
        )
        for method in ("lsc", "ls")
    ]
    assert errors[0] < 1.02 * errors[1]


@pytest.mark.long
def test_the_correction_moves_points_as_the_true_mounting_does(sites):
    "Targets come as near to where they were surveyed as noise and the POS error leave them"
    for site, calibration in sites[:5]:
        before = misclosures(site.matched)
        after = misclosures(site.matched, calibration.correction())
        with_drift = misclosures(site.matched, calibration.correction_with_drift)
        size = [np.sqrt(np.mean(values**2)) for values in (before, after, with_drift)]
        assert size[0] > 0.03 and size[1] < 0.016 and size[2] < 0.9 * size[1]  # m


@pytest.mark.long
def test_correlations_and_covariance_agree(sites):
    "The correlation matrix has ones on its diagonal and gives the covariance with the sigmas"
    estimate = sites[0][1].lsc
    assert np.allclose(np.diag(estimate.correlation), 1.0)
    assert np.allclose(
        estimate.correlation * np.outer(estimate.sigma, estimate.sigma), estimate.covariance
    )
    assert np.linalg.eigvalsh(estimate.correlation).min() > 0


@pytest.mark.long
@pytest.mark.parametrize("move, wait", [([400_000.0, -3e6, 500.0], 0.0), ([0.0] * 3, 172_800.0)])
def test_neither_origin_nor_time_zero_matter(move, wait):
    "A survey moved by thousands of kilometres or by two days has the same calibration"
    site = Site(3)
    here = site.calibrate()
    site.recorded = replace(
        site.recorded,
        gps_time=site.recorded.gps_time + wait,
        position=site.recorded.position + move,
    )
    site.control = replace(site.control, position=site.control.position + move)
    site.observations = replace(
        site.observations,
        gps_time=site.observations.gps_time + wait,
        position=site.observations.position + move,
    )
    there = site.calibrate()
    assert np.abs(here.lsc.correction - there.lsc.correction).max() < 1e-6


@pytest.mark.long
def test_the_order_of_the_targets_does_not_matter():
    "Observations and control points in any order give the same calibration"
    site = Site(4)
    here = site.calibrate()
    site.observations = site.observations[np.random.default_rng(1).permutation(20)]
    there = site.calibrate()
    assert np.abs(here.lsc.correction - there.lsc.correction).max() < 1e-9


@pytest.mark.long
def test_one_straight_pass_does_not_determine_the_lever_arm():
    "On one heading a lever arm looks like a constant error of the POS; its sigma is no better"
    straight = Site(5, passes=1, swing=0.0).calibrate()
    both = Site(5).calibrate()
    assert straight.determined.tolist() == [False] * 3 + [True] * 3
    assert (straight.lsc.sigma[:2] > 1.5 * both.lsc.sigma[:2]).all()
    assert "does not determine lever arm right" in straight.warnings[0]


@pytest.mark.long
def test_two_directions_determine_all_but_the_height(sites):
    "Driven in both directions, a level way hides the lever arm up alone: it may be the datum"
    assert all(c.determined.tolist() == [True, True, False, True, True, True] for _, c in sites)


def test_what_no_target_tells_stays_as_it_was_recorded():
    "Targets all seen in one direction, at one distance, hold some turns only; nothing runs away"
    site = Site(6, targets=4, passes=1, swing=0.0)
    body = RECORDED.boresight.apply(
        to_scanner(site.recorded, RECORDED, site.observations.position, site.observations.gps_time)
    )
    same = site.observations.position - site.recorded.at(site.observations.gps_time).attitude.apply(
        body - body[0]
    )
    shift = same - site.observations.position
    site.observations = replace(site.observations, position=same)
    site.control = replace(site.control, position=site.control.position + shift)
    calibration = site.calibrate()
    assert not calibration.determined.all()
    assert np.abs(calibration.lsc.correction[:3]).max() < 1.0  # m
    assert np.abs(np.degrees(calibration.lsc.correction[3:])).max() < 1.0
    assert (calibration.lsc.sigma[~calibration.determined] > 0.002).all()


@pytest.mark.long
def test_a_wrong_control_point_is_named_and_left_out():
    "A point surveyed 0.3 m off is found by its statistic; the rest calibrates as without it"
    site = Site(7)
    clean = site.calibrate()
    position = site.control.position.copy()
    position[4] += [0.2, -0.2, 0.1]
    site.control = replace(site.control, position=position)
    calibration = site.calibrate()
    assert [outlier.name for outlier in calibration.outliers] == ["T05"]
    assert calibration.used.sum() == 18
    ratio = (calibration.lsc.correction - clean.lsc.correction) / clean.lsc.sigma
    assert np.abs(ratio).max() < 1.5


@pytest.mark.long
def test_a_large_site_is_calibrated_with_parameters_from_a_part_of_it():
    "With 105 targets seen twice the sigmas are smaller, and the truth lies within four of them"
    large = Site(9, targets=105)
    small = Site(9)
    calibration = large.calibrate()
    assert np.abs((calibration.lsc.correction - LACKS) / calibration.lsc.sigma).max() < 4
    assert (calibration.lsc.sigma < small.calibrate().lsc.sigma).all()


def test_too_few_targets_are_refused():
    "Two control points cannot hold six components, however often they are seen"
    with pytest.raises(ValueError, match=r"2 control points were found .* needs at least 3"):
        Site(8, targets=2).calibrate()


def test_targets_of_one_epoch_are_refused():
    "All targets at one time tell the POS error there, not the mounting"
    site = Site(8)
    near = replace(site.observations[[0, 1, 2, 3]], gps_time=START + 9.0 + 0.1 * np.arange(4))
    with pytest.raises(ValueError, match=r"All 4 control points were observed within 0.30 s"):
        estimate_mounting(site.recorded, [RECORDED], Matched.by_name(near, site.control))


SURVEY = """\
name = "copy"  # of a survey
[cloud]
files = ["pass-1.laz", # the first
  "pass-[23].laz"]
gps_time = 'week'
[trajectory]
file = "../poses/t.csv"
[control]
file = "/data/control.csv"
[mounting] # from the drawing
lever_arm = [0.1, -0.6, 0.4]
boresight = [90.0, 0.0, 35.0]
# the end
"""


def test_a_copied_survey_file_keeps_all_but_the_mounting(tmp_path):
    "Comments and order stay, paths lead to the same files from the new folder, patterns too"
    old = tmp_path / "a [1]"
    new = tmp_path / "results" / "b"
    old.mkdir()
    new.mkdir(parents=True)
    (old / "survey.toml").write_text(SURVEY)
    mounting = replace(RECORDED, boresight=Rotation.from_rotvec([0, 0, 0.01]) * RECORDED.boresight)
    write_survey_copy(old / "survey.toml", new / "survey.toml", new, [mounting])
    text = (new / "survey.toml").read_text()
    for comment in ("# of a survey", "# the first", "# from the drawing", "# the end"):
        assert comment in text
    there = tomllib.loads(text)
    assert there["cloud"]["files"] == ["../../a [1]/pass-1.laz", "../../a [[]1]/pass-[23].laz"]
    assert there["cloud"]["gps_time"] == "week"
    assert there["trajectory"]["file"] == "../../a [1]/../poses/t.csv"
    assert there["control"]["file"] == "/data/control.csv"
    assert np.allclose(there["mounting"]["boresight"], [90, 0, 35 + np.degrees(0.01)], atol=2e-6)


def test_a_sigma_says_in_the_file_what_it_rests_on(tmp_path):
    """A comment stands beside the sigmas of a mounting, and goes when they are written without."""
    old = tmp_path / "survey.toml"
    new = tmp_path / "new.toml"
    old.write_text(SURVEY)
    mounting = replace(RECORDED, covariance=1e-6 * np.eye(6))
    write_survey_copy(old, new, tmp_path, [mounting], notes=["as the POS states"])
    assert "lever_arm_sigma = [0.001, 0.001, 0.001]  # as the POS states\n" in new.read_text()
    write_survey_copy(new, old, tmp_path, [mounting])
    assert "lever_arm_sigma = [0.001, 0.001, 0.001]\n" in old.read_text()


def test_sigmas_without_a_correlation_were_measured():
    """Either or both are what a calibration starts from; those that a calibration wrote are not.

    Both count in the sigmas of points, whoever found them.
    """
    arm = [0.01, 0.02, 0.03]
    turn = [0.5, 0.5, 1.0]
    sigma = np.append(arm, np.radians(turn))
    section = {"lever_arm": [0.1, -0.6, 0.4], "boresight": [90.0, 0.0, 35.0]}
    both = {"lever_arm_sigma": arm, "boresight_sigma": turn}
    taped = CalibratedMountingSection(**section, lever_arm_sigma=arm).mounting()
    assert np.allclose(prior_sigma(taped)[:3], arm) and taped.covariance is None
    measured = CalibratedMountingSection(**section, **both).mounting()
    assert np.allclose(prior_sigma(measured), sigma)
    assert np.allclose(measured.covariance, np.diag(sigma**2))
    written = CalibratedMountingSection(**section, **both, correlation=np.eye(6).tolist())
    assert np.array_equal(prior_sigma(written.mounting()), prior_sigma(RECORDED))
    assert np.allclose(written.mounting().covariance, measured.covariance)


@pytest.mark.parametrize("correlation", [False, True])
def test_a_changed_part_leaves_no_sigma_of_the_one_before(correlation, tmp_path):
    "The other part keeps a measured sigma; sigmas of a calibration are dropped with either part"
    old = tmp_path / "survey.toml"
    new = tmp_path / "new.toml"
    lines = "lever_arm_sigma = [0.01, 0.01, 0.01]\nboresight_sigma = [0.1, 0.1, 0.1]\n"
    lines += f"correlation = {np.eye(6).tolist()}\n" * correlation
    old.write_text(SURVEY + lines)
    turned = replace(RECORDED, boresight=Rotation.from_rotvec([0, 0, 0.01]) * RECORDED.boresight)
    write_survey_copy(old, new, tmp_path, [turned])
    left = {key for key in tomllib.loads(new.read_text())["mounting"] if key != "boresight"}
    assert left == {"lever_arm"} | ({"lever_arm_sigma"} if not correlation else set())


@pytest.mark.parametrize(
    "keys, fault",
    [
        (
            f"lever_arm_sigma = [0.1, 0.1, 0.1]\ncorrelation = {np.eye(6).tolist()}",
            "correlation needs both",
        ),
        (
            "lever_arm_sigma = [1.0, 1.0, 1.0]\nboresight_sigma = [1.0, 1.0, 1.0]\n"
            f"correlation = {(2 * np.eye(6)[::-1] - np.ones((6, 6))).tolist()}",
            "is not a correlation matrix",
        ),
    ],
)
def test_a_mounting_with_an_impossible_covariance_is_refused(keys, fault, tmp_path):
    "Correlations need the sigmas of both, and must be possible"
    path = tmp_path / "survey.toml"
    path.write_text(SURVEY.replace("# the end", keys))
    with pytest.raises(ValueError, match=fault):
        read_survey_file(path)


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    "Folder of a simulated survey of two short passes with a wrong mounting: 6 control, 2 check"
    folder = tmp_path_factory.mktemp("two passes")
    scenario = Scenario(
        drive={"duration": 8.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 6, "check": 2, "hidden": 0.0},
        scanner=[{"lines_per_second": 60, "points_per_line": 300}],
        effects=[
            {"name": "lever_arm", "magnitude": [0.08, -0.05, 0.10]},
            {"name": "boresight", "magnitude": [0.0, 0.0, 0.5]},
        ],
    )
    simulate(scenario, np.random.default_rng(5)).write(folder)
    return folder


@pytest.fixture(scope="module")
def commanded(street, tmp_path_factory):
    "mlscorr calibrate --json --clouds on that survey: (process, out)"
    out = tmp_path_factory.mktemp("calibrated") / "für Müller"
    options = ("--json", "--clouds", "--with-drift", "--no-ties")
    command = [MLSCORR, "calibrate", street, "-o", out, *options]
    return subprocess.run(command, capture_output=True, text=True), out


def test_the_command_writes_the_calibration(commanded):
    "calibration.json holds both methods, the same as on stdout, and the truth within its sigmas"
    process, out = commanded
    assert process.returncode == 0, process.stderr
    content = json.loads((out / "calibration.json").read_text())
    assert content == json.loads(process.stdout)
    assert content["schema"] == "mlscorr.calibration/1"
    assert np.shape(content["determined"]) == (6,)
    assert not content["determined"][2]
    assert "# not determined: lever arm" in (out / "survey.toml").read_text()
    for method in ("lsc", "ls"):
        assert np.shape(content[method]["correlation"]) == (6, 6)
        check = content[method]["check"]
        assert check["n"] >= 2 and max(check["before"]["rmse"]) > 0.05
        assert max(check["after"]["rmse"]) < 0.03  # m
    found = content["lsc"]
    truth = ([0.08, -0.05, 0.10], [0.0, 0.0, 0.5])
    for part, lacks in zip(("lever_arm", "boresight"), truth, strict=True):
        error = np.subtract(found[part]["correction"], lacks)
        assert (np.abs(error) < 4 * np.array(found[part]["sigma"])).all()
    assert max(content["with_drift"]["check"]["after"]["rmse"]) < 0.03


@pytest.mark.long
def test_the_survey_it_writes_can_be_calibrated_again(street, commanded):
    "survey.toml holds recorded + c and names the new clouds, which lack nothing any more"
    _, out = commanded
    content = json.loads((out / "calibration.json").read_text())
    old = mlscorr.read_survey(street)
    new = mlscorr.read_survey(out)
    change = new.mounting.lever_arm - old.mounting.lever_arm
    assert np.allclose(change, content["lsc"]["lever_arm"]["correction"], atol=1e-5)
    turn = (new.mounting.boresight * old.mounting.boresight.inv()).as_rotvec(degrees=True)
    assert np.allclose(turn, content["lsc"]["boresight"]["correction"], atol=2e-6)
    sigma = np.sqrt(np.diag(new.mounting.covariance))
    assert np.allclose(sigma[:3], content["lsc"]["lever_arm"]["sigma"], atol=1e-5)
    correlation = new.mounting.covariance / np.outer(sigma, sigma)
    assert np.allclose(correlation, content["lsc"]["correlation"], atol=2e-6)
    assert [file.path.parent for file in new.clouds] == [out, out]
    with warnings.catch_warnings(action="ignore"):
        again = mlscorr.calibrate(new, ties=False).calibration
    assert (np.abs(again.lsc.correction) < 1.5 * again.lsc.sigma).all()


@pytest.mark.long
def test_control_that_corrected_the_trajectory_does_not_count_again_in_silence(commanded, tmp_path):
    "A correction and a check say how many points count twice; of other points nobody complains"
    survey = mlscorr.read_survey(commanded[1])
    used = json.loads((commanded[1] / "calibration.json").read_text())["lsc"]["control"]["n"]
    assert set(survey.corrected_by) == set(survey.control.name) and used
    words = f"{len(survey.control)} of {len(survey.control)} control points"
    with pytest.warns(UserWarning, match=f"{words} .*count twice.*--with-drift"):
        result = mlscorr.correct(survey, ties="off")
    report = result.write(tmp_path / "out", page=False)
    assert any("count twice" in sentence for sentence in report["model"]["warnings"])
    assert any("count twice" in sentence for sentence in mlscorr.check(survey.path).warnings)
    mlscorr.apply(survey, [make_effect("time_offset", magnitude=1e-3)]).write(tmp_path / "applied")
    assert mlscorr.read_survey(tmp_path / "applied").corrected_by == survey.corrected_by
    others = replace(survey.control, name=tuple(f"new {name}" for name in survey.control.name))
    assert not list(reuse_warnings(replace(survey, control=others)))


@pytest.mark.long
def test_check_points_take_no_part(street, commanded, tmp_path):
    "With check points that are decimetres off the calibration is the same to the last digit"
    _, out = commanded
    folder = shutil.copytree(street, tmp_path / "survey")
    rows = (folder / "control.csv").read_text().splitlines()
    moved = [
        row if not row.endswith("check") else row.replace(",", ",", 1).replace(".", ".2", 1)
        for row in rows
    ]
    assert moved != rows
    (folder / "control.csv").write_text("\n".join(moved) + "\n")
    with warnings.catch_warnings(action="ignore"):
        result = mlscorr.calibrate(mlscorr.read_survey(folder), ties=False)
    content = json.loads((out / "calibration.json").read_text())
    assert np.allclose(
        result.calibration.lsc.correction[:3], content["lsc"]["lever_arm"]["correction"], atol=1e-12
    )


def test_a_survey_without_mounting_is_refused(street, tmp_path):
    "Without [mounting] there is nothing to calibrate, and the sentence says what to add"
    folder = shutil.copytree(street, tmp_path / "survey")
    text = (folder / "survey.toml").read_text()
    start = text.index("[mounting]")
    end = text.index("[control]")
    (folder / "survey.toml").write_text(text[:start] + text[end:])
    with pytest.raises(ValueError, match=r"has no \[mounting\]\. Add the lever_arm"):
        mlscorr.calibrate(mlscorr.read_survey(folder))


def test_files_measured_at_the_same_time_are_warned_of(street, tmp_path):
    "Two files of one time may be of two scanners, and a survey.toml has one mounting"
    folder = shutil.copytree(street, tmp_path / "survey")
    cloud = laspy.read(folder / "pass-1.laz")
    cloud.x += 0.01  # of another scanner, no copy
    cloud.write(folder / "pass-1-scanner-2.laz")
    text = (folder / "survey.toml").read_text()
    text = text.replace('["pass-1.laz"', '["pass-1.laz", "pass-1-scanner-2.laz"')
    (folder / "survey.toml").write_text(text)
    with pytest.warns(UserWarning, match=r"pass-1-scanner-2.laz and pass-1.laz overlap in time by"):
        warn_of_scanners(mlscorr.read_survey(folder))


@pytest.mark.long
def test_the_example_makes_its_picture(street, tmp_path):
    "The example calibrates a survey, prints what its mounting lacks, and draws it"
    script = EXAMPLES / "calibrate_mounting.py"
    picture = tmp_path / "picture.png"
    command = [sys.executable, script, street, "--picture", picture]
    assert "lever_arm lacks" in subprocess.check_output(command, text=True)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_a_measured_lever_arm_is_a_prior():
    "To a millimetre by tape: the calibration keeps it, and the boresight is told better too"
    site = Site(5, passes=1, swing=0.0)
    free = site.calibrate()
    true = RECORDED.lever_arm + LACKS[:3]
    tape = np.append(np.full(3, 1e-3), np.full(3, np.nan))
    measured = replace(RECORDED, lever_arm=true, measured=tape)
    assert np.array_equal(prior_sigma(measured)[3:], prior_sigma(RECORDED)[3:])
    seen = site.observations.position, site.observations.gps_time, np.zeros(len(site.observations))
    moved = georeferenced_anew(site.recorded, [RECORDED], [measured], *seen)
    matched = Matched.by_name(replace(site.observations, position=moved), site.control)
    calibration = estimate_mounting(site.recorded, [measured], matched)
    assert np.abs(calibration.lsc.correction[:3]).max() < 3e-3  # m
    assert (calibration.lsc.sigma[:3] <= 1.01e-3).all()
    assert (calibration.lsc.sigma < free.lsc.sigma).all()


@pytest.mark.parametrize("count", range(4))
def test_no_target_makes_a_mounting_worse_than_it_is_without_any(count):
    """One sigma by least squares is at most that without the survey, by any number of targets.

    One target leaves nothing to judge the noise by: what is stated of it holds.
    """
    site = Site(5)
    estimate = prior_mounting(site.recorded, [RECORDED], site.matched[np.arange(count)]).ls
    assert (estimate.sigma <= prior_sigma(RECORDED) * (1 + 1e-9)).all()
    assert np.allclose(estimate.covariance, estimate.covariance.T)
    assert (np.linalg.eigvalsh(estimate.covariance) > 0.0).all()
    assert (estimate.sigma0 == 1.0) == (count < 2)


@pytest.mark.parametrize(
    ("lines", "has_room"),
    [
        ("mounting = {{ {}, {} }}", True),
        ("mounting.{}\nmounting.{}", True),
        ("scanner = [{{ files = ['a'], mounting = {{ {}, {} }} }}]", False),
    ],
)
def test_a_mounting_in_one_line_stays_readable(lines, has_room, tmp_path):
    "Sigmas are written, and behind the line what they rest on: TOML has no comment inside of it"
    old = tmp_path / "survey.toml"
    new = tmp_path / "new.toml"
    head, _, _ = SURVEY.partition("[mounting]")
    text = lines.format("lever_arm = [0.1, -0.6, 0.4]", "boresight = [90.0, 0.0, 35.0]")
    old.write_text(f"{text}\n{head}")
    mounting = replace(RECORDED, covariance=1e-6 * np.eye(6))
    write_survey_copy(old, new, tmp_path, [mounting], notes=["as the POS states"])
    content = tomllib.loads(new.read_text())
    section = content if has_room else content["scanner"][0]
    assert section["mounting"]["lever_arm_sigma"] == [0.001] * 3
    assert ("  # as the POS states\n" in new.read_text()) == has_room


def test_a_beam_along_the_vehicle_keeps_its_turn():
    "At b = 90 deg many angles are one rotation: those that are written are it, without a warning"
    boresight = Rotation.from_euler("xyz", [0.0, -90.0, 30.0], degrees=True)
    with warnings.catch_warnings(action="error"):
        angles = mounting_values(replace(RECORDED, boresight=boresight))["boresight"]
    turn = Rotation.from_euler("xyz", angles, degrees=True) * boresight.inv()
    assert turn.magnitude() < 1e-8
