"""The diagnosis of the gap from files to files."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import tomlkit
from gap_training.cases import RANDOM
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.effects import make_effect
from mlscorr.gap.evidence import Cause, Costs, ErrorModel
from mlscorr.gap.evidence.labels import kind_of
from mlscorr.gap.signatures import Signature, as_assumed, with_cause
from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline import read_effects
from mlscorr.simulate import Scenario, beliefs_of, read_simulator, simulate, write_simulator
from tests.beds import diagnosed_street
from tests.beds.documents import undocumented
from tests.beds.made_once import copied_once
from tests.beds.shared import shared

OFFSET = 0.02  # s
KEYS = {
    *("schema", "verdict", "gap", "headline", "advice", "where", "causes", "separability"),
    *("closure", "next_data", "evidence", "innovations", "windows", "map", "channels"),
    *("simulator", "left_out", "mendable", "warnings", "notes", "name", "absent"),
    *("rating", "statements", "agreement", "assumed", "costs", "contrasts", "distances"),
    "clouds",
}


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    "A survey whose scanner clock is 20 ms off, without its truth"
    return copied_once(tmp_path_factory, "late", diagnosed_street.write_late)


@pytest.fixture(scope="module")
def decoded():
    "Numbers of points, chunk by chunk, that the diagnosis in `diagnosed` decoded"
    return []


@pytest.fixture(scope="module")
def diagnosed(late, decoded, tmp_path_factory):
    "Output of the command for it"
    out = tmp_path_factory.mktemp("diagnosed") / "out"

    def counted(file):
        for chunk in read_chunks(file):
            decoded.append(len(chunk))
            yield chunk

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mlscorr.pipeline.finding.read_chunks", counted)
        done = CliRunner().invoke(app, ["diagnose", str(late), "-o", str(out), "--json"])
    assert done.exit_code == 0, done.output
    return out


def test_the_effect_that_acts_is_named_with_its_size(diagnosed):
    "A clock that is 20 ms off is found, its size within the 95 % interval, and the gap closes"
    told = json.loads((diagnosed / "gap.json").read_text())
    assert told["schema"] == "mlscorr.gap/1"
    assert set(told) == KEYS
    assert not undocumented(told)
    assert told["verdict"]["label"] == "time_offset"
    (offset,) = told["causes"][0]["parameters"]
    assert abs(offset["estimate"] - OFFSET) < 1.96 * offset["sigma"]
    assert offset["sigma"] < 0.002
    closure = told["closure"]
    assert closure["shrink"] > 0.9
    assert closure["null_band"][1] < closure["before"]
    assert abs(sum(told["where"][0]["share"]) - 1) < 1e-9


def test_what_was_diagnosed_can_be_taken_out_of_these_clouds(late, diagnosed):
    "gap.json knows them: the clock offset goes out of this survey"
    survey = mlscorr.read_survey(late)
    found = read_effects(diagnosed / "gap.json")
    assert [row["name"] for row in found.clouds] == [file.path.name for file in survey.clouds]
    assert mlscorr.apply(survey, found).effects == found.effects


@pytest.mark.long
def test_a_second_run_with_its_simulator_finds_nothing_more(late, diagnosed, tmp_path):
    "With the simulator that the first run wrote nothing is left to find"
    simulator = read_simulator(diagnosed / "simulator.toml")
    assert [effect.name for effect in simulator.effects] == ["time_offset"]
    second = mlscorr.diagnose(mlscorr.read_survey(late), simulator)
    again = second.document
    assert again["verdict"]["sentence"] in second._repr_html_()
    causes = {cause["effect"] for cause in again["causes"] if cause["parameters"]}
    assert set(second.to_frame().get("effect", ())) == causes
    assert second.plot("evidence").axes
    assert again["verdict"]["label"] == "none"
    assert again["simulator"]["effects"][0]["name"] == "time_offset"
    assert again["closure"]["shrink"] == 0.0


def test_the_page_and_the_numbers_say_the_same(diagnosed):
    "The page opens with the verdict that the numbers hold, and asks nothing of the net"
    page = (diagnosed / "gap.html").read_text()
    assert "20" in page and "clock of the scanner" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


@pytest.mark.long
def test_the_diagnosis_never_opens_the_truth(late, tmp_path, diagnosed):
    "With truth files that can't be read, and nobody counting, the result is the same to the byte"
    folder = shutil.copytree(late, tmp_path / "late")
    (folder / "truth.npz").mkdir()
    (folder / "truth.json").mkdir()
    done = CliRunner().invoke(app, ["diagnose", str(folder), "-o", str(tmp_path / "out"), "-q"])
    assert done.exit_code == 0, done.output
    one, two = ((out / "gap.json").read_bytes() for out in (diagnosed, tmp_path / "out"))
    assert one == two


def test_the_cloud_is_read_once(late, diagnosed, decoded):
    "Each file is decoded from its first to its last point, and no more"
    assert sum(decoded) == sum(file.points for file in mlscorr.read_survey(late).clouds)


def test_a_mounting_that_differs_in_the_simulator_is_an_effect(late):
    "A simulator that knows a lever arm 9 cm longer is one with a lever_arm effect of 9 cm"
    survey = mlscorr.read_survey(late)
    simulator = beliefs_of(survey)
    arm = simulator.mounting.lever_arm + np.array([0.09, 0.0, 0.0])
    assumed = replace(simulator, mounting=replace(simulator.mounting, lever_arm=arm))
    _, (effect,) = as_assumed(survey, assumed)
    assert effect.name == "lever_arm"
    assert np.allclose(effect.magnitude, [0.09, 0.0, 0.0], atol=1e-9)


def test_a_cause_that_the_simulator_has_already_is_joined_with_it(late, tmp_path):
    "15 ms and 5 ms more make one time_offset of 20 ms; a POS twice as bad has twice the sigma"
    survey = mlscorr.read_survey(late)
    effect = make_effect("time_offset", magnitude=0.015)
    simulator = replace(beliefs_of(survey), effects=(effect,))
    none = np.zeros(1)
    kind = Signature(
        type(effect), {}, ("magnitude",), ("s",), none + 1e-3, none[:, None], none, none
    )
    cause = Cause("time_offset", 1.0, (), ((kind, np.array([0.005])),), none, None, ErrorModel())
    (joined,) = with_cause(simulator, survey, cause).effects
    assert abs(joined.magnitude - OFFSET) < 1e-12
    worse = Cause("position_noise", 1.0, (), (), none, None, ErrorModel(scale=2.0))
    pos = with_cause(simulator, survey, worse).pos
    assert pos.position_sigma == 2 * survey.pos.position_sigma
    window = (357710.0, 20.0, 12.0, "rise")
    outage = Cause("position_noise", 1.0, (), (), none, None, ErrorModel(windows=(window,)))
    improved = with_cause(simulator, survey, outage)
    assert improved.pos.windows == (window,)
    write_simulator(improved, tmp_path / "simulator.toml")
    assert read_simulator(tmp_path / "simulator.toml").pos.windows == (window,)
    assert as_assumed(survey, improved)[0].pos.windows == (window,)
    bare = replace(simulator, pos=replace(simulator.pos, assumed=("position_sigma",)))
    assert with_cause(bare, survey, worse).pos.assumed == ()  # twice the default was found
    assert with_cause(bare, survey, outage).pos.assumed == ("position_sigma",)


@pytest.mark.long
def test_too_few_targets_are_told_with_the_plan(tmp_path):
    "One target and no surface say nothing: what is missing, and what could be seen, is told"
    scenario = Scenario(
        drive={"duration": 8.0},
        targets={"control": 1, "check": 1},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    folder = tmp_path / "few"
    simulate(scenario, np.random.default_rng(5)).write(folder)
    with pytest.raises(ValueError, match="at least 12 targets") as error:
        mlscorr.diagnose(mlscorr.read_survey(folder))
    assert "scanner clock offset" in str(error.value)


def test_a_simulator_with_an_unknown_effect_is_refused(late, tmp_path):
    "An effect that nobody knows is an error of usage that names the nearest known one"
    (tmp_path / "simulator.toml").write_text('[[effects]]\nname = "time_ofset"\nmagnitude = 0.1\n')
    arguments = ["diagnose", str(late), "-o", str(tmp_path / "out"), "--simulator"]
    done = CliRunner().invoke(app, [*arguments, str(tmp_path / "simulator.toml")])
    assert done.exit_code == 2
    assert "time_offset" in done.output
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_reference_in_other_coordinates_is_an_error_of_input(tmp_path):
    "A reference surface 100 m off is named as such, not taken for an effect"
    import open3d as o3d

    folder = shutil.copytree(shared("surveys", "practice_none"), tmp_path / "moved")
    mesh = o3d.io.read_triangle_mesh(str(folder / "reference.ply"))
    path = folder / "reference.ply"
    path.chmod(0o644)
    vertices = np.asarray(mesh.vertices) + np.array([0.0, 0.0, 100.0])
    faces = np.asarray(mesh.triangles)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match="coordinates"):
        mlscorr.diagnose(mlscorr.read_survey(folder))


@pytest.mark.long
def test_a_survey_is_planned_without_a_cloud(late, tmp_path):
    "Before driving, the plan tells the smallest effects that show and what can't be told apart"
    folder = shutil.copytree(late, tmp_path / "planned")
    for cloud in folder.glob("*.laz"):
        cloud.unlink()
    text = (folder / "survey.toml").read_text()
    start = text.index("[cloud]")
    end = text.index("[trajectory]")
    (folder / "survey.toml").write_text(text[:start] + text[end:])
    done = CliRunner().invoke(app, ["plan", str(folder), "-o", str(tmp_path / "out"), "--json"])
    assert done.exit_code == 0, done.output
    plan = json.loads((tmp_path / "out" / "plan.json").read_text())
    assert plan["schema"] == "mlscorr.plan/1"
    (offset,) = plan["detectable"]["time_offset"]
    assert 1e-4 < offset["detectable"] < 0.02
    assert any({"lever_arm", "vertical_datum"} <= set(members) for members in plan["classes"])
    header, *lines = done.stderr[done.stderr.index("Smallest effect that shows") :].splitlines()
    unit = header.index("unit")
    usual = header.index("usual size")
    for line in lines[: sum(map(len, plan["detectable"].values()))]:  # columns below their heads
        assert line[unit - 1] == line[usual - 1] == " " != line[unit]
    refused = CliRunner().invoke(app, ["diagnose", str(folder), "-o", str(tmp_path / "other")])
    assert refused.exit_code == 2
    assert "cloud is missing" in refused.output


def _with_control_moved(folder, out, names, away):
    "The survey with some surveyed points moved to the east by metres"
    shutil.copytree(folder, out)
    lines = (out / "control.csv").read_text().splitlines()
    for i, line in enumerate(lines):
        name, east, *rest = line.split(",")
        if name in names:
            lines[i] = ",".join([name, str(float(east) + away), *rest])
    (out / "control.csv").write_text("\n".join(lines) + "\n")
    return mlscorr.read_survey(out)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    "A survey in which nothing is wrong"
    return copied_once(tmp_path_factory, "sound", diagnosed_street.write)


@pytest.mark.long
def test_a_moved_control_point_is_named_with_its_size(sound, tmp_path):
    "A point surveyed 0.3 m too far east is the target_outlier, by name and to 2 cm"
    survey = _with_control_moved(sound, tmp_path / "moved", ("T05",), 0.3)
    found = mlscorr.diagnose(survey).document
    assert found["verdict"]["label"] == "target_outlier"
    assert found["causes"][0]["target"] == "T05"
    east, north, height = (part["estimate"] for part in found["causes"][0]["parameters"])
    assert np.allclose([east, north, height], [0.3, 0.0, 0.0], atol=0.02)


@pytest.mark.long
def test_nothing_wrong_is_not_said_of_what_was_not_seen(sound, tmp_path):
    "With two intervals 3 m from their surveyed targets the verdict is not none, and gives them"
    away = ("T04", "T05", "T06", "T10", "T11")
    survey = _with_control_moved(sound, tmp_path / "outages", away, 3.0)
    diagnosed = mlscorr.diagnose(survey)
    found = diagnosed.document
    assert found["verdict"]["label"] != "none"
    if found["absent"]:  # else they were matched, and the rows tell of them
        assert {name for run in found["absent"] for name in run["names"]} <= set(away)
        assert "T05" in found["warnings"][0]
        assert "T05" in found["next_data"][0]["survey"]
        diagnosed.write(tmp_path / "out")
        assert "not everything could be compared" in (tmp_path / "out" / "gap.html").read_text()


@pytest.mark.parametrize("given", ["cautious", "4,1", "4,1,-1", "4;1;1", "4,1,nan"])
def test_costs_that_are_none_are_refused_before_anything_is_read(late, tmp_path, given):
    "A name that there isn't, two numbers, one below zero: exit code 2, with what is meant"
    command = ["diagnose", str(late), "-o", str(tmp_path / "out"), "--costs", given]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 2
    assert "careful" in done.output and "4,1,0.9" in done.output
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_costs_choose_the_label(late, tmp_path):
    "If a false alarm costs more than any odds, no cause is named even for a clock surely off"
    command = ["diagnose", str(late), "-o", str(tmp_path / "out"), "--costs", "1e30,1,0.9"]
    assert CliRunner().invoke(app, command).exit_code == 0
    told = json.loads((tmp_path / "out" / "gap.json").read_text())
    assert told["costs"] == {"false_alarm": 1e30, "miss": 1.0, "unknown": 0.9}
    assert kind_of(told["verdict"]["label"], RANDOM) in ("none", "noise")


@pytest.mark.parametrize("cost", [-1.0, np.nan, np.inf])
def test_costs_below_zero_are_refused(street, cost):
    "Of a false alarm that pays, or has no size, no label is the cheapest one"
    with pytest.raises(ValueError, match="each cost must be a finite number"):
        mlscorr.diagnose(mlscorr.read_survey(street), costs=Costs(false_alarm=cost))


@pytest.fixture(scope="module")
def unstated(tmp_path_factory):
    "A street on which the POS loses GNSS, and of whose accuracy no file states anything"
    folder = tmp_path_factory.mktemp("unstated") / "survey"
    scenario = Scenario(
        drive={"duration": 50.0},
        pos={"processing": "filtered", "outages": [[12.0, 25.0]]},
        targets={"control": 16, "check": 3},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(5)).write(folder)
    table = (folder / "trajectory.csv").read_text().splitlines()
    table = [line.rsplit(",", 6)[0] for line in table]
    (folder / "trajectory.csv").write_text("\n".join(table) + "\n")
    content = tomlkit.parse((folder / "survey.toml").read_text())
    del content["pos"]
    del content["scanner"]["range_noise"]
    (folder / "survey.toml").write_text(tomlkit.dumps(content))
    return folder


@pytest.mark.long
def test_a_default_is_no_statement(unstated, tmp_path):
    "Decimeters of drift where nobody stated a sigma: assumed, neither unknown nor beyond stated"
    found = mlscorr.diagnose(mlscorr.read_survey(unstated))
    told = found.write(tmp_path / "out")
    assert not undocumented(told)
    rows = {row["key"]: row for row in told["assumed"]}
    assert set(rows) == {
        *("pos.position_sigma", "pos.attitude_sigma", "pos.correlation_time"),
        "scanner.range_noise",
    }
    position = rows["pos.position_sigma"]
    assert (position["value"], position["unit"]) == (0.02, "m")
    off = max(part["rms_mm"] for part in told["agreement"])
    assert 1e3 * position["estimate"] == pytest.approx(off, rel=1.5)
    assert position["estimate"] > 0.03
    assert told["verdict"]["label"] == "none" and told["verdict"]["excess"] == ""
    assert "range_noise" in told["left_out"] and "roughness" not in told["channels"]
    sentences = " ".join(row["sentence"] for row in told["statements"])
    assert "as accurate as stated" not in sentences and "less accurate" not in sentences
    written = (tmp_path / "out" / "simulator.toml").read_text()
    assert "position_sigma" not in written and "range_noise" not in written
