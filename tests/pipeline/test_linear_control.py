"""Control that is scaled, turned, tilted or shifted: files in, warnings and a path out."""

import shutil
import warnings

import numpy as np
import pytest

import mlscorr
from mlscorr.simulate import Scenario, simulate

pytestmark = pytest.mark.long  # whole surveys of 600 m
TURN = np.radians(0.03)
MOVES = {  # term: matrix about the middle, shift (m), size, and how well it must be known
    "scale": (np.diag([4e-4, 4e-4, 0.0]), [0.0] * 3, [4e-4], 1e-4),
    "turn": (TURN * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]]), [0.0] * 3, [TURN], 1.5e-4),
    "height": (np.zeros((3, 3)), [0.0, 0.0, 0.3], [0.3], 0.05),
    "shift": (np.zeros((3, 3)), [0.5, -0.3, 0.0], [0.5, -0.3], 0.05),
}


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    "A drive of 50 s at 12 m/s past 16 control points and 4 check points"
    folder = tmp_path_factory.mktemp("drive") / "survey"
    scenario = Scenario(
        drive={"duration": 50.0, "speed": 12.0},
        targets={"control": 16, "check": 4},
        scanner=[{"lines_per_second": 100, "points_per_line": 300}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)
    return folder


def moved(drive, folder, matrix, shift=(0.0, 0.0, 0.0), key=""):
    "A copy with surveyed points moved about the middle of the control, and a key of [control]"
    shutil.copytree(drive, folder)
    header, *rows = (folder / "control.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    place = np.array([row[1:4] for row in cells], dtype=float)
    middle = place[[row[-1] == "control" for row in cells]].mean(axis=0)
    place = place + (place - middle) @ np.asarray(matrix).T + shift
    for row, new in zip(cells, place, strict=True):
        row[1:4] = [f"{value:.4f}" for value in new]
    (folder / "control.csv").write_text("\n".join([header, *map(",".join, cells)]) + "\n")
    text = (folder / "survey.toml").read_text()
    text = text.replace('file = "control.csv"', f'file = "control.csv"\n{key}')
    (folder / "survey.toml").write_text(text)
    return folder


def corrected(folder):
    with warnings.catch_warnings(action="ignore"):
        return mlscorr.correct(mlscorr.read_survey(folder))


@pytest.mark.parametrize("term", MOVES)
def test_check_and_correct_find_the_same_term(term, drive, tmp_path):
    "Scaled by UTM's 400 ppm, turned by 0.03 deg, shifted by decimetres: the term and its size"
    matrix, shift, size, tolerance = MOVES[term]
    folder = moved(drive, tmp_path / "survey", matrix, shift)
    (checked,) = mlscorr.check(folder).datum
    result = corrected(folder)
    (found,) = result.datum
    assert (checked.term, found.term) == (term, term)
    assert found.size == pytest.approx(size, abs=tolerance)
    assert checked.size == pytest.approx(size, abs=2 * tolerance)


def test_check_and_correct_find_a_tilt(drive, tmp_path):
    "Rising by 0.4 mm/m along the drive: to 0.15 mm/m in that direction"
    position = mlscorr.read_survey(drive).trajectory.position
    ahead = position[-1, :2] - position[0, :2]
    ahead /= np.linalg.norm(ahead)
    matrix = np.zeros((3, 3))
    matrix[2, :2] = 4e-4 * ahead
    folder = moved(drive, tmp_path / "survey", matrix)
    (checked,) = mlscorr.check(folder).datum
    (found,) = corrected(folder).datum
    assert (checked.term, found.term) == ("tilt", "tilt")
    assert found.size @ ahead == pytest.approx(4e-4, abs=1.5e-4)


def test_a_declared_factor_restores_the_path(drive, tmp_path):
    """Ground distances bend the corrected path by 5 cm or more at its ends; scale_factor silences
    the warning and brings it back to 5 mm
    """
    good = corrected(moved(drive, tmp_path / "good", np.zeros((3, 3))))
    assert good.datum == ()
    stretched = np.diag([1 / 0.9996 - 1, 1 / 0.9996 - 1, 0.0])
    bent = corrected(moved(drive, tmp_path / "bent", stretched))
    key = "scale_factor = 0.9996"
    folder = moved(drive, tmp_path / "restored", stretched, key=key)
    assert mlscorr.check(folder).datum == ()
    restored = corrected(folder)
    assert restored.datum == ()

    def largest(result):
        change = result.trajectory.position - good.trajectory.position
        return np.linalg.norm(change, axis=1).max()

    assert largest(bent) > 0.05
    assert largest(restored) < 0.005


def test_ground_distances_declared_take_the_factor_of_the_map(drive, tmp_path):
    "Control multiplied by the inverse of the map's own factor: no warning, and the path to 5 mm"
    good = corrected(moved(drive, tmp_path / "good", np.zeros((3, 3))))
    factor = 0.9996 * (1 + (32000.0 / 6371000.0) ** 2 / 2)
    ground = np.diag([1 / factor - 1, 1 / factor - 1, 0.0])
    restored = corrected(moved(drive, tmp_path / "ground", ground, key='scale_factor = "ground"'))
    assert restored.datum == ()
    change = restored.trajectory.position - good.trajectory.position
    assert np.linalg.norm(change, axis=1).max() < 0.005
