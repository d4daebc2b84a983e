"""Imperfections as values: each acts where it says, as large as it says, and nowhere else."""

from dataclasses import dataclass, fields

import numpy as np
import pytest

from mlscorr.effects import (
    EFFECTS,
    STAGES,
    Returns,
    make_effect,
)
from mlscorr.frames import skew
from mlscorr.simulate import Scenario, simulate
from mlscorr.simulate.scenario import (
    DriveScenario,
    EffectScenario,
    ScannerScenario,
    TargetScenario,
)
from mlscorr.survey import Mounting, Trajectory
from tests.effects.bed import (
    AGREEMENT,
    GRAZING,
    MOUNTING,
    NAMES,
    REFERENCE,
    RETURNS,
    SMALL,
    START,
    TRAJECTORY,
    VALUES,
    WALK_INTENSITY,
    applied,
    beam,
    by_patch,
    place,
    zero,
)

CHANGES = {  # the only fields that a stage may change
    "clock": {"gps_time"},
    "range": {"range"},
    "angle": {"angle"},
    "return": {"kept"},
    "pos": {"position", "attitude"},
    "mounting": {"lever_arm", "boresight"},
    "control": {"position", "normal"},
}


@dataclass(frozen=True)
class Case:
    "A trajectory, a mounting and returns: what Eq. 1 needs"

    trajectory: Trajectory
    mounting: Mounting
    returns: Returns

    @property
    def elapsed(self):
        return self.returns.gps_time - START

    @property
    def share(self):
        "Share of its pass that has elapsed at each return, from 0 to 1"
        whole = self.trajectory
        number = whole.segment(self.returns.gps_time)
        start = np.append(whole.gps_time[0], whole.gaps[:, 1])[number]
        end = np.append(whole.gaps[:, 0], whole.gps_time[-1])[number]
        return (self.returns.gps_time - start) / (end - start)

    def partials(self):
        "Derivatives (n, 3) or (n, 3, 3) of the map points by what the effects change"
        times = self.returns.gps_time
        angle = self.returns.angle
        distance = self.returns.range
        pose = self.trajectory.at(times)
        direction = self.mounting.boresight.apply(beam(angle))
        across = self.mounting.boresight.apply(beam(angle + np.pi / 2))
        arm = distance[:, None] * direction  # R_L X_L
        reach = pose.attitude.apply(arm + self.mounting.lever_arm)  # G, Eq. 8
        later, sooner = (self.trajectory.at(times + step) for step in (5e-3, -5e-3))
        velocity = (later.position - sooner.position) / 0.01
        rate = (later.attitude * sooner.attitude.inv()).as_rotvec() / 0.01
        turned = pose.attitude.as_matrix()
        return {
            "time": velocity + np.cross(rate, reach),  # Eq. 1 by t
            "range": pose.attitude.apply(direction),  # Eq. 1 by the range
            "angle": distance[:, None] * pose.attitude.apply(across),  # Eq. 1 by the angle
            "lever_arm": turned,  # R, Eq. 16-18
            "boresight": -turned @ skew(arm),  # -R Phi(P), Eq. 16-18, without the lever arm
            "heading": np.cross([0.0, 0.0, -1.0], reach),  # -Phi(G), Eq. 9, about minus up
        }

    def shift(self, name, magnitude, phase=0.0, time=0.0, width=1.0):
        "Analytic shift (n, 3) of every point: partial derivative times the effect's size there"
        by = self.partials()
        returns = self.returns
        size = np.array(magnitude)
        if name in ("lever_arm", "boresight"):
            return -by[name] @ (size if name == "lever_arm" else np.radians(size))
        event = {
            "position_step": (self.elapsed >= time) & (self.elapsed < time + 50.0),
            "position_bump": np.exp(-0.5 * ((self.elapsed - time) / width) ** 2),
        }
        if name in event:
            return event[name][:, None] * size
        what, factor = {
            "time_offset": ("time", np.ones(len(returns))),
            "clock_drift": ("time", self.elapsed),
            "range_bias": ("range", np.ones(len(returns))),
            "range_scale": ("range", returns.range),
            "range_walk": ("range", np.log10(np.maximum(returns.intensity, 1) / WALK_INTENSITY)),
            "incidence_bias": ("range", 1.0 / np.maximum(returns.incidence, GRAZING) - 1.0),
            "angle_scale": ("angle", np.mod(returns.angle + np.pi, 2 * np.pi) - np.pi),
            "angle_eccentricity": ("angle", np.sin(returns.angle - phase)),
            "heading_drift": ("heading", np.radians(self.share)),
        }[name]
        return by[what] * (size * factor)[:, None]


SYNTHETIC = Case(TRAJECTORY, MOUNTING, RETURNS)
CLOUD = [
    "time_offset",
    "clock_drift",
    "range_bias",
    "range_scale",
    "range_walk",
    "incidence_bias",
    "angle_scale",
    "angle_eccentricity",
    "lever_arm",
    "boresight",
    "heading_drift",
    "position_step",
    "position_bump",
]


@pytest.mark.parametrize("name", CLOUD)
def test_the_mean_shift_at_targets_is_the_analytic_partial_derivative(name):
    "There and back, at 4 to 25 m: each target moves as Eq. 1 differentiated says, to 0.1 %"
    stage = make_effect(name, **SMALL[name]).stage
    recorded = applied(name)
    key = {"pos": "trajectory", "mounting": "mounting"}.get(stage, "returns")
    shift = by_patch(place(**{key: recorded}) - place())
    expected = by_patch(SYNTHETIC.shift(name, **SMALL[name]))
    size = np.linalg.norm(expected, axis=1)
    assert size.max() > 1e-4  # m: far above the rounding of UTM coordinates
    off = np.linalg.norm(shift - expected, axis=1)
    assert (off < AGREEMENT * size + 1e-8).all()  # m


def simulated(effects=()):
    "A simulated survey of 9 s with some effects"
    return simulate(
        Scenario(
            start_time=START,
            drive=DriveScenario(duration=9.0),
            targets=TargetScenario(control=4, check=1),
            scanner=(ScannerScenario(lines_per_second=60.0, points_per_line=400),),
            effects=effects,
        ),
        np.random.default_rng(2),
    )


@pytest.fixture(scope="module")
def clean():
    return simulated()


@pytest.mark.long
@pytest.mark.parametrize("name", CLOUD)
def test_simulated_targets_shift_as_the_partial_derivative_says(name, clean):
    "A survey simulated with and without: the same returns, and each target moved to 1 %"
    events = {"position_step": {"time": 4.5}, "position_bump": {"time": 4.5, "width": 1.5}}
    parameters = {**SMALL[name], **events.get(name, {})}
    survey = simulated((EffectScenario(name=name, **parameters),))
    np.testing.assert_array_equal(survey.pulses.point, clean.pulses.point)
    columns = (getattr(clean.pulses, f.name) for f in fields(Returns) if f.name != "kept")
    returns = Returns(*columns, np.ones(len(clean.pulses), dtype=bool))
    elapsed = returns.gps_time - START
    inside = (elapsed > 0.06) & (elapsed < 8.9)  # s: velocity needs epochs on both sides
    expected = np.full((len(returns), 3), np.nan)
    held = Returns(*(getattr(returns, f.name)[inside] for f in fields(Returns)))
    case = Case(clean.trajectory, clean.mounting, held)
    expected[inside] = case.shift(name, **parameters)
    for target in range(5):
        on = inside & (clean.target == target)
        assert on.sum() > 20
        shift = (survey.cloud.xyz - clean.cloud.xyz)[on].mean(axis=0)
        size = np.linalg.norm(expected[on].mean(axis=0))
        off = np.linalg.norm(shift - expected[on].mean(axis=0))
        assert off < 0.01 * size + 2e-6, f"target {target}"  # m: interpolation between epochs


@pytest.mark.parametrize("name", NAMES)
def test_a_magnitude_of_zero_changes_nothing(name):
    "Not a bit: the very same object comes back"
    effect = zero(name)
    value = VALUES[effect.stage]
    assert effect.apply(value, REFERENCE, np.random.default_rng(1)) is value


@pytest.mark.parametrize("name", [name for name in NAMES if name != "beam_divergence"])
def test_an_effect_changes_what_its_stage_declares_and_nothing_else(name):
    "Every other field is the same object as before, and the input is as it was"
    effect = make_effect(name, **SMALL[name])
    value = VALUES[effect.stage]
    before = {
        f.name: np.copy(getattr(value, f.name))
        for f in fields(value)
        if isinstance(getattr(value, f.name), np.ndarray)
    }
    recorded = effect.apply(value, REFERENCE, np.random.default_rng(1))
    assert type(recorded) is type(value)
    changed = {
        f.name for f in fields(value) if getattr(recorded, f.name) is not getattr(value, f.name)
    }
    assert changed
    assert changed <= CHANGES[effect.stage]
    for field, array in before.items():
        np.testing.assert_array_equal(getattr(value, field), array)


def test_every_effect_of_the_interface_is_there_with_unit_size_and_source():
    "24 names; every magnitude has a unit, a typical size below its largest, and where that is from"
    assert sorted(NAMES) == sorted(SMALL)
    for kind in EFFECTS:
        assert kind.stage in STAGES
        magnitude = kind.quantities()["magnitude"]
        assert magnitude.unit
        assert 0 < magnitude.typical <= magnitude.largest / 5
        assert magnitude.source
        assert magnitude.why
