"""A survey whose trajectory is in several files: files in, the same correction out."""

import json
import shutil
import warnings

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.simulate import Scenario, simulate

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    "Folder of a street that is driven there and back, with one trajectory of two passes"
    scenario = Scenario(
        drive={"duration": 6.0, "passes": [{}, {"direction": "back", "pause": 20.0}]},
        targets={"control": 4, "check": 1, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 300}],
    )
    folder = tmp_path_factory.mktemp("street")
    simulate(scenario, np.random.default_rng(4)).write(folder)
    return folder


def cut(street, folder, rows):
    "The street with the rows of its trajectory in files of their own, the last one first"
    shutil.copytree(street, folder)
    header, *epochs = (folder / "trajectory.csv").read_text().splitlines()
    (folder / "trajectory.csv").unlink()
    entries = ""
    for number, part in enumerate(rows, start=1):
        (folder / f"run-{number}.csv").write_text("\n".join([header, *epochs[part], ""]))
        entries = f'[[trajectory]]\nfile = "run-{number}.csv"\n\n{entries}'
    text = (folder / "survey.toml").read_text()
    start = text.index("[trajectory]")
    end = text.index("[", text.index("[trajectory]") + 1)
    (folder / "survey.toml").write_text(text[:start] + entries + text[end:])
    return folder


def corrected(folder):
    "Results of correct without a page, as the command writes them"
    out = folder.parent / f"{folder.name} corrected"
    with warnings.catch_warnings(action="ignore"):  # so few points tell little
        mlscorr.correct(mlscorr.read_survey(folder)).write(out, page=False)
    return out


def test_a_cut_trajectory_gives_the_same_correction(street, tmp_path):
    "Two runs, or three with an overlap: clouds and trajectory to the bit, passes counted over all"
    whole = corrected(shutil.copytree(street, tmp_path / "whole"))
    gap = int(np.argmax(np.diff(mlscorr.read_survey(street).trajectory.gps_time))) + 1
    runs = [slice(0, gap), slice(gap, None)]
    lapped = [slice(0, 400), slice(300, gap), slice(gap, None)]
    for name, rows in (("two", runs), ("three", lapped)):
        out = corrected(cut(street, tmp_path / name, rows))
        for cloud in sorted(path.name for path in whole.glob("*.laz")):
            apart = laspy.read(out / cloud).xyz - laspy.read(whole / cloud).xyz
            assert np.abs(apart).max() < 1e-6  # m
        assert (out / "trajectory.csv").read_text() == (whole / "trajectory.csv").read_text()
        report = json.loads((out / "report.json").read_text())
        before = json.loads((whole / "report.json").read_text())
        assert report["targets"] == before["targets"]
        read = [row["name"] for row in report["inputs"] if row["what"] == "trajectory"]
        assert read == [f"run-{n}.csv" for n in range(len(rows), 0, -1)]
        assert any(f"joined of {len(rows)} files" in note for note in report["notes"])


def test_runs_without_a_pause_are_passes_of_their_own(street, tmp_path):
    "Cut within a pass, the corrected trajectory keeps the joint, and is read with as many passes"
    gap = int(np.argmax(np.diff(mlscorr.read_survey(street).trajectory.gps_time))) + 1
    folder = cut(street, tmp_path / "cut", [slice(0, gap // 2), slice(gap // 2, None)])
    assert len(mlscorr.read_survey(folder).trajectory.passes) == 3
    out = corrected(folder)
    again = mlscorr.io.trajectories.trajectory.read_trajectory(out / "trajectory.csv")
    assert len(again.passes) == 3
    passes = {row["pass"] for row in json.loads((out / "report.json").read_text())["targets"]}
    assert max(passes) == 3
