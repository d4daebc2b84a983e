"""Signatures say how the rows change: as the full simulator changes them, effect by effect."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from mlscorr.effects import EFFECTS, Effect, effect_class, make_effect, quantity
from mlscorr.gap.residuals import Rows, find_patches
from mlscorr.gap.residuals.pairing import patch_rows
from mlscorr.gap.signatures import Bench, select, signature, signatures
from tests.beds.short_drive import EXACT, NOISE, in_simulation, run


@pytest.mark.parametrize("name", EXACT)
def test_effects_do_to_targets_what_the_full_simulator_does(clean, name):
    "A signature times the magnitude is the mean shift of the targets' points, within 3 %"
    survey, rows, _, _ = clean
    effect = make_effect(name, **EXACT[name])
    fixed = {k: v for k, v in EXACT[name].items() if k not in ("magnitude", "phase")}
    found = signature(Bench(rows, survey), type(effect), fixed, np.random.default_rng(0))
    size = np.atleast_1d(effect.magnitude)
    if name == "angle_eccentricity":
        size = effect.magnitude * np.array([np.cos(effect.phase), np.sin(effect.phase)])
    truth = in_simulation(clean, name)
    assert np.abs(truth).max() > 1e-5
    np.testing.assert_allclose(found.jacobian @ size, truth, atol=0.03 * np.abs(truth).max())
    again = found.effect(size)
    np.testing.assert_allclose(np.atleast_1d(again.magnitude), np.atleast_1d(effect.magnitude))


def test_an_event_of_which_no_row_sees_half_has_no_signature(clean):
    "Seen 1.1 of its widths from its middle it has one, in those rows alone; 1.3 of them away none"
    survey, rows, _, _ = clean
    kind = effect_class("position_bump")
    rng = np.random.default_rng(0)
    bench = Bench(rows, survey)
    last = rows.gps_time.max() - rows.reference.start
    near, far = (signature(bench, kind, {"time": last + x, "width": 1.0}, rng) for x in (1.1, 1.3))
    assert near.jacobian.max() == pytest.approx(np.exp(-0.5 * 1.1**2), rel=0.05)
    assert not far.jacobian.any()
    others = rows.gps_time < rows.gps_time.max() - 0.5
    assert select([near], rows, ~others) and not select([near], rows, others)


@pytest.mark.long
def test_noise_shows_in_the_roughness_as_it_grows(clean, patches):
    "Roughness rows of a noisier scanner have the mean log(1 + growth x^2), within 0.03"
    survey = clean[0]
    for name in ("range_noise", "angle_noise", "time_jitter"):
        _, cloud, _ = run(name)
        size = NOISE[name]["magnitude"]
        noisy = patch_rows(survey, find_patches(survey, chunks=lambda file, c=cloud: [c]))
        kind = type(make_effect(name, magnitude=size))
        found = signature(Bench(patches, survey), kind, {}, np.random.default_rng(0))
        rough = patches.channel == "roughness"
        told = np.median(noisy.residual[noisy.channel == "roughness"])
        wanted = np.median(patches.residual[rough] + np.log1p(found.growth[rough] * size**2))
        assert told == pytest.approx(wanted, abs=0.06), name
        assert found.is_noise and not found.is_common
        assert not found.jacobian.any()


def test_loss_shows_in_the_return_rate(clean, patches):
    "One return in ten lost lowers the share by a tenth, in signature and in simulation"
    survey = clean[0]
    _, cloud, _ = run("dropout")
    lossy = patch_rows(survey, find_patches(survey, chunks=lambda file: [cloud]))
    kind = type(make_effect("dropout", magnitude=0.1))
    found = signature(Bench(patches, survey), kind, {}, np.random.default_rng(0))
    rate = patches.channel == "return_rate"
    assert found.jacobian[rate, 0].mean() == pytest.approx(-1.0, abs=0.01)
    told = lossy.residual[lossy.channel == "return_rate"].mean()
    assert told - patches.residual[rate].mean() == pytest.approx(-0.1, abs=0.01)


def test_position_noise_is_common_to_rows_of_a_moment(clean):
    "Noise of the POS has its variance in each axis, and says that rows share it"
    survey, rows, _, _ = clean
    kind = type(make_effect("position_noise", magnitude=0.02))
    found = signature(Bench(rows, survey), kind, {}, np.random.default_rng(0))
    assert found.is_common
    assert found.variance.mean() == pytest.approx(1.0, abs=0.1)


def test_every_effect_has_a_signature_or_a_reason(clean, patches):
    "All of the library is differentiated on targets and patches, but for the width of the beam"
    survey, rows, _, _ = clean
    found, left_out = signatures(Rows.concatenate([rows, patches]), survey)
    assert {one.name for one in found} == {kind.name for kind in EFFECTS} - {"beam_divergence"}
    assert set(left_out) == {"beam_divergence"}
    for one in found:
        assert one.jacobian.shape == (len(rows) + len(patches), len(one.parameters))
        assert np.isfinite(one.jacobian).all() and np.isfinite(one.variance).all()
    outliers = [one for one in found if one.name == "target_outlier"]
    assert len(outliers) == len(np.unique(rows.survey_item))


def test_noise_that_nobody_stated_is_not_larger_than_stated(clean, patches):
    "Without range_noise in survey.toml it is left out, with the reason; angle_noise is judged"
    survey, rows, *_ = clean
    rows = Rows.concatenate([rows, patches])
    bare = replace(survey, scanner=replace(survey.scanner, assumed=("range_noise",)))
    kinds = [effect_class(name) for name in ("range_noise", "angle_noise")]
    found, left_out = signatures(rows, bare, kinds)
    assert [sign.name for sign in found] == ["angle_noise"]
    assert left_out["range_noise"].key == "unstated size"


def test_without_a_mounting_the_beams_are_not_known(clean):
    "Clock, POS and control effects stay; those of range, angle and mounting are left out, named"
    survey, rows, _, _ = clean
    blind = replace(survey, mounting=None)
    bare = replace(rows, pulses=replace(rows.pulses, scanner_xyz=rows.pulses.xyz * np.nan))
    found, left_out = signatures(bare, blind)
    with_mounting = {(one.name, str(one.fixed)): one for one in signatures(rows, survey)[0]}
    assert {"lever_arm", "range_bias", "angle_scale"} <= set(left_out)
    assert left_out["boresight"].key == "no mounting"
    names = {one.name for one in found}
    assert {"time_offset", "clock_drift", "heading_drift", "vertical_datum"} <= names
    for one in found:
        if one.name in ("time_offset", "heading_drift"):
            same = with_mounting[one.name, str(one.fixed)]
            np.testing.assert_allclose(one.jacobian, same.jacobian, atol=1e-6)


@dataclass(frozen=True)
class Lift(Effect):
    "A test's own effect: the body rises with the square of the speed"

    name: ClassVar = "lift"
    stage: ClassVar = "pos"
    magnitude: float = quantity("m per (m/s)^2", 0.01, "no car flies", typical=1e-4)

    def _error(self, value, reference, rng):
        speed = np.linalg.norm(np.gradient(value.position, value.gps_time, axis=0), axis=1)
        return self.magnitude * speed[:, None] ** 2 * np.array([0.0, 0.0, 1.0])


def test_effects_outside_the_library_are_differentiated_alike(clean):
    "Any effect class will do: a lift with speed squared raises each target by that"
    survey, rows, _, _ = clean
    (found,), left_out = signatures(rows, survey, [Lift])
    assert not left_out
    up = rows.covariates["axis"] == 2
    speed = rows.covariates["speed"][up]
    np.testing.assert_allclose(found.jacobian[up, 0], speed**2, rtol=0.03)
    np.testing.assert_allclose(found.jacobian[~up, 0], 0.0, atol=1e-9)
