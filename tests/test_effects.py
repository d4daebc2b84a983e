"""Imperfections as values: each acts where it says, as large as it says, and nowhere else."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.effects import (
    EFFECTS,
    STAGES,
    Reference,
    Returns,
    apply_effects,
    effect_streams,
    in_order,
    make_effect,
)
from mlscorr.effects.scan import GRAZING, WALK_INTENSITY, pulse
from mlscorr.georeference import georeference, skew
from mlscorr.simulate import Scenario, simulate
from mlscorr.simulate.scenario import (
    DriveScenario,
    EffectScenario,
    ScannerScenario,
    TargetScenario,
)
from mlscorr.survey import ControlPoints, Mounting, Trajectory, attitude_from_angles

START = 357_700.0  # s of the GPS week
CENTRE = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
PASSES = ((0.0, 60.0), (100.0, 160.0))  # s after START: there, and back
TARGETS, BEAMS = 8, 500  # in each pass, on each target
AGREEMENT = 1e-3  # of the analytic mean shift; second order and rounding stay below 1e-4
SMALL = {  # magnitudes at which second order stays small
    "time_offset": {"magnitude": 1e-4},
    "clock_drift": {"magnitude": 1e-6},
    "time_jitter": {"magnitude": 1e-4},
    "boresight": {"magnitude": [0.004, -0.003, 0.006]},
    "lever_arm": {"magnitude": [0.02, -0.01, 0.03]},
    "range_bias": {"magnitude": 0.01},
    "range_scale": {"magnitude": 1e-4},
    "range_walk": {"magnitude": 0.005},
    "incidence_bias": {"magnitude": 0.003},
    "range_noise": {"magnitude": 0.005},
    "angle_scale": {"magnitude": 1e-5},
    "angle_eccentricity": {"magnitude": 1e-5, "phase": 0.4},
    "angle_noise": {"magnitude": 0.002},
    "heading_drift": {"magnitude": 0.005},
    "position_step": {"magnitude": [0.1, -0.2, 0.05], "time": 30.0},
    "position_bump": {"magnitude": [0.1, -0.2, 0.05], "time": 130.0, "width": 10.0},
    "position_noise": {"magnitude": 0.02},
    "vertical_datum": {"magnitude": 0.03},
    "horizontal_datum": {"magnitude": [0.05, -0.02]},
    "map_rotation": {"magnitude": 1e-5},
    "map_scale": {"magnitude": 1e-4},
    "target_outlier": {"magnitude": [0.05, 0.0, -0.1], "target": "T03"},
    "beam_divergence": {"magnitude": 0.35},
    "dropout": {"magnitude": 0.05},
}
CHANGES = {  # the only fields that a stage may change
    "clock": {"gps_time"},
    "range": {"range"},
    "angle": {"angle"},
    "return": {"kept"},
    "pos": {"position", "attitude"},
    "mounting": {"lever_arm", "boresight"},
    "control": {"position", "normal"},
}
NAMES = [kind.name for kind in EFFECTS]


# ---- a drive there and back, and its pulses on targets


def make_trajectory():
    "Two passes of a minute at 8 m/s on a curving way, opposite in direction, with a gap"
    elapsed = np.concatenate([np.arange(start, end + 1e-9, 0.01) for start, end in PASSES])
    back = elapsed > PASSES[1][0] - 1.0
    along = np.where(back, 8.0 * (PASSES[1][1] - elapsed), 8.0 * elapsed)
    course = 0.4 + 0.2 * np.sin(along / 60.0)
    position = np.empty((len(elapsed), 3))
    for one in (~back, back):
        step = np.diff(along[one], prepend=along[one][0])
        position[one, 0] = np.cumsum(step * np.sin(course[one]))
        position[one, 1] = np.cumsum(step * np.cos(course[one]))
        position[one, 2] = 0.5 * np.sin(along[one] / 90.0)
    position[back, :2] += 480.0 * np.array([np.sin(0.4), np.cos(0.4)])
    attitude = attitude_from_angles(
        np.radians(1.0) * np.sin(0.7 * elapsed),
        np.radians(2.0) * np.sin(0.3 * elapsed),
        course + np.where(back, np.pi, 0.0),
    )
    return Trajectory(START + elapsed, CENTRE + position, attitude)


def make_returns(rng):
    "Beams on small patches at several ranges, angles and incidences, in both passes, in time order"
    n = len(PASSES) * TARGETS
    when = np.concatenate([start + np.linspace(5, 55, TARGETS) for start, _ in PASSES])
    patch = np.repeat(np.arange(n), BEAMS)
    spread = np.sort(rng.uniform(-0.02, 0.02, (n, BEAMS)), axis=1).ravel()
    turn = np.linspace(-1.2, 1.3, TARGETS)[np.arange(n) % TARGETS]
    far = np.linspace(4.0, 25.0, TARGETS)[(np.arange(n) * 3) % TARGETS]
    return patch, Returns(
        gps_time=START + when[patch] + spread,
        angle=turn[patch] + rng.uniform(-0.05, 0.05, len(patch)),
        range=far[patch] + rng.uniform(-0.1, 0.1, len(patch)),
        intensity=rng.uniform(500.0, 3000.0, len(patch)),
        incidence=rng.uniform(0.3, 0.9, len(patch)),
        kept=np.ones(len(patch), dtype=bool),
    )


def make_control():
    rng = np.random.default_rng(4)
    place = rng.uniform([0, 0, -2], [200, 400, 6], (6, 3))
    normal = rng.standard_normal((6, 3))
    return ControlPoints(
        tuple(f"T{i + 1:02d}" for i in range(6)),
        CENTRE + place,
        np.full((6, 3), 0.003),
        ("circle", "square") * 3,
        np.full(6, 0.6),
        normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


TRAJECTORY = make_trajectory()
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
)
PATCH, RETURNS = make_returns(np.random.default_rng(3))
CONTROL = make_control()
REFERENCE = Reference(START, START + PASSES[1][1], CENTRE + np.array([100.0, 200.0, 0.0]))
VALUES = {
    "beam": 3e-4,
    **dict.fromkeys(("clock", "range", "angle", "return"), RETURNS),
    "pos": TRAJECTORY,
    "mounting": MOUNTING,
    "control": CONTROL,
}


def zero(name):
    "An effect with its magnitude at zero"
    small = SMALL[name]
    return make_effect(name, **{**small, "magnitude": np.multiply(small["magnitude"], 0.0)})


def applied(name, seed=0):
    "What a small effect makes of its stage's value"
    effect = make_effect(name, **SMALL[name])
    return effect.apply(VALUES[effect.stage], REFERENCE, np.random.default_rng(seed))


def beam(angle):
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])


def place(returns=RETURNS, trajectory=TRAJECTORY, mounting=MOUNTING):
    "Where the pulses lie in the map, by Eq. 1"
    scanner_xyz = returns.range[:, None] * beam(returns.angle)
    return georeference(trajectory, mounting, scanner_xyz, returns.gps_time)


def by_patch(values):
    "Mean over the beams on each patch"
    return np.add.reduceat(values, np.arange(0, len(values), BEAMS)) / BEAMS


# ---- analytic partial derivatives of Eq. 1, X = T + R (R_L X_L + T_L), with P = R_L X_L + T_L


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
        "How much of its pass has gone by at each return, from 0 to 1"
        whole = self.trajectory
        number = whole.segment(self.returns.gps_time)
        start = np.append(whole.gps_time[0], whole.gaps[:, 1])[number]
        end = np.append(whole.gaps[:, 0], whole.gps_time[-1])[number]
        return (self.returns.gps_time - start) / (end - start)

    def partials(self):
        "Derivatives (n, 3) or (n, 3, 3) of the map points by what the effects change"
        times, angle, distance = self.returns.gps_time, self.returns.angle, self.returns.range
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
        by, returns = self.partials(), self.returns
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


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("vertical_datum", lambda arm: np.tile([0, 0, 0.03], (len(arm), 1))),
        ("horizontal_datum", lambda arm: np.tile([0.05, -0.02, 0], (len(arm), 1))),
        ("map_rotation", lambda arm: 1e-5 * np.cross([0, 0, 1.0], arm)),
        ("map_scale", lambda arm: 1e-4 * arm * [1, 1, 0]),
        ("target_outlier", lambda arm: np.eye(6)[:, [2]] * [0.05, 0, -0.1]),
    ],
)
def test_the_control_moves_as_its_frame_does(name, expected):
    "Control at UTM size moves by the derivative of its own transformation, to 0.1 %"
    shift = applied(name).position - CONTROL.position
    wanted = expected(CONTROL.position - REFERENCE.place)
    assert np.abs(shift - wanted).max() < AGREEMENT * np.abs(wanted).max() + 1e-9  # m


@pytest.mark.parametrize(
    ("name", "change", "sigma"),
    [
        ("time_jitter", lambda r: r.gps_time - RETURNS.gps_time, 1e-4),
        ("range_noise", lambda r: r.range - RETURNS.range, 0.005),
        ("angle_noise", lambda r: r.angle - RETURNS.angle, np.radians(0.002)),
    ],
)
def test_noise_has_the_stated_sigma_and_no_mean(name, change, sigma):
    "8000 independent pulses: sigma to 4 %, mean below 5 sigma of itself, neighbours unrelated"
    noise = change(applied(name))
    assert noise.std() == pytest.approx(sigma, rel=0.04)
    assert abs(noise.mean()) < 5 * sigma / np.sqrt(len(noise))
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.05


def test_position_noise_has_one_sigma_at_all_times_and_forgets_in_two_seconds():
    "Over 200 seeds: RMS as stated at any time between fixes, smooth, unrelated after 2 s"
    noise = np.array([applied("position_noise", seed).position for seed in range(200)])
    noise = (noise - TRAJECTORY.position)[:, :6000]
    assert noise.std(axis=(0, 2)) == pytest.approx(0.02, rel=0.2)  # 600 values an epoch
    assert noise.std() == pytest.approx(0.02, rel=0.02)
    assert np.abs(np.diff(noise, axis=1)).max() < 0.002  # m in 10 ms
    by_lag = [np.mean(noise[:, lag:] * noise[:, :-lag]) / 0.02**2 for lag in (1, 100, 200)]
    assert by_lag == pytest.approx([1.0, 1 / np.pi, 0.0], abs=0.03)


def test_dropout_loses_its_share():
    "5 % of 8000 returns, to 1 %; lost ones stay lost"
    kept = applied("dropout").kept
    assert 1.0 - kept.mean() == pytest.approx(0.05, abs=0.01)
    none = replace(RETURNS, kept=np.zeros(len(RETURNS), dtype=bool))
    effect = make_effect("dropout", magnitude=0.5)
    assert not effect.apply(none, REFERENCE, np.random.default_rng(1)).kept.any()


def test_the_beam_widens_by_milliradians():
    "0.35 mrad on top of 0.3 mrad"
    assert applied("beam_divergence") == pytest.approx(6.5e-4, abs=1e-12)


def test_corrections_of_the_mounting_restore_it():
    "lever_arm_true = recorded + c and R_true = Exp(c) R_recorded, c about the body axes"
    arm, boresight = applied("lever_arm"), applied("boresight")
    restored = Rotation.from_rotvec([0.004, -0.003, 0.006], degrees=True) * boresight.boresight
    assert arm.lever_arm + np.array([0.02, -0.01, 0.03]) == pytest.approx(
        MOUNTING.lever_arm, abs=1e-15
    )
    assert (restored * MOUNTING.boresight.inv()).magnitude() < 1e-15  # rad


# ---- zero, stages, streams


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
    before = {f.name: np.copy(getattr(value, f.name)) for f in fields(value)
              if isinstance(getattr(value, f.name), np.ndarray)}  # fmt: skip
    recorded = effect.apply(value, REFERENCE, np.random.default_rng(1))
    assert type(recorded) is type(value)
    changed = {f.name for f in fields(value)
               if getattr(recorded, f.name) is not getattr(value, f.name)}  # fmt: skip
    assert changed
    assert changed <= CHANGES[effect.stage]
    for field, array in before.items():
        np.testing.assert_array_equal(getattr(value, field), array)


@pytest.mark.parametrize("name", NAMES)
def test_switching_an_effect_off_leaves_all_others_bit_for_bit(name):
    "Every effect has a stream of its own, spawned whether it is used or not"
    every = [make_effect(other, **SMALL[other]) for other in NAMES]
    off = [zero(e.name) if e.name == name else e for e in every]
    without = [e for e in every if e.name != name]
    stage = next(e.stage for e in every if e.name == name)
    for other in STAGES:
        results = []
        for effects in (every, off, without):
            streams = effect_streams(np.random.default_rng(5))
            results.append(apply_effects(effects, other, VALUES[other], REFERENCE, streams))
        for result in results[1:] if other != stage else results[2:]:
            same_as = results[0] if other != stage else results[1]
            assert_same(result, same_as)


def test_the_list_order_does_not_matter():
    "The order is fixed by stage and name, not by who listed what first"
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    every.append(make_effect("position_bump", magnitude=[0, 0, 0.1], time=20.0, width=5.0))
    assert in_order(every) == in_order(every[::-1])
    assert [STAGES.index(e.stage) for e in in_order(every)] == sorted(
        STAGES.index(e.stage) for e in every
    )


def test_blocks_of_any_size_give_the_same():
    "Streams go on from block to block, so memory's size leaves no trace"
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    for stage in ("clock", "range", "angle", "return"):
        streams = effect_streams(np.random.default_rng(6))
        whole = apply_effects(every, stage, RETURNS, REFERENCE, streams)
        streams = effect_streams(np.random.default_rng(6))
        pieces = []
        for start in range(0, len(RETURNS), 777):
            columns = (getattr(RETURNS, f.name)[start : start + 777] for f in fields(Returns))
            pieces.append(apply_effects(every, stage, Returns(*columns), REFERENCE, streams))
        for field in fields(Returns):
            joined = np.concatenate([getattr(piece, field.name) for piece in pieces])
            np.testing.assert_array_equal(joined, getattr(whole, field.name))


def assert_same(one, other):
    if isinstance(one, float):
        assert one == other
        return
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, Rotation):
            a, b = a.as_quat(), b.as_quat()
        np.testing.assert_array_equal(a, b)


# ---- what each one is


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


def test_returns_of_one_pulse_share_its_time_and_angle():
    "First and last return of a pulse get the same jitter and angle noise, each its own range noise"
    twice = Returns(*(np.repeat(getattr(RETURNS, f.name), 2) for f in fields(Returns)))
    np.testing.assert_array_equal(pulse(twice), np.repeat(np.arange(len(RETURNS)), 2))
    apart = Returns(*(np.tile(getattr(RETURNS, f.name), 2) for f in fields(Returns)))
    np.testing.assert_array_equal(pulse(apart), np.tile(np.arange(len(RETURNS)), 2))
    for name, field in (("time_jitter", "gps_time"), ("angle_noise", "angle")):
        effect = make_effect(name, **SMALL[name])
        noisy = getattr(effect.apply(twice, REFERENCE, np.random.default_rng(1)), field)
        np.testing.assert_array_equal(noisy[::2], noisy[1::2])
    effect = make_effect("range_noise", magnitude=0.005)
    noisy = effect.apply(twice, REFERENCE, np.random.default_rng(1)).range
    assert (noisy[::2] != noisy[1::2]).all()


def test_angle_scale_does_not_mind_in_which_turn_an_angle_is_given():
    "190 deg and -170 deg are the same beam"
    effect = make_effect("angle_scale", magnitude=1e-3)
    one = replace(RETURNS, angle=np.radians(np.full(len(RETURNS), 190.0)))
    other = replace(RETURNS, angle=one.angle - 2 * np.pi)
    shift = effect.apply(one, REFERENCE).angle - one.angle
    assert shift == pytest.approx(effect.apply(other, REFERENCE).angle - other.angle, abs=1e-14)
    assert shift == pytest.approx(np.radians(-0.170), abs=1e-14)


def test_grazing_returns_and_dark_ones_stay_finite():
    "An incidence of 90 deg and an intensity of zero have a bound"
    worst = replace(RETURNS, incidence=np.zeros(len(RETURNS)), intensity=np.zeros(len(RETURNS)))
    bias = make_effect("incidence_bias", magnitude=0.01).apply(worst, REFERENCE).range
    assert bias - RETURNS.range == pytest.approx(0.01 * (1 / GRAZING - 1))
    walk = make_effect("range_walk", magnitude=0.01).apply(worst, REFERENCE).range
    assert walk - RETURNS.range == pytest.approx(-0.01 * np.log10(WALK_INTENSITY))


def test_no_returns_are_no_trouble():
    "A block that hit nothing passes every stage"
    none = Returns(*(np.zeros(0, getattr(RETURNS, f.name).dtype) for f in fields(Returns)))
    streams = effect_streams(np.random.default_rng(1))
    every = [make_effect(name, **SMALL[name]) for name in NAMES]
    for stage in ("clock", "range", "angle", "return"):
        assert len(apply_effects(every, stage, none, REFERENCE, streams)) == 0


# ---- refusals


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("boresite", {}, r"'boresite' is an unknown effect; the nearest known one is boresight\."),
        (
            "boresight",
            {"magnitude": [200, 0, 0]},
            r"^boresight of 200 deg exceeds 10 deg; a mounting .* to a degree\.$",
        ),
        ("boresight", {"magnitude": 1.0}, "of 1.0 can't be used: it must be 3 numbers in deg"),
        ("range_bias", {"magnitude": [1.0]}, "must be one number in m"),
        ("range_bias", {"magnitude": True}, "must be one number in m"),
        ("range_bias", {"magnitude": "0.1"}, "must be one number in m"),
        ("range_bias", {"magnitude": np.nan}, "of nan is not finite"),
        ("range_noise", {"magnitude": -0.1}, "range_noise of -0.1 m is less than 0 m"),
        ("range_bias", {"size": 0.1}, r"no parameter 'size'; its parameters are magnitude \(m\)"),
        ("position_step", {"magnitude": [0, 0, 1]}, r"lacks time; .*magnitude \(3 numbers in m\)"),
        ("angle_eccentricity", {"magnitude": 1e-3, "phase": 90}, "phase of angle.* 90 rad exceeds"),
        ("target_outlier", {"magnitude": [1, 0, 0], "target": 3}, "3 is not a target's name"),
        ("dropout", {"magnitude": 1.0}, "dropout of 1 ratio exceeds 0.99"),
        ("map_rotation", {"magnitude": 2.0}, r"2 rad exceeds 0.1 rad; .*degrees\?"),
    ],
)
def test_what_no_survey_can_have_is_refused_in_a_sentence(name, parameters, message):
    "Name, value, unit, limit, and why"
    with pytest.raises(ValueError, match=message) as error:
        make_effect(name, **parameters)
    assert "\n" not in str(error.value)


def test_events_outside_the_drive_and_unknown_targets_are_refused():
    "A step between the passes, a bump after the last, an outlier on a target that isn't there"
    step = make_effect("position_step", magnitude=[0, 0, 1], time=80.0)
    with pytest.raises(ValueError, match=r"position_step at 80 s lies outside .* 1 gaps"):
        step.apply(TRAJECTORY, REFERENCE)
    bump = make_effect("position_bump", magnitude=[0, 0, 1], time=200.0, width=5.0)
    with pytest.raises(ValueError, match=r"position_bump at 200 s .* ends after 160\.0 s"):
        bump.apply(TRAJECTORY, REFERENCE)
    outlier = make_effect("target_outlier", magnitude=[0, 0, 1], target="T3")
    with pytest.raises(ValueError, match=r"'T3', which is none of the 6 targets; .* 'T03'"):
        outlier.apply(CONTROL, REFERENCE)


def test_a_random_effect_twice_is_refused():
    "Two would draw from one stream in turn, and blocks of other sizes would give something else"
    twice = [make_effect("range_noise", magnitude=m) for m in (0.003, 0.004)]
    with pytest.raises(ValueError, match="range_noise is listed 2 times"):
        in_order(twice)


def test_an_unknown_stage_is_refused():
    "A stage that no effect acts on is a mistyped one"
    with pytest.raises(ValueError, match="'clocks' is an unknown stage; known are beam, clock"):
        apply_effects([], "clocks", RETURNS, REFERENCE, {})
