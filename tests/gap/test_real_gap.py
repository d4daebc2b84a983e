"""Claims of the studies on real data: a POS that loses GNSS, two passes with misclosures."""

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from mlscorr.survey import Pos
from tests.beds.places import BENCHMARKS
from tests.beds.shared import shared

pytestmark = pytest.mark.long

REAL = BENCHMARKS / "real"
BELIEVED = Pos(0.023, np.radians([0.0145, 0.0145, 0.065]))  # as the simulated unit states it
REPLICAS = 20


@pytest.fixture(scope="module")
def real():
    "Import a module of benchmarks/real by its name; none of them stays imported"
    before = set(sys.modules)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(REAL)
        yield import_module
    for name in set(sys.modules) - before:
        if Path(getattr(sys.modules[name], "__file__", None) or "/").parent == REAL:
            del sys.modules[name]


@pytest.fixture(scope="module")
def drive(real):
    "The module of the real drive, and that drive"
    shared("data", "real_pos_error")
    module = real("pos_drive")
    return module, module.real_drive(np.random.default_rng(1))


def test_the_real_pos_is_worse_in_its_outages(real, drive):
    "Two real outages: position_noise is named, in windows that are them; without, none is likely"
    pos_drive, one = drive
    pos_measure = real("pos_measure")
    rng = np.random.default_rng(1)
    cycles, quiet = pos_drive.spans(one, 2)

    def told(span):
        rows, survey = pos_drive.window_rows(one, span, one.recorded, BELIEVED, rng)
        answer = pos_measure.diagnosed(rows, survey, rng, REPLICAS)
        return pos_measure.verdict_of(one, span, answer)

    both = told((cycles[0][0], cycles[1][1]))
    assert "position_noise" in both["verdict"].split("+")
    assert both["p_value"] < 1e-6
    assert both["outage_found"] > 0.6
    assert both["found_in_outage"] > 0.6
    assert told(quiet[0])["p_value"] > 0.01


def test_outage_drift_in_the_simulator_shrinks_the_real_gap(real, drive):
    "The gap lies in outages; drift in the simulator takes most of it on outages not chosen on"
    pos_drive, one = drive
    pos_measure = real("pos_measure")
    rng = np.random.default_rng(2)
    choice = [pos_drive.BELIEF, {**pos_drive.BELIEF, "odometer": False}]
    models = pos_drive.outage_models(one, 2, choice, draws=1)
    cycles, _ = pos_drive.spans(one, 8)
    rows = {s: pos_drive.window_rows(one, s, one.recorded, BELIEVED, rng) for s in cycles}
    several = pos_measure.measure(cycles, rows, one, models, rng, REPLICAS)
    share = [m["plain"][m["lost"]].sum() / m["plain"].sum() for m in several]
    assert np.median(share) > 0.9  # of the squared misfit beyond belief
    assert max(np.mean(m["lost"]) for m in several) < 0.5
    shrink = [pos_measure.shrunk(m["before"].mean(), m["after"].mean()) for m in several]
    assert np.median(shrink) > 0.5
    assert np.mean(np.array(shrink) > 0) >= 0.75


DENSE = {"Car": (0.941, 1.181, 2.497), "Tent": (0.743, -0.143, 0.372)}  # deg, by all points


@pytest.fixture(scope="module", params=DENSE)
def real_passes(real, request):
    "The name of two real passes, and what the example finds of them"
    shared("data", "routescene_uav")
    two_pass_gap = real("two_pass_gap")
    scene = two_pass_gap.scene(request.param)
    assert np.percentile(scene.away, 95) < 0.004  # m, of the file's points, put there by their pose
    rng = np.random.default_rng(1)
    return request.param, two_pass_gap.study(scene, rng, folds=2, chance=REPLICAS)[0]


def misfits(result):
    "Median misfit of planes held out (mm) with the recorded and the calibrated boresight"
    return (np.median(np.abs(result[key])) for key in ("before", "after"))


def test_boresight_closes_the_misfit_of_real_passes(real_passes):
    "A tenth is left of planes held out"
    before, after = misfits(real_passes[1])
    assert after < before / 10


def test_boresight_of_real_passes_is_that_of_all_points(real_passes, request):
    "As a fit of all points gives it, within 2 sigma"
    name, result = real_passes
    if name == "Car":
        missed = "one of three angles is 2.05 sigma off, with planes joined across faces of cells"
        request.applymarker(pytest.mark.xfail(reason=missed, strict=True))
    away = np.abs(np.subtract(result["boresight"], DENSE[name])) / result["sigma"]
    assert (away < 2.0).all()


def test_nothing_but_boresight_parts_real_passes(real_passes, request):
    "They lie 8 cm apart before, and no cause is left after"
    name, result = real_passes
    if name == "Tent":
        missed = (
            "6 cm apart, then position_noise at p = 0.19, on 18 planes of cells off whole metres"
        )
        request.applymarker(pytest.mark.xfail(reason=missed, strict=True))
    before, _ = misfits(result)
    assert before > 80.0  # mm
    assert result["left"]["verdict"] == "none"


@pytest.mark.parametrize("script", ["pos_gap.py", "two_pass_gap.py"])
def test_an_example_without_its_data_says_where_it_was_looked_for(script, tmp_path):
    "One sentence with the folder and the way out, nothing else, and nothing is written"
    run = subprocess.run(
        [sys.executable, REAL / script],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "MLSCORR_SHARED": str(tmp_path / "shared")},
    )
    assert run.returncode == 0
    assert not run.stderr
    assert len(run.stdout.splitlines()) == 1
    assert str(tmp_path / "shared" / "data") in run.stdout
    assert "MLSCORR_SHARED" in run.stdout
    assert not list(tmp_path.iterdir())
