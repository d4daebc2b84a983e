import json
import os
import resource
import subprocess
import sys
import tomllib
from pathlib import Path

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.frames import georeference, to_scanner
from mlscorr.io.clouds import cloud_writer, read_chunks
from mlscorr.simulate import DEMO, simulate
from mlscorr.simulate.scenario import (
    DriveScenario,
    EffectScenario,
    PassScenario,
    PosScenario,
    ScannerScenario,
    TargetScenario,
)
from mlscorr.survey import PointCloud
from tests.beds.places import ROOT
from tests.beds.shared import shared


def with_(scenario, **changes):
    return scenario.model_copy(update=changes)


SCANNER = DEMO.scanner[0]
SHORT = with_(
    DEMO,
    drive=DriveScenario(duration=6.0, speed=4.2),
    targets=TargetScenario(control=2, check=1, hidden=0.0),
    pos=PosScenario(),
)
PAIR = with_(  # two passes, two scanners, one of them spinning, several returns
    SHORT,
    drive=with_(SHORT.drive, passes=(PassScenario(), PassScenario(direction="back"))),
    scanner=(
        with_(SCANNER, beam_divergence=0.35, loss=0.2),
        ScannerScenario(
            kind="spinning",
            lever_arm=(0.0, -0.8, 0.6),
            boresight=(20.0, 0.0, 0.0),
            lines_per_second=10.0,
            points_per_line=180,
            rings=(-15.0, -5.0, 5.0, 15.0),
        ),
    ),
)


def make(scenario, seed=1):
    return simulate(scenario, np.random.default_rng(seed))


def with_effects(scenario, *effects):
    return with_(scenario, effects=tuple(EffectScenario(**effect) for effect in effects))


@pytest.fixture(scope="module")
def demo():
    return make(DEMO)


@pytest.fixture(scope="module")
def short():
    return make(SHORT)


@pytest.fixture(scope="module")
def pair():
    return make(PAIR)


def truly_placed(survey):
    "The measured pulses by the true trajectory and mountings: what noise alone leaves"
    for number, file in enumerate(survey.files):
        k = number % len(survey.true_mountings)
        for block in survey.blocks():
            if block.file == file:
                p = block.pulses
                yield (
                    georeference(
                        survey.true_trajectory, survey.true_mountings[k], p.scanner_xyz, p.gps_time
                    ),
                    p,
                )


def test_pulses_without_noise_return_the_points_they_hit():
    "Drive, passes, both kinds of scanners obey Eq. 1: the truth gives the true points to 1e-6 m"
    quiet = [with_(s, range_noise=0.0, angle_noise=0.0) for s in PAIR.scanner]
    for xyz, pulses in truly_placed(make(with_(PAIR, scanner=tuple(quiet)))):
        assert np.abs(xyz - pulses.point).max() < 1e-6  # m


def test_the_range_noise_on_planes_is_as_stated(short):
    "Along the beam, measured points scatter about the planes they hit by the stated 4 mm"
    for xyz, pulses in truly_placed(short):
        normal = short.scene.mesh.normal[pulses.triangle]
        steep = pulses.incidence > 0.5
        off_plane = np.einsum("ij,ij->i", xyz - pulses.point, normal) / pulses.incidence
        assert off_plane[steep].std() == pytest.approx(SCANNER.range_noise, rel=0.03)
        assert abs(off_plane[steep].mean()) < 1e-4  # m


def test_the_same_seed_gives_the_same_survey_and_another_seed_does_not(short):
    "Every number of a survey follows from its seed"
    again = make(SHORT)
    other = make(SHORT, seed=2)
    np.testing.assert_array_equal(again.cloud.xyz, short.cloud.xyz)
    np.testing.assert_array_equal(again.cloud.intensity, short.cloud.intensity)
    np.testing.assert_array_equal(again.targets.position, short.targets.position)
    assert len(other.cloud) != len(short.cloud)


@pytest.mark.long
def test_pulses_can_be_made_again_in_blocks_of_any_size(pair):
    "Memory is one block; asked again, with effects and all, blocks of any size give the same"
    noisy = make(
        with_effects(
            PAIR,
            {"name": "time_jitter", "magnitude": 1e-4},
            {"name": "range_noise", "magnitude": 0.01},
            {"name": "dropout", "magnitude": 0.1},
        )
    )
    for survey in (pair, noisy):
        small = list(survey.blocks(block=7_777))
        assert len(small) > 10
        np.testing.assert_array_equal(
            PointCloud.concatenate([block.cloud for block in small]).xyz, survey.cloud.xyz
        )
        assert sum(block.fired for block in small) == survey.fired


def test_a_seed_is_no_generator(short):
    """A whole number as rng ends in a sentence that makes a generator of it."""
    with pytest.raises(ValueError, match="rng = '5' is not a random generator"):
        simulate(short.scenario, 5)


def test_stages_do_not_disturb_each_other(short):
    "Losing GNSS changes what the POS records and nothing else"
    lost = make(with_(SHORT, pos=PosScenario(outages=((1.0, 4.0),))))
    np.testing.assert_array_equal(lost.pulses.range, short.pulses.range)
    np.testing.assert_array_equal(lost.targets.position, short.targets.position)
    np.testing.assert_array_equal(lost.true_trajectory.position, short.true_trajectory.position)
    assert np.abs(lost.trajectory.position - short.trajectory.position).max() > 1e-3  # m


PULSES = ("gps_time", "angle", "range", "intensity", "point", "triangle", "number_of_returns")
EFFECTS = [  # and which recorded quantities each may change
    ({"name": "beam_divergence", "magnitude": 1.0}, {"range", "intensity", "point", "triangle"}),
    ({"name": "time_offset", "magnitude": 0.002}, {"gps_time"}),
    ({"name": "time_jitter", "magnitude": 1e-4}, {"gps_time"}),
    ({"name": "range_bias", "magnitude": 0.01}, {"range"}),
    ({"name": "range_noise", "magnitude": 0.01}, {"range"}),
    ({"name": "angle_noise", "magnitude": 0.01}, {"angle"}),
    ({"name": "position_noise", "magnitude": 0.05}, {"trajectory"}),
    ({"name": "heading_drift", "magnitude": 0.1}, {"heading"}),
    ({"name": "lever_arm", "magnitude": [0.1, 0.0, 0.0]}, {"lever_arm"}),
    ({"name": "vertical_datum", "magnitude": 0.1}, {"control"}),
]


def recorded(survey):
    "All that a survey records, by name"
    angles = survey.trajectory.attitude.as_quat()
    return {
        **{name: getattr(survey.pulses, name) for name in PULSES},
        "trajectory": survey.trajectory.position,
        "heading": angles,
        "lever_arm": survey.mounting.lever_arm,
        "boresight": survey.mounting.boresight.as_quat(),
        "control": survey.targets.position,
    }


@pytest.mark.parametrize(("effect", "changes"), EFFECTS, ids=[one["name"] for one, _ in EFFECTS])
def test_an_effect_changes_what_its_stage_declares_and_nothing_else(short, effect, changes):
    "Every other recorded quantity stays bit for bit, and with magnitude zero all do"
    plain = recorded(short)
    changed = recorded(make(with_effects(SHORT, effect)))
    nothing = np.zeros_like(effect["magnitude"]).tolist()
    zero = recorded(make(with_effects(SHORT, {**effect, "magnitude": nothing})))
    for name, value in plain.items():
        np.testing.assert_array_equal(zero[name], value)
        if effect["name"] == "beam_divergence" and name in PULSES:
            continue  # other returns: compared below
        assert np.array_equal(changed[name], value) == (name not in changes), name
    if effect["name"] == "beam_divergence":
        assert len(changed["range"]) != len(plain["range"])


def test_effects_do_not_disturb_each_other(short):
    "Of two random effects, each draws what it draws alone; a wider beam leaves both as they are"
    jitter = {"name": "time_jitter", "magnitude": 1e-4}
    dropout = {"name": "dropout", "magnitude": 0.2}
    noise = {"name": "range_noise", "magnitude": 0.01}
    one = make(with_effects(SHORT, jitter, noise))
    both = make(with_effects(SHORT, jitter, noise, dropout))
    assert 0.79 < len(both.cloud) / len(one.cloud) < 0.81
    left = np.isin(one.pulses.gps_time, both.pulses.gps_time)
    np.testing.assert_array_equal(both.pulses.range, one.pulses.range[left])
    wide = make(with_effects(SHORT, jitter, {"name": "beam_divergence", "magnitude": 1.0}))
    first = wide.pulses.return_number == 1
    assert np.isin(one.pulses.gps_time, wide.pulses.gps_time[first]).mean() > 0.999


def test_a_wrong_clock_puts_points_outside_the_trajectory_and_these_are_left_out(short):
    "Points before the first epoch cannot be georeferenced; the others shift by speed times offset"
    early = make(with_effects(SHORT, {"name": "time_offset", "magnitude": -0.5}))
    assert early.pulses.gps_time.min() >= short.trajectory.gps_time[0]
    assert 0.9 < len(early.cloud) / len(short.cloud) < 0.95


def test_echoes_of_a_pulse_share_time_and_angle_whatever_acts_on_them():
    "Clock and encoder know pulses, not echoes"
    survey = make(
        with_effects(
            PAIR,
            {"name": "time_jitter", "magnitude": 1e-4},
            {"name": "angle_noise", "magnitude": 0.01},
        )
    )
    later = np.flatnonzero(survey.pulses.return_number > 1)
    assert len(later) > 10
    for values in (survey.pulses.gps_time, survey.pulses.angle):
        np.testing.assert_array_equal(values[later], values[later - 1])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_target_is_seen_on_its_bright_part(seed):
    "The coarse demo leaves 40 points on every target; denser scenarios leave more"
    survey = make(DEMO, seed)
    bright = survey.scene.mesh.reflectance[survey.pulses.triangle] > 0.8
    seen = survey.target[bright]
    counts = np.bincount(seen[seen >= 0], minlength=len(survey.targets))
    assert counts.min() >= 40
    assert set(survey.scene.targets.support) == {"post", "wall", "road"}


def test_targets_stand_out_by_intensity(demo):
    "A disc is several times brighter than its own board, and the mean of its points its centre"
    bright = demo.scene.mesh.reflectance[demo.pulses.triangle] > 0.8
    hidden = demo.scene.targets.hidden
    for i, kind in enumerate(demo.targets.kind):
        on_target = demo.target == i
        if kind == "circle":
            disc = np.median(demo.cloud.intensity[on_target & bright])
            board = np.median(demo.cloud.intensity[on_target & ~bright])
            assert disc > 5 * board
        centroid = demo.pulses.point[on_target & bright].mean(axis=0)
        if not hidden[i]:
            assert np.linalg.norm(centroid - demo.true_centre[i]) < 0.08  # m


def test_the_demo_shows_a_drift_worth_correcting(demo):
    "The demo's outage of 25 s leaves at least half a metre in the recorded cloud"
    moved = np.linalg.norm(demo.cloud.xyz - demo.pulses.point, axis=1)
    assert moved.max() > 0.5  # m
    assert 0.5e6 < len(demo.cloud) < 2e6
    assert DEMO.pos.outages[0][1] == 25.0  # s


def test_the_demo_loses_gnss_twice(demo):
    "In its canyon for 11 s and in its outage for 25 s: the stated sigma grows there alone"
    time = demo.trajectory.gps_time - demo.trajectory.gps_time[0]
    is_lost = np.linalg.norm(demo.trajectory.position_sigma, axis=1) > 0.08  # m; else 2 to 7 cm
    starts = time[1:][np.diff(is_lost.astype(int)) == 1]
    ends = time[1:][np.diff(is_lost.astype(int)) == -1]
    assert starts == pytest.approx([8.0, 29.0], abs=1.0)  # s, after 4 s of growth
    assert ends == pytest.approx([16.0, 50.0], abs=0.5)  # s
    assert [start for start, _ in DEMO.pos.canyons + DEMO.pos.outages] == [4.0, 25.0]  # s


def test_the_survey_folder_is_whole_and_as_promised(short, tmp_path):
    "survey.toml, cloud, trajectory, control and truth stand as the readers expect them"
    short.write(tmp_path)
    names = {"survey.toml", "pass-1.laz", "trajectory.csv", "control.csv"}
    assert {p.name for p in tmp_path.iterdir()} == names | {"truth.npz", "truth.json"}
    settings = tomllib.loads((tmp_path / "survey.toml").read_text())
    assert set(settings) == {
        *("name", "crs", "cloud", "trajectory", "mounting", "control", "scanner", "pos"),
    }
    assert settings["mounting"] == {"lever_arm": [0.1, -0.6, 0.4], "boresight": [90.0, 0.0, 35.0]}
    assert settings["cloud"] == {"files": ["pass-1.laz"], "gps_time": "week"}
    assert set(settings["scanner"]) == {"range_noise", "angle_noise", "lines_per_second"}
    assert set(settings["pos"]) == {"position_sigma", "attitude_sigma", "correlation_time"}
    header = (tmp_path / "trajectory.csv").read_text().splitlines()[0]
    assert header.startswith("gps_time,easting,northing,height,roll,pitch,heading,sigma_easting")
    rows = (tmp_path / "control.csv").read_text().splitlines()
    assert rows[0] == (
        "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role"
    )
    assert [row.split(",")[-1] for row in rows[1:]] == ["control", "check", "control"]


@pytest.mark.parametrize(
    ("effects", "name", "params"),
    [
        ((), "none", {}),
        (({"name": "time_offset", "magnitude": 0.005},), "time_offset", {"magnitude": 0.005}),
        (
            (
                {"name": "vertical_datum", "magnitude": 0.1},
                {"name": "lever_arm", "magnitude": [0.1, 0, 0]},
            ),
            "lever_arm+vertical_datum",
            {"lever_arm": {"magnitude": [0.1, 0, 0]}, "vertical_datum": {"magnitude": 0.1}},
        ),
    ],
    ids=["none", "one", "two"],
)
def test_the_truth_names_the_effects_and_the_seed(tmp_path, effects, name, params):
    "truth.json says what was done to the survey, as the practice surveys' does"
    make(with_effects(SHORT, *effects), seed=7).write(tmp_path)
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert (truth["effect"], truth["params"], truth["seed"]) == (name, params, 7)
    assert truth["scenario"]["drive"]["duration"] == 6.0
    recorded = tomllib.loads((tmp_path / "survey.toml").read_text())["mounting"]
    lever_arm = truth["mountings"]["true"][0]["lever_arm"]
    missing = np.array(lever_arm) - recorded["lever_arm"]  # true = recorded + effect
    np.testing.assert_allclose(missing, [0.1 * ("lever" in name), 0, 0], atol=1e-9)


def test_two_scanners_on_two_passes_are_four_files(pair, tmp_path):
    "Each file holds its scanner's points in time order; truth.npz follows their order"
    pair.write(tmp_path)
    survey = mlscorr.read_survey(tmp_path)
    names = ["pass-1.laz", "pass-1-scanner-2.laz", "pass-2.laz", "pass-2-scanner-2.laz"]
    assert [file.path.name for file in survey.clouds] == names
    assert len(survey.trajectory.gaps) == 1
    truth = np.load(tmp_path / "truth.npz")
    first = 0
    mountings = json.loads((tmp_path / "truth.json").read_text())["mountings"]
    assert mountings["recorded"][1]["lever_arm"] == [0.0, -0.8, 0.6]
    for number, name in enumerate(names):
        las = laspy.read(tmp_path / name)
        rows = slice(first, first + len(las.points))
        first = rows.stop
        time = np.array(las.gps_time)
        assert (np.diff(time) >= 0).all()
        assert set(np.unique(survey.trajectory.segment(time))) == {number // 2}
        mounting = pair.true_mountings[number % 2]
        xyz = to_scanner(pair.trajectory, mounting, las.xyz, time)
        error = georeference(pair.true_trajectory, mounting, xyz, time) - truth["point_xyz"][rows]
        assert np.sqrt((error**2).mean()) < 0.004  # m: range noise
        count = np.array(las.number_of_returns)
        numbers = np.array(las.return_number)
        assert (numbers <= count).all()
        assert (count.max() > 1) == (number % 2 == 0)  # the one with a footprint
    assert first == len(truth["point_xyz"]) == len(truth["point_target"])


def test_the_written_cloud_keeps_frames_and_signs(short, tmp_path):
    "Back in the scanner frame, written points lie in the scan plane, at the LAS scan angle"
    short.write(tmp_path)
    las = laspy.read(tmp_path / "pass-1.laz")
    assert las.header.point_format.id == 6
    assert las.header.parse_crs().to_epsg() == 32650
    assert las.header.global_encoding.gps_time_type == laspy.header.GpsTimeType.WEEK_TIME
    np.testing.assert_array_equal(las.gps_time, short.pulses.gps_time)
    xyz = to_scanner(short.trajectory, short.mounting, las.xyz, np.array(las.gps_time))
    assert np.sqrt((xyz[:, 2] ** 2).mean()) < 0.0004  # m, the rounding to 1 mm
    angle = np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0]))
    difference = np.mod(angle - np.array(las.scan_angle) * 0.006 + 180.0, 360.0) - 180.0
    assert np.sqrt((difference**2).mean()) < 0.006  # deg
    target = np.load(tmp_path / "truth.npz")["point_target"]
    np.testing.assert_array_equal(target, short.target)


@pytest.mark.long
def test_a_written_survey_can_be_corrected(tmp_path):
    "The readers take the folder, and the correction brings the check points to 2 cm"
    several = with_(
        PAIR,
        drive=with_(PAIR.drive, duration=12.0),
        targets=TargetScenario(control=5, check=2, hidden=0.0),
        scanner=(SCANNER,),
        pos=PosScenario(outages=((2.0, 8.0),), processing="filtered"),
    )
    make(several).write(tmp_path)
    result = mlscorr.correct(mlscorr.read_survey(tmp_path), ties="off")
    assert result.check["n"] >= 3  # two targets on two passes
    assert max(result.check["after"]["rmse"]) < 0.02  # m


def test_a_survey_without_any_noise_can_be_read(tmp_path):
    "Without noise, sigmas are omitted or at their rounding, as some readers require them"
    quiet = with_(SCANNER, range_noise=0.0, angle_noise=0.0)
    exact = TargetScenario(control=2, check=0, survey_sigma=(0.0, 0.0))
    survey = make(with_(SHORT, scanner=(quiet,), targets=exact))
    survey.write(tmp_path)
    read = mlscorr.read_survey(tmp_path)
    assert (read.control.sigma == 1e-4).all()  # m
    assert np.abs(read.control.position - survey.true_centre).max() <= 0.5001e-4


def test_progress_counts_every_pulse_that_is_fired(pair, tmp_path):
    "The announced work is done in steps of a block, so the remaining time is right"
    bars = []

    def progress(title, total):
        bars.append([title, total])
        return bars[-1].append

    pair.write(tmp_path, progress)
    assert [title for title, *_ in bars] == ["Simulating pulses", "Writing the truth"]
    for _, total, *steps in bars:
        assert total == sum(steps)
    assert bars[0][1] == pair.fired
    assert bars[1][1] == len(pair.cloud) * (3 * 8 + 2)  # bytes: a point and its target


SCRIPT = """
import sys, numpy as np
from tests.simulate.test_simulate import PAIR, make
make(PAIR).write(sys.argv[1])
"""


def write_apart(folder, limit=None, **environment):
    "Write a survey in a process of its own, on one core when asked, perhaps with little disk"

    def before():
        if environment:
            os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    path = str(ROOT)
    return subprocess.run(
        [sys.executable, "-c", SCRIPT, str(folder)],
        env={**os.environ, "PYTHONPATH": path, **environment},
        preexec_fn=before,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.long
def test_the_same_seed_writes_the_same_bytes_with_any_number_of_threads(pair, tmp_path):
    "A survey can be made again, bit for bit, on another day, by one core as by many"
    pair.write(tmp_path / "many")
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "NUMBA", "RAYON", "OPENBLAS")}
    done = write_apart(tmp_path / "one", **threads)
    assert done.returncode == 0, done.stderr
    files = {path.name for path in (tmp_path / "many").iterdir()}
    assert files == {path.name for path in (tmp_path / "one").iterdir()}
    for name in files:
        assert (tmp_path / "many" / name).read_bytes() == (tmp_path / "one" / name).read_bytes(), (
            name
        )


@pytest.mark.long
@pytest.mark.parametrize("limit", [0, 30_000, 300_000])
def test_a_full_disk_leaves_nothing(tmp_path, limit):
    "One sentence that names the folder, and nothing half written, wherever the disk is full"
    done = write_apart(tmp_path / "out", limit=limit)
    assert done.returncode == 1
    assert "can't be written to" in done.stderr.splitlines()[-1]
    assert "OSError" in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_a_crs_that_no_survey_can_have_is_refused():
    "In degrees or feet nothing is simulated: the folder could not be read again"
    for crs, fault in (("EPSG:4326", "a projected CRS is needed"), ("EPSG:2263", "not in meters")):
        with pytest.raises(ValueError, match=fault):
            make(with_(SHORT, crs=crs))


@pytest.mark.parametrize("sight", [{"max_range": 0.1}, {"field_of_view": (180.0, -180.0)}])
def test_a_drive_that_meets_nothing_is_refused(tmp_path, sight):
    "A scanner that sees nothing, or fires nothing, is told in one sentence, and no folder is made"
    blind = make(with_(SHORT, scanner=(with_(SCANNER, **sight),)))
    with pytest.raises(ValueError, match=r"No pulse of pass-1.laz hit anything.*field_of_view"):
        blind.write(tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("second", "corner", "message"),
    [
        ([np.nan, 3_374_000.0, 42.0], [532_000.0, 3_374_000.0, 42.0], "1 of 2 points"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "A point is 3374000 m from the corner of the cloud"),
    ],
    ids=["not finite", "too wide"],
)
def test_a_cloud_that_no_file_can_hold_is_refused(tmp_path, second, corner, message):
    "A NaN never becomes the coordinate -2147483.648; 32 bits hold 2147 km at a millimetre, no more"
    xyz = np.array([[532_000.0, 3_374_000.0, 42.0], second])
    cloud = PointCloud(xyz, np.array([357_700.0, 357_700.1]), np.zeros(2, np.uint16))
    with (
        pytest.raises(ValueError, match=message),
        cloud_writer(tmp_path / "cloud.laz", np.array(corner)) as writer,
    ):
        writer.write(cloud)
    assert not list(tmp_path.iterdir())


def look_of(folder):
    "Spacing (m) and plane residuals (m) on targets, and contrast of discs to boards: medians"
    survey = mlscorr.read_survey(folder)
    points = survey.surveyed
    chunks = [chunk for file in survey.clouds for chunk in read_chunks(file)]
    cloud = PointCloud.concatenate(chunks)
    rows = []
    for centre, kind, size in zip(points.position, points.kind, points.size, strict=True):
        near = cloud[np.linalg.norm(cloud.xyz - centre, axis=1) < 0.45 * size]
        if kind != "circle" or len(near) < 100:
            continue
        local = near.xyz - near.xyz.mean(axis=0)
        residual = np.linalg.svd(local, full_matrices=False)[0][:, 2]
        residual *= np.linalg.svd(local, compute_uv=False)[2]
        ring = np.linalg.norm(cloud.xyz - centre, axis=1)
        board = cloud.intensity[(ring > 0.55 * size) & (ring < 0.65 * size)]
        spacing = np.sqrt(np.pi * (0.45 * size) ** 2 / len(near))
        rows.append(
            [
                spacing,
                1.4826 * np.median(np.abs(residual)),
                np.median(near.intensity) / np.median(board),
            ]
        )
    return np.median(rows, axis=0)


@pytest.mark.long
def test_the_shared_survey_looks_like_this_simulators(tmp_path):
    "With its parameters, spacing, noise on planes and contrast agree with another simulator's"
    real = look_of(shared("surveys", "practice_none"))
    scanner = ScannerScenario(lines_per_second=150.0, points_per_line=3600)  # of its pulses' times
    like = with_(
        DEMO,
        drive=DriveScenario(duration=8.0, speed=8.2),
        targets=TargetScenario(control=6, check=2, hidden=0.0, kinds=("circle",)),
        scanner=(scanner,),
        pos=PosScenario(),
    )
    make(like).write(tmp_path)
    ratio = look_of(tmp_path) / real
    assert (ratio > 0.5).all(), ratio
    assert (ratio < 2.0).all(), ratio


def test_the_simulator_does_not_know_the_estimators_model():
    "Drift is never drawn from the covariance family that the estimator assumes"
    import ast

    import mlscorr.effects
    import mlscorr.simulate

    for room in (mlscorr.simulate, mlscorr.effects):
        for path in Path(room.__file__).parent.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    names = [a.name for a in node.names]
                else:
                    names = []
                if isinstance(node, ast.ImportFrom):
                    names = [f"{node.module}.{a.name}" for a in node.names]
                for name in names:
                    for model in ("covariance", "collocation", "mlscorr.correction"):
                        assert model not in name, path.name
