"""A scenario file in: what it may say, what is refused and how, and the examples."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.effects import make_effect
from mlscorr.io.surveys import read_survey
from mlscorr.simulate import Scenario, read_scenario, scenario_files, simulate
from tests.beds.places import EXAMPLES

SCENARIOS = sorted((EXAMPLES / "scenarios").glob("*.toml"))
SMALL = """
name = "small"
[targets]
control = 3
check = 1
[drive]
duration = 6.0
[[scanner]]
lines_per_second = 50
points_per_line = 300
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "scenario.toml"
        path.write_text(text)
        return path

    return write


def test_an_empty_file_is_the_default_scenario(write):
    "Every value has a default, so that a scenario says only what is special about it"
    assert read_scenario(write("")) == Scenario()


def test_what_is_written_is_read(write):
    "Sections, lists of sections, spans and effects"
    scenario = read_scenario(
        write(
            SMALL
            + "[pos]\noutages = [[1, 2.5]]\n"
            + '[[effects]]\nname = "time_offset"\nmagnitude = 0.002\n'
            + '[[effects]]\nname = "beam_divergence"\nmagnitude = 0.3\n'
        )
    )
    assert (scenario.name, scenario.targets.control, scenario.drive.duration) == ("small", 3, 6.0)
    assert scenario.scanner[0].points_per_line == 300
    assert scenario.pos.outages == ((1.0, 2.5),)
    assert scenario.imperfections == (
        make_effect("beam_divergence", magnitude=0.3),
        make_effect("time_offset", magnitude=0.002),
    )


def test_files_stand_relative_to_the_scenario(write, tmp_path):
    "A scenario and its files move together; a missing one is named with its key"
    text = '[drive]\nfile = "drives/a.csv"\n'
    with pytest.raises(FileNotFoundError, match=r"drive\.file of .* names .*a\.csv, which does"):
        read_scenario(write(text))
    (tmp_path / "drives").mkdir()
    (tmp_path / "drives" / "a.csv").write_text("")
    scenario = read_scenario(write(text))
    assert scenario.drive.file == tmp_path / "drives" / "a.csv"
    assert scenario_files(scenario) == [tmp_path / "drives" / "a.csv"]
    assert scenario.end is None


def test_a_missing_scenario_is_named(tmp_path):
    "The path that was looked for"
    with pytest.raises(FileNotFoundError, match=r"none\.toml does not exist; a scenario is a TOML"):
        read_scenario(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('name = "a\n', "is not valid TOML: .*line 1"),
        ("[scen]\nkind = 'river'", "scen is an unknown key; the nearest known one is scene"),
        ("[drive]\nspead = 8.0", r"drive\.spead is an unknown .* is drive\.speed"),
        ("[[scanner]]\nrange_nose = 1", r"scanner\.0\.range_nose is .* is scanner\.range_noise"),
        ("[targets]\ncontrol = 0", r"targets\.control = 0 is invalid: it .* or equal to 1"),
        ("[targets]\ncheck = -1", r"targets\.check = -1 .* or equal to 0"),
        ("[targets]\nhidden = 2", r"targets\.hidden = 2 .* less than or equal to 1"),
        ("[drive]\nspeed = 0", r"drive\.speed = 0 .* greater than 0"),
        ("[drive]\nspeed = nan", r"drive\.speed = nan .* finite number"),
        ("origin = [0, 0, inf]", r"origin\.2 = inf .* finite number"),
        ("[scene]\nkind = 'road'", r"scene\.kind = 'road' .* 'street', 'river' or 'mesh'"),
        ('[scene]\nkind = "mesh"', r'scene: kind = "mesh" needs a file'),
        ("[scanner]\nrange_noise = 1", r"scanner is a list of sections; write \[\[scanner\]\]"),
        ("scanner = []", r"scanner = \[\] .* at least 1 item"),
        ("[pos]\noutages = [[50, 30]]", r"pos\.outages of 30 s from 50 s is outside .* of 60 s"),
        ("[pos]\ncanyons = [[60, 1]]", r"pos\.canyons of 1 s from 60 s is outside"),
        ("[drive]\nstops = [[59, 2]]", r"drive\.stops of 2 s from 59 s is outside"),
        ("[pos]\noutages = [[5, -1]]", r"pos\.outages\.0\.1 = -1 .* greater than 0"),
        ("[[effects]]\nmagnitude = 1", r"effects\.0\.name is missing"),
        (
            "[[effects]]\nname = 'boresite'",
            r"effects\.0: 'boresite' is an unknown effect; the nearest known one is boresight\.",
        ),
        (
            "[[effects]]\nname = 'boresight'\nmagnitude = [0, 0, 200]",
            r"effects\.0: boresight of 200 deg exceeds 10 deg; ",
        ),
        ("[[effects]]\nname = 'dropout'\nshare = 0.1", r"dropout has no parameter 'share'; its"),
        (
            "[[effects]]\nname = 'position_step'\nmagnitude = [0, 0, 1]\ntime = 61",
            "position_step at 61 s is outside the drive of 60 s",
        ),
        (
            2 * "[[effects]]\nname = 'range_noise'\nmagnitude = 0.01\n",
            "range_noise is listed 2 times",
        ),
    ],
)
def test_what_can_not_be_is_refused_in_a_sentence(write, text, message):
    "Key, value, limit or nearest name; never a traceback, never a page"
    with pytest.raises(ValueError, match=message) as error:
        read_scenario(write(text))
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_all_faults_come_at_once(write):
    "One error lists all three mistyped keys, and no fault that only follows from these"
    text = "nam = 'a'\n[drive]\nspead = 1\n[[scanner]]\nrang_noise = 1\n"
    with pytest.raises(ValueError, match="unknown key") as error:
        read_scenario(write(text))
    assert str(error.value).count("unknown key") == 3
    assert "at least 1 item" not in str(error.value)


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_the_examples_are_read_and_say_where_they_come_from(path):
    "Each opens with a comment, and bears its file's name"
    assert path.read_text().startswith("# ")
    assert read_scenario(path).name == path.stem


def test_the_examples_are_the_surveys_they_say_they_are():
    "The paper's numbers: durations and points of car, boat and calibration site"
    scenarios = {path.stem: read_scenario(path) for path in SCENARIOS}
    assert set(scenarios) == {"boat", "calibration", "canyon", "car", "motorway"}
    numbers = {name: (s.targets.control, s.targets.check) for name, s in scenarios.items()}
    assert numbers["boat"] == (9, 15)
    assert numbers["calibration"] == (10, 54)
    assert numbers["car"][0] == 21
    assert (scenarios["car"].end, scenarios["boat"].end) == (186.0, 151.0)
    assert [p.direction for p in scenarios["canyon"].drive.passes] == ["forward", "back"]
    assert not scenarios["motorway"].imperfections


@pytest.mark.long
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_the_examples_can_be_simulated(path):
    "With ten lines a second: every pass is driven and recorded, and every scanner meets the scene"
    scenario = read_scenario(path)
    coarse = {"lines_per_second": 10.0, "points_per_line": 40}
    scanner = tuple(one.model_copy(update=coarse) for one in scenario.scanner)
    survey = simulate(scenario.model_copy(update={"scanner": scanner}), np.random.default_rng(1))
    assert len(survey.passes) == len(scenario.drive.passes)
    assert len(survey.targets) == scenario.targets.control + scenario.targets.check
    assert survey.trajectory.gps_time[-1] - scenario.start_time < scenario.end + 1.0  # s
    points = {block.file: len(block.cloud) for block in survey.blocks()}
    assert len(points) == len(scenario.drive.passes) * len(scanner)
    assert min(points.values()) > 1000


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "least", "most"),  # m, RMS of E, N, H
    [
        ("car", (0.1, 0.1, 0.02), (2.5, 2.5, 1.0)),
        ("boat", (0.08, 0.01, 0.2), (0.14, 0.06, 0.35)),
        ("calibration", (0.0, 0.0, 0.0), (0.02, 0.02, 0.03)),
        ("canyon", (0.01, 0.01, 0.01), (0.3, 0.3, 0.2)),
        ("motorway", (0.0, 0.0, 0.0), (0.02, 0.02, 0.03)),
    ],
)
def test_the_examples_drift_as_their_sky_lets_them(name, least, most):
    "The recorded position is wrong by centimetres under an open sky, by decimetres without it"
    scenario = read_scenario(SCENARIOS[0].with_name(f"{name}.toml"))
    rms = []
    for seed in range(2, 5):
        survey = simulate(scenario, np.random.default_rng(seed))
        error = survey.trajectory.position - survey.true_trajectory.position
        rms.append(np.sqrt((error**2).mean(axis=0)))
    assert (np.median(rms, axis=0) > least).all()
    assert (np.median(rms, axis=0) < most).all()


# ---- the command


def run(*arguments):
    command = [sys.executable, "-m", "mlscorr", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def test_a_bad_scenario_ends_in_a_sentence_and_writes_nothing(write, tmp_path):
    "Exit code 2, one line on stderr, no folder"
    scenario = write("[[effects]]\nname = 'boresight'\nmagnitude = [200, 0, 0]\n")
    done = run("simulate", scenario, "-o", tmp_path / "out")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert "boresight of 200 deg exceeds 10 deg" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("start_time = 700000", "start_time"),
        ("[drive]\nduration = 1e9", "the drive of 1e[+]09 s is longer than a week of 604800 s"),
        ("[drive]\npose_rate = 1e12", r"Unable to allocate .* Ask for less"),
    ],
)
def test_what_no_week_and_no_memory_hold_is_refused(key, words, write, tmp_path):
    "A sentence with the numbers, where memory ran out"
    ended = CliRunner().invoke(app, ["simulate", str(write(f"{key}\n")), "-o", str(tmp_path / "o")])
    assert ended.exit_code in (2, 3) and re.search(words, ended.stderr), ended.output


@pytest.mark.parametrize(
    ("crs", "words"),
    [("EPSG:2263", "US survey foot"), ("EPSG:4326", "a projected CRS"), ("none", "is unknown")],
)
def test_a_crs_that_no_survey_can_have_is_wrong_use(crs, words, write, tmp_path):
    "Exit code 2, as of survey.toml, before anything is simulated"
    scenario = write(f"crs = '{crs}'\n")
    ended = CliRunner().invoke(app, ["simulate", str(scenario), "-o", str(tmp_path / "out")])
    assert ended.exit_code == 2 and words in ended.stderr


@pytest.mark.long
def test_a_scenario_becomes_a_survey_that_can_be_read(write, tmp_path):
    "Scenario in, survey folder out, one JSON document on stdout; the same seed, the same bytes"
    scenario = write(SMALL + "[[effects]]\nname = 'vertical_datum'\nmagnitude = 0.1\n")
    done = run("simulate", scenario, "-o", tmp_path / "a", "--seed", 3, "--json")
    assert done.returncode == 0, done.stderr
    made = json.loads(done.stdout)
    assert next(iter(made.items())) == ("schema", "mlscorr.simulate/1")
    assert made["effects"] == [{"name": "vertical_datum", "magnitude": 0.1}]
    assert (made["seed"], made["control"], made["check"], made["passes"]) == (3, 3, 1, 1)
    survey = read_survey(tmp_path / "a")
    assert [f.points for f in survey.clouds] == [f["points"] for f in made["files"]]
    assert json.loads((tmp_path / "a" / "truth.json").read_text())["effect"] == "vertical_datum"

    again = run("simulate", scenario, "-o", tmp_path / "a", "--seed", 3)
    assert again.returncode == 2
    assert "already contains 7 entries" in again.stderr
    run("simulate", scenario, "-o", tmp_path / "b", "--seed", 3)
    for file in sorted((tmp_path / "a").iterdir()):
        if file.name != "log.txt":  # which has times
            assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes(), file.name


def test_the_simulator_is_at_hand_where_only_the_package_was_imported(tmp_path):
    "mlscorr.simulate.simulate(scenario, rng) needs no further import"
    (tmp_path / "scenario.toml").write_text(SMALL)
    lines = (
        "import mlscorr, numpy",
        "scenario = mlscorr.simulate.read_scenario('scenario.toml')",
        "print(mlscorr.simulate.simulate(scenario, numpy.random.default_rng(1)).files)",
    )
    command = [sys.executable, "-c", "\n".join(lines)]
    assert "pass-1.laz" in subprocess.check_output(command, text=True, cwd=tmp_path)
