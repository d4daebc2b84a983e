"""Effects of a chosen size in the geometry of a survey."""

import gap_study
import numpy as np
import pytest

from mlscorr.effects import EFFECTS
from mlscorr.effects.catalogue import RANDOM, SYSTEMATIC
from mlscorr.gap.plan import Ruler
from mlscorr.gap.plan.draws import draw_effect, likeness, shift_by
from mlscorr.gap.signatures import Bench, signatures

KINDS = {kind.name: kind for kind in EFFECTS}
MDB = 3.0


@pytest.fixture(scope="module")
def ruler():
    "Two passes at UTM and GPS size, 24 targets, 80 patches on a reference, drift and no effect"
    g = gap_study.geometry(3, targets=24, patches=80)
    residual = gap_study.errors(g, np.random.default_rng(1))
    return Ruler.of(gap_study.replace(g.rows, residual=residual), g.survey)


@pytest.mark.parametrize("name", SYSTEMATIC)
def test_an_effect_has_the_size_that_is_asked_for(ruler, name):
    "At 3 MDB what the effect's own function makes of the rows is 3 MDB within 10 %"
    one = draw_effect(ruler, KINDS[name], MDB, np.random.default_rng(2))
    shift = Bench(ruler.rows, ruler.survey).change(one.effect).shift
    assert one.mdb == pytest.approx(MDB)
    assert ruler.size(shift) == pytest.approx(MDB, rel=0.1)
    assert ruler.size(one.shift) == pytest.approx(MDB)


@pytest.mark.parametrize("name", SYSTEMATIC)
def test_the_parameters_are_those_of_the_effect(ruler, name):
    "The normal matrix of the magnitudes gives the size again"
    one = draw_effect(ruler, KINDS[name], MDB, np.random.default_rng(2))
    way = [value for key, value in one.parameters.items() if key not in ("time", "width")]
    assert np.sqrt(way @ one.normal @ way) / 4.13 == pytest.approx(MDB, rel=1e-6)
    size = np.linalg.norm(one.effect.magnitude)
    assert np.linalg.norm(way) == pytest.approx(size, rel=1e-6)


@pytest.mark.parametrize("name", RANDOM)
def test_random_effects_grow_with_their_size(ruler, name):
    "Twice the minimal detectable bias is more noise: some of it, in no survey ten times as much"
    draws = [draw_effect(ruler, KINDS[name], mdb, np.random.default_rng(2)) for mdb in (1.0, 2.0)]
    once, twice = (draw.effect.magnitude for draw in draws)
    assert 1.2 * once < twice < 10 * once


def test_noise_that_no_row_shows_is_not_drawn(ruler):
    "Lost returns where no return rate is known"
    rows = ruler.rows.select(np.flatnonzero(ruler.rows.channel != "return_rate"))
    silent = Ruler.of(rows, ruler.survey)
    assert draw_effect(silent, KINDS["dropout"], 3.0, np.random.default_rng(2)) is None


def test_an_effect_stays_credible(ruler):
    "A million MDB of a range bias are capped at a metre, and the size that is left is told"
    one = draw_effect(ruler, KINDS["range_bias"], 1e6, np.random.default_rng(2))
    assert abs(one.effect.magnitude) == pytest.approx(1.0, rel=0.01)
    assert ruler.size(one.shift) == pytest.approx(one.mdb, rel=1e-6)


def test_what_is_unlike_all_effects_is_told_from_what_is_one(ruler):
    "A lift of all points is a lever arm upwards; one that alternates with the pass is not"
    known = signatures(ruler.rows, ruler.survey)[0]

    def lift(seen):
        return np.tile([0.0, 0.0, 0.02], (len(seen.xyz), 1))

    def by_pass(seen):
        return lift(seen) * np.where(seen.trajectory.segment(seen.gps_time) == 0, 1, -1)[:, None]

    one = likeness(ruler, shift_by(ruler, lift), known)
    other = likeness(ruler, shift_by(ruler, by_pass), known)
    assert one["lever_arm"] == pytest.approx(1.0, abs=0.02)
    assert other["lever_arm"] < 0.3
    assert likeness(ruler, np.zeros(len(ruler.rows)), known) == {}
