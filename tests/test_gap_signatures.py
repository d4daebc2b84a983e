"""Signatures say how the rows change: as the full simulator changes them, effect by effect."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from mlscorr.effects import EFFECTS, Effect, make_effect
from mlscorr.effects.effect import quantity
from mlscorr.gap.changes import Bench, expected
from mlscorr.gap.pairing import patch_rows, target_rows
from mlscorr.gap.patches import find_patches
from mlscorr.gap.rows import Rows
from mlscorr.gap.signatures import signature, signatures
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import CloudFile, PointCloud, Scanner, Survey, TargetObservations
from mlscorr.targets.candidates import NO_POINTS, Candidates

SEED = 5
EXACT = {  # with which the simulator is run; sizes are usual ones
    "time_offset": {"magnitude": 1e-3},
    "clock_drift": {"magnitude": 2e-5},
    "range_bias": {"magnitude": 0.01},
    "range_walk": {"magnitude": 0.005},
    "incidence_bias": {"magnitude": 0.003},
    "angle_scale": {"magnitude": 1e-4},
    "angle_eccentricity": {"magnitude": 1e-4, "phase": 0.7},
    "boresight": {"magnitude": [0.03, -0.05, 0.04]},
    "lever_arm": {"magnitude": [0.02, -0.03, 0.01]},
    "heading_drift": {"magnitude": 0.03},
    "position_step": {"magnitude": [0.1, -0.05, 0.03], "time": 2.0},
    "position_bump": {"magnitude": [0.1, -0.05, 0.03], "time": 25.0, "width": 2.0},
    "map_rotation": {"magnitude": 1e-4},
    "map_scale": {"magnitude": 4e-4},
    "target_outlier": {"magnitude": [0.05, 0.02, -0.01], "target": "T02"},
}
NOISE = {
    "range_noise": {"magnitude": 0.006},
    "angle_noise": {"magnitude": 0.03},
    "time_jitter": {"magnitude": 0.002},
    "dropout": {"magnitude": 0.1},
}
SIZES = {**EXACT, **NOISE}


def scenario(effects=()):
    "Two passes of five seconds, there and back, past four targets"
    return Scenario(
        drive={
            "duration": 5.0,
            "speed": 6.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 3, "check": 1, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        effects=effects,
    )


@cache
def run(name=None):
    "A simulated survey with one effect, all its points, and the target that each lies on"
    effects = () if name is None else ({"name": name, **SIZES[name]},)
    simulated = simulate(scenario(effects), np.random.default_rng(SEED))
    blocks = list(simulated.blocks())
    target = np.concatenate([simulated.scene.target[b.pulses.triangle] for b in blocks])
    return simulated, PointCloud.concatenate([b.cloud for b in blocks]), target


def survey_of(simulated):
    "What is recorded, as a Survey without files"
    targets, is_check = simulated.targets, simulated.is_check

    def some(rows):
        rows = np.flatnonzero(rows)
        return replace(
            targets,
            name=tuple(targets.name[i] for i in rows),
            kind=tuple(targets.kind[i] for i in rows),
            **{k: getattr(targets, k)[rows] for k in ("position", "sigma", "size", "normal")},
        )

    return Survey(
        name="simulated",
        path=Path("simulated"),
        crs=None,
        clouds=(CloudFile(Path("pass.laz"), 0, 0.0, "week"),),
        trajectory=simulated.trajectory,
        mounting=simulated.mounting,
        control=some(~is_check),
        check=some(is_check),
        scanner=Scanner(range_noise=0.004),
    )


def observations(simulated, cloud, target):
    "Ideal observations, the mean of all points of a target and pass, and the rows of these points"
    number = 1 + simulated.trajectory.segment(cloud.gps_time)
    found = []
    for i in range(len(simulated.targets)):
        apart = np.linalg.norm(cloud.xyz - simulated.true_centre[i], axis=1)
        for one in np.unique(number):
            # the disc or plate alone: circles stand on a board that is larger
            rows = np.flatnonzero((target == i) & (number == one) & (apart < 0.28))
            if len(rows) >= 12:
                found.append((i, one, rows))
    which = [i for i, _, _ in found]
    matched = TargetObservations(
        name=tuple(simulated.targets.name[i] for i in which),
        pass_number=np.array([one for _, one, _ in found]),
        gps_time=np.array([cloud.gps_time[rows].mean() for _, _, rows in found]),
        position=np.array([cloud.xyz[rows].mean(axis=0) for _, _, rows in found]),
        covariance=np.tile(1e-6 * np.eye(3), (len(found), 1, 1)),
        normal=simulated.targets.normal[which],
        kind=tuple(simulated.targets.kind[i] for i in which),
        size=simulated.targets.size[which],
        points=np.array([len(rows) for _, _, rows in found]),
    )
    return matched, [rows for _, _, rows in found]


@pytest.fixture(scope="module")
def clean():
    "A survey with nothing wrong: simulated, Survey, Rows of its targets, and their points"
    simulated, cloud, target = run()
    survey = survey_of(simulated)
    matched, points = observations(simulated, cloud, target)
    number = 1 + simulated.trajectory.segment(cloud.gps_time)
    candidates = Candidates(cloud, number, NO_POINTS, {})
    return survey, target_rows(survey, matched, candidates), cloud, points


@pytest.fixture(scope="module")
def patches(clean):
    "Patches of the clean survey, unread from files, and their Rows"
    survey, _, cloud, _ = clean
    found = find_patches(survey, chunks=lambda file: [cloud])
    return patch_rows(survey, found)


def in_simulation(clean, name):
    "How the target rows change when the full simulator has the effect"
    _, rows, cloud, points = clean
    simulated, changed, _ = run(name)
    assert len(changed) == len(cloud)
    shift = np.array([(changed.xyz[of] - cloud.xyz[of]).mean(axis=0) for of in points])
    now = survey_of(simulated)
    shift = np.repeat(shift, 3, axis=0)
    moved = (now.control + now.check).position - rows.targets.position
    return np.einsum("mi,mi->m", rows.direction, shift - moved[rows.survey_item])


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


def test_known_effects_can_be_taken_from_the_rows(clean):
    "What a simulator has already is the sum of its effects' changes"
    survey, rows, _, _ = clean
    effects = [make_effect(name, **EXACT[name]) for name in ("time_offset", "lever_arm")]
    truth = sum(in_simulation(clean, effect.name) for effect in effects)
    change = expected(rows, survey, effects)
    np.testing.assert_allclose(change.shift, truth, atol=0.03 * np.abs(truth).max())


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


def test_without_a_mounting_the_beams_are_not_known(clean):
    "Clock, POS and control effects stay; those of range, angle and mounting are left out, named"
    survey, rows, _, _ = clean
    blind = replace(survey, mounting=None)
    bare = replace(rows, pulses=replace(rows.pulses, scanner_xyz=rows.pulses.xyz * np.nan))
    found, left_out = signatures(bare, blind)
    with_mounting = {one.label: one for one in signatures(rows, survey)[0]}
    assert {"lever_arm", "range_bias", "angle_scale"} <= set(left_out)
    assert "no [mounting]" in left_out["boresight"]
    names = {one.name for one in found}
    assert {"time_offset", "clock_drift", "heading_drift", "vertical_datum"} <= names
    for one in found:
        if one.name in ("time_offset", "heading_drift"):
            np.testing.assert_allclose(one.jacobian, with_mounting[one.label].jacobian, atol=1e-6)


@dataclass(frozen=True)
class Lift(Effect):
    "A test's own effect: the body rises with the square of the speed"

    name: ClassVar = "lift"
    stage: ClassVar = "pos"
    magnitude: float = quantity("m per (m/s)^2", 0.01, "no car flies", typical=1e-4)

    def _change(self, value, reference, rng):
        speed = np.linalg.norm(np.gradient(value.position, value.gps_time, axis=0), axis=1)
        up = self.magnitude * speed[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
        return replace(value, position=value.position + up)


def test_effects_outside_the_library_are_differentiated_alike(clean):
    "Any effect class will do: a lift with speed squared raises each target by that"
    survey, rows, _, _ = clean
    (found,), left_out = signatures(rows, survey, [Lift])
    assert not left_out
    up = rows.covariates["axis"] == 2
    speed = rows.covariates["speed"][up]
    np.testing.assert_allclose(found.jacobian[up, 0], speed**2, rtol=0.03)
    np.testing.assert_allclose(found.jacobian[~up, 0], 0.0, atol=1e-9)
