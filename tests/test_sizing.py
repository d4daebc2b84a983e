"""Effects of a chosen size in the geometry of a survey."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from mlscorr.effects import EFFECTS
from mlscorr.gap.changes import Bench
from mlscorr.gap.mix import RANDOM, SYSTEMATIC
from mlscorr.gap.signatures import signatures
from mlscorr.gap.sizing import Scale, likeness, shift_by, sized

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
KINDS = {kind.name: kind for kind in EFFECTS}
MDB = 3.0


@pytest.fixture(scope="module")
def scale():
    "Two passes at UTM and GPS size, 24 targets, 80 patches on a reference, drift and no effect"
    sys.path.insert(0, str(BENCHMARKS))
    study = importlib.import_module("gap_study")
    sys.path.remove(str(BENCHMARKS))
    g = study.geometry(3, targets=24, patches=80)
    residual = study.errors(g, np.random.default_rng(1))
    return Scale.of(study.replace(g.rows, residual=residual), g.survey)


@pytest.mark.parametrize("name", SYSTEMATIC)
def test_an_effect_has_the_size_that_is_asked_for(scale, name):
    "At 3 MDB what the effect's own function makes of the rows is 3 MDB within 10 %"
    one = sized(scale, KINDS[name], MDB, np.random.default_rng(2))
    shift = Bench(scale.rows, scale.survey).change(one.effect).shift
    assert one.mdb == pytest.approx(MDB)
    assert scale.size(shift) == pytest.approx(MDB, rel=0.1)
    assert scale.size(one.shift) == pytest.approx(MDB)


@pytest.mark.parametrize("name", SYSTEMATIC)
def test_the_parameters_are_those_of_the_effect(scale, name):
    "The normal matrix of the magnitudes gives the size again"
    one = sized(scale, KINDS[name], MDB, np.random.default_rng(2))
    way = [value for key, value in one.parameters.items() if key not in ("time", "width")]
    assert np.sqrt(way @ one.normal @ way) / 4.13 == pytest.approx(MDB, rel=1e-6)
    size = np.linalg.norm(one.effect.magnitude)
    assert np.linalg.norm(way) == pytest.approx(size, rel=1e-6)


@pytest.mark.parametrize("name", [name for name in RANDOM if name != "dropout"])
def test_random_effects_grow_with_their_size(scale, name):
    "Four times the minimal detectable bias is twice the magnitude, as variances count"
    one, four = (sized(scale, KINDS[name], m, np.random.default_rng(2)) for m in (2.0, 8.0))
    assert four.effect.magnitude == pytest.approx(2 * one.effect.magnitude, rel=1e-6)
    assert sized(scale, KINDS["dropout"], 3.0, np.random.default_rng(2)) is None  # no such rows


def test_an_effect_stays_credible(scale):
    "A million MDB of a range bias are capped at a metre, and the size that is left is told"
    one = sized(scale, KINDS["range_bias"], 1e6, np.random.default_rng(2))
    assert abs(one.effect.magnitude) == pytest.approx(1.0, rel=0.01)
    assert scale.size(one.shift) == pytest.approx(one.mdb, rel=1e-6)


def test_what_is_unlike_all_effects_is_told_from_what_is_one(scale):
    "A lift of all points is a lever arm upwards; one that alternates with the pass is not"
    known = signatures(scale.rows, scale.survey)[0]

    def lift(seen):
        return np.tile([0.0, 0.0, 0.02], (len(seen.xyz), 1))

    def by_pass(seen):
        return lift(seen) * np.where(seen.trajectory.segment(seen.gps_time) == 0, 1, -1)[:, None]

    one = likeness(scale, shift_by(scale, lift), known)
    other = likeness(scale, shift_by(scale, by_pass), known)
    assert one["lever_arm"] == pytest.approx(1.0, abs=0.02)
    assert other["lever_arm"] < 0.3
    assert likeness(scale, np.zeros(len(scale.rows)), known) == {}
