"""A survey against the clouds of a simulator of one's own."""

import json
import shutil
from dataclasses import replace

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.io.surveys import simulated_survey
from mlscorr.simulate import Scenario, simulate
from tests.beds.documents import undocumented

pytestmark = pytest.mark.long

OFFSET = 0.02  # s


def made(folder, offset=0.0, seed=3, **scanner):
    "A survey of one scene; its clock is off"
    scanner = {"lines_per_second": 75, "points_per_line": 200} | scanner
    if offset:
        effects = [{"name": "time_offset", "magnitude": offset}]
    else:
        effects = []
    scenario = Scenario(
        drive={"duration": 20.0},
        targets={"control": 10, "check": 2},
        scanner=[scanner],
        effects=effects,
    )
    simulate(scenario, np.random.default_rng(seed)).write(folder)
    return folder


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    "Survey with a late clock, its simulation, and a simulation with 18 of 20 ms"
    path = tmp_path_factory.mktemp("own")
    real = made(path / "real", OFFSET)
    first = made(path / "first")
    return real, first, made(path / "next", 0.9 * OFFSET)


@pytest.fixture(scope="module")
def compared(folders, tmp_path_factory):
    "The document of the command with both runs"
    out = tmp_path_factory.mktemp("compared") / "out"
    real, first, following = map(str, folders)
    command = ["diagnose", real, "--simulated", first, "--simulated", following, "-o", str(out)]
    done = CliRunner().invoke(app, [*command, "-q"])
    assert done.exit_code == 0, done.output
    assert "Warning: Of first, " in done.output and "observed targets were paired" in done.output
    return json.loads((out / "gap.json").read_text())


def test_the_effect_that_their_simulator_lacks_is_named(compared):
    "A clock 20 ms off, to half a millisecond, by targets and by patches"
    assert compared["verdict"]["label"] == "time_offset"
    (offset,) = compared["causes"][0]["parameters"]
    assert offset["estimate"] == pytest.approx(OFFSET, abs=5e-4)
    assert {"target", "surface"} <= set(compared["channels"])


def test_channels_and_distances_are_compared_with_their_clouds(compared):
    "All channels have figures and differ in nothing; distances before and after, with floors"
    assert not undocumented(compared)
    assert not any(
        each["silent"] for each in compared["contrasts"] if each["channel"] != "edge_width"
    )
    assert [text for each in compared["contrasts"] for text in each["sentences"]] == []
    assert {"points", "intensity", "density", "target"} <= {
        r["channel"] for r in compared["distances"]
    }
    targets = [row for row in compared["distances"] if row["channel"] == "target"]
    assert all(row["before"] > row["floor_high"] for row in targets)
    (chamfer,) = [row for row in compared["distances"] if row["figure"] == "chamfer"]
    assert chamfer["after"] < chamfer["before"]


def test_their_next_run_tells_how_far_the_gap_shrinks(compared):
    "18 of 20 ms take 99 % of the square, to 1 %"
    assert compared["closure"]["shrink"] == pytest.approx(0.99, abs=0.01)
    assert "next run" in compared["closure"]["held_out"]
    assert "the second clouds alone" in compared["advice"][-1]
    assert any("another clock, other beams" in sentence for sentence in compared["warnings"])


def test_clouds_of_another_place_are_doubted(folders, tmp_path):
    "Moved 2 m along the street: surfaces are paired by place alone, and a warning says so first"
    moved = shutil.copytree(folders[1], tmp_path / "moved")
    cloud = laspy.read(moved / "pass-1.laz")
    cloud.y += 2.0
    cloud.write(moved / "pass-1.laz")
    warnings = mlscorr.diagnose(mlscorr.read_survey(folders[1]), simulated=[moved]).warnings
    assert any("or another place was simulated" in sentence for sentence in warnings)


def test_a_survey_is_no_simulation_of_itself(folders):
    "Against its own clouds, first or second, nothing differs of what is paired: it is refused"
    real = mlscorr.read_survey(folders[1])
    with pytest.raises(ValueError, match="are those of the survey"):
        mlscorr.diagnose(real, simulated=[folders[1] / "pass-1.laz"])
    with pytest.raises(ValueError, match="real are those of the survey"):
        other = mlscorr.read_survey(folders[0])
        mlscorr.diagnose(other, simulated=[folders[1], folders[0] / "pass-1.laz"])


@pytest.mark.parametrize("seed", [3, 5])
def test_half_of_their_points_is_no_noise(tmp_path, seed):
    "Every second point left out: the clock alone is named, and roughness tells of no belief"
    real = made(tmp_path / "real", OFFSET, seed, points_per_line=400)
    half = made(tmp_path / "half", seed=seed, points_per_line=400)
    cloud = laspy.read(half / "pass-1.laz")
    cloud.points = cloud.points[np.arange(0, len(cloud), 2)]
    cloud.write(half / "pass-1.laz")
    diagnosed = mlscorr.diagnose(mlscorr.read_survey(real), simulated=[half])
    assert diagnosed.inference.verdict.label == "time_offset"
    rows = diagnosed.rows.select(diagnosed.rows.channel == "roughness")
    assert len(rows) > 500
    assert abs(np.corrcoef(rows.residual, np.log(rows.assumed))[0, 1]) < 0.1


def test_clouds_of_another_drive_are_refused(folders, tmp_path):
    "Other times, another place, or nothing at all: with what differs, in s and m"
    real = mlscorr.read_survey(folders[0])
    away = replace(real, trajectory=replace(real.trajectory, position=real.trajectory.position + 9))
    with pytest.raises(ValueError, match=r"distance of its trajectory from that of .* is 15\.\d m"):
        simulated_survey(folders[1], away)
    late = replace(
        real, trajectory=replace(real.trajectory, gps_time=real.trajectory.gps_time + 99)
    )
    with pytest.raises(ValueError, match="simulation of another survey: its trajectory covers"):
        simulated_survey(folders[1], late)
    with pytest.raises(FileNotFoundError, match="contains no LAS or LAZ file"):
        simulated_survey(tmp_path, real)
    with pytest.raises(ValueError, match="EPSG:32651"):
        simulated_survey(folders[1], replace(real, crs="EPSG:32651"))
    with pytest.raises(ValueError, match=r"to the CRS of the survey.*EPSG:32651"):
        simulated_survey(folders[1] / "pass-1.laz", replace(real, crs="EPSG:32651"))


def test_clouds_elsewhere_are_refused(folders, tmp_path):
    "Clouds of other beams have no plane where the survey has one, or lie off the scan plane"
    turned = made(tmp_path / "turned", boresight=[90.0, 0.0, -35.0])
    with pytest.raises(ValueError, match="other beams"):
        mlscorr.diagnose(mlscorr.read_survey(folders[0]), simulated=[turned])


def test_three_runs_are_one_too_many(folders, tmp_path):
    "The sentence says how many there are, and which are wanted"
    runs = [part for _ in range(3) for part in ("--simulated", str(folders[1]))]
    done = CliRunner().invoke(app, ["diagnose", str(folders[0]), *runs, "-o", str(tmp_path / "o")])
    assert done.exit_code == 2
    assert "given 3 times" in done.output
    shutil.rmtree(tmp_path / "o", ignore_errors=True)
