"""The simulator run again: noise without effects, with them what their signatures say."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.closure import BeamSimulator
from mlscorr.gap.closure.rerun import rerun
from mlscorr.gap.signatures import Bench
from tests.beds.gap_surveys import beams_of, read_once, rows_of

pytestmark = pytest.mark.long

SMALL = {  # effects of the size of what one looks for
    "time_offset": {"magnitude": 1e-3},
    "range_scale": {"magnitude": 5e-4},
    "range_walk": {"magnitude": 0.005},
    "angle_scale": {"magnitude": 5e-4},
    "boresight": {"magnitude": [0.03, -0.05, 0.04]},
    "lever_arm": {"magnitude": [0.02, -0.03, 0.01]},
    "heading_drift": {"magnitude": 0.05},
    "position_bump": {"magnitude": [0.05, -0.03, 0.02], "time": 3.0, "width": 2.0},
    "map_rotation": {"magnitude": 1e-3},
    "target_outlier": {"magnitude": [0.05, 0.02, -0.01], "target": "T02"},
}

NOISE = {
    "range_noise": {"magnitude": 0.006},
    "angle_noise": {"magnitude": 0.03},
    "time_jitter": {"magnitude": 0.003},
}


def effect_of(name, sizes):
    return make_effect(name, **sizes[name])


def run(case, *effects, rows=None):
    survey, _, all_rows, beams = case
    rows = all_rows if rows is None else rows
    return rerun(rows, survey, beams, effects, np.random.default_rng(9))


@pytest.fixture(scope="module")
def without(case):
    return run(case)


@pytest.mark.parametrize(
    "channel, limit", [("target", 2.0), ("surface", 1.0), ("shared", 1.0), ("roughness", 1.3)]
)
def test_without_effects_nothing_is_left_but_noise(case, without, channel, limit):
    "Residuals are zero within the noise that the rows state, in the mean and each"
    rows = case[2]
    on = rows.channel == channel
    left = without[on] / np.sqrt(rows.noise[on])
    assert np.isfinite(left).mean() > 0.99
    left = left[np.isfinite(left)]
    assert abs(left.mean()) < 4 * limit / np.sqrt(len(left))
    assert 1.4826 * np.median(np.abs(left)) < limit
    assert np.abs(left).max() < 7.0
    if rows.metric[on].all():
        sure = on & (rows.noise < 2.5e-3**2)
        assert np.sqrt(np.nanmean(without[sure] ** 2)) < 2e-3 < np.std(rows.residual[on])


def test_without_loss_all_pulses_return(case, without):
    "The share that returns is one in a simulator without dropout"
    rate = case[2].channel == "return_rate"
    assert rate.sum() > 50 and not without[rate].any()


@pytest.mark.parametrize("name", SMALL)
def test_small_effects_shift_rows_as_their_signatures_say(case, without, name):
    "With and without an effect, residuals differ by its change: planes to 0.5 mm, targets to 2 mm"
    survey, _, rows, _ = case
    effect = effect_of(name, SMALL)
    shift = Bench(rows, survey).change(effect).shift
    left = run(case, effect) - without - shift
    sure = np.isfinite(left) & (rows.noise < 1.5e-3**2)  # targets scanned in few lines are not
    assert np.abs(shift).max() > 1e-3
    for channel, mean, rms in (
        ("target", 1e-3, 2e-3),
        ("surface", 2e-4, 5e-4),
        ("shared", 2e-4, 5e-4),
    ):
        of = left[(rows.channel == channel) & (sure | (rows.channel != "target"))]
        of = of[np.isfinite(of)]
        assert len(of) > 10
        assert abs(of.mean()) < mean
        assert np.sqrt(np.mean(of**2)) < rms


@pytest.mark.parametrize("name", NOISE)
def test_noise_makes_patches_rougher_as_its_signature_says(case, without, name):
    "The log variance grows by the signature's growth, within a tenth; means stay where they are"
    survey, _, rows, _ = case
    effect = effect_of(name, NOISE)
    rough = rows.channel == "roughness"
    growth = np.log1p(Bench(rows, survey).change(effect, None).growth[rough]).mean()
    changed = run(case, effect)
    assert growth > 0.1
    assert (changed - without)[rough].mean() == pytest.approx(growth, rel=0.1, abs=0.02)
    surface = (changed - without)[rows.channel == "surface"]
    assert abs(np.nanmean(surface)) < 3e-4


def test_lost_returns_lower_the_share(case, without):
    "One return in ten lost lowers the shares by a tenth, and moves nothing"
    rows = case[2]
    changed = run(case, make_effect("dropout", magnitude=0.1)) - without
    assert changed[rows.channel == "return_rate"].mean() == pytest.approx(-0.1, abs=0.01)
    assert np.sqrt(np.nanmean(changed[rows.metric] ** 2)) < 1.5e-3


def test_the_same_seed_gives_the_same_but_for_what_the_effect_does(case, without):
    "A datum leaves all but the targets as they were, bit for bit; so does another run"
    rows = case[2]
    np.testing.assert_array_equal(run(case), without)
    changed = run(case, make_effect("vertical_datum", magnitude=0.1))
    others = rows.channel != "target"
    np.testing.assert_array_equal(changed[others], without[others])


def test_large_effects_are_not_linear(case, without):
    "A step of 3 m leaves patches that meet nothing alike; a turn of 2 deg is no longer its sine"
    survey, _, rows, _ = case
    step = run(case, make_effect("position_step", magnitude=[2.0, 2.0, 1.0], time=1.0))
    lost = np.isnan(step) & (rows.channel == "surface")
    assert lost.sum() > 20
    turn = make_effect("boresight", magnitude=[2.0, 0.0, 0.0])
    changed = run(case, turn) - without
    linear = Bench(rows, survey).change(turn).shift
    shared = rows.channel == "shared"
    assert np.nanmax(np.abs(changed - linear)[shared]) > 5e-3


def test_some_rows_give_what_all_give(case, without):
    "The rows of one block of time, simulated alone, have the residuals that they have among all"
    rows = case[2]
    some = rows.gps_time < np.median(rows.gps_time)
    np.testing.assert_array_equal(run(case, rows=rows.select(some)), without[some])
    assert len(run(case, rows=rows.select(np.zeros(len(rows), dtype=bool)))) == 0


def test_rows_of_other_beams_are_refused(case):
    "Items with other times: one sentence says what to do"
    rows = case[2]
    with pytest.raises(ValueError, match=r"residuals have other times .* Collect the beams again"):
        run(case, rows=replace(rows, gps_time=rows.gps_time + 1.0))


def test_without_a_mounting_the_pose_can_still_be_wrong(case):
    "Clock and POS effects are simulated from the navigation centre; those of beams are refused"
    blind = replace(case[0], mounting=None, reference=None)
    read = replace(read_once(blind), finding=case[1].finding)
    pairing = rows_of(blind, read, 60)
    rows = pairing.rows.select(pairing.rows.metric)
    blind_case = blind, read, rows, beams_of(blind, rows, read)
    effect = make_effect("time_offset", magnitude=2e-3)
    left = run(blind_case, effect) - run(blind_case) - Bench(rows, blind).change(effect).shift
    for channel, rms in (("target", 2.5e-3), ("shared", 5e-4)):
        assert np.sqrt(np.nanmean(left[rows.channel == channel] ** 2)) < rms
    with pytest.raises(ValueError, match=r"range_bias acts on the range, .* no \[mounting\]"):
        run(blind_case, make_effect("range_bias", magnitude=0.01))


def test_noise_that_is_there_already_can_be_found_again(case):
    "The simulator has a range noise of 3 mm, and 4 mm more are found: as one of 5 mm"
    survey, _, rows, beams = case
    known, found, both = (make_effect("range_noise", magnitude=m) for m in (0.003, 0.004, 0.005))
    again = BeamSimulator(rows, survey, beams, (known,), 3).added([found])
    plain = BeamSimulator(rows, survey, beams, (), 3)
    rough = rows.channel == "roughness"
    expected = plain.added([both]) - plain.added([known])
    assert again[rough] == pytest.approx(expected[rough], abs=1e-9)
