"""The simulator run again on a survey's own pulses: noise without effects, with them the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.effects import Reference, Returns, apply_effects, effect_streams, make_effect
from mlscorr.simulate.scan import (
    FORMS,
    Boards,
    Draws,
    Planes,
    Platform,
    RecordedPulses,
    Replay,
    TargetWorld,
)
from mlscorr.survey import Mounting, Scanner, Survey, Trajectory

ORIGIN = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
START = 413_200.0  # s
SLOPE = np.array([0.1, 0.2, np.sqrt(0.95)])  # normal of the ground through ORIGIN
LARGE = {  # effects that are not linear, or as large as a mistake
    "time_offset": {"magnitude": -0.4},
    "clock_drift": {"magnitude": 1e-3},
    "range_bias": {"magnitude": 0.8},
    "range_scale": {"magnitude": 0.01},
    "range_walk": {"magnitude": 0.1},
    "incidence_bias": {"magnitude": 0.05},
    "angle_scale": {"magnitude": 0.02},
    "angle_eccentricity": {"magnitude": 0.02, "phase": 0.7},
    "boresight": {"magnitude": [4.0, -3.0, 5.0]},
    "lever_arm": {"magnitude": [1.0, -2.0, 0.5]},
    "heading_drift": {"magnitude": 4.0},
    "position_step": {"magnitude": [5.0, -3.0, 2.0], "time": 4.0},
    "position_bump": {"magnitude": [5.0, -3.0, 2.0], "time": 5.0, "width": 2.0},
}


def replay(survey, pulses, world, effects, reference, rng, origin):
    "Points of pulses that are fired again into a world, whether they are kept, and what they meet"
    draws = Draws.of(len(pulses), rng)
    run = Replay(survey, pulses, tuple(effects), reference, draws, np.asarray(origin, dtype=float))
    met = world.meet(*run.beams)
    return *run.measure(met), met


def effect_of(name, sizes):
    return make_effect(name, **sizes[name])


def driven():
    "Ten seconds of a curve: true trajectory, mounting, and pulses on the ground as they truly are"
    time = START + np.arange(0, 10.005, 0.01)
    turn = 0.1 * (time - START)
    way = 60.0 * np.column_stack([np.sin(turn), 1 - np.cos(turn), 0 * turn])
    attitude = Rotation.from_euler("ZXY", np.column_stack([turn - 1.5, 0 * turn, 0 * turn + 0.02]))
    trajectory = Trajectory(time, ORIGIN + way + [0, 0, 2.0], attitude)
    mounting = Mounting(
        np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
    )
    angle = np.linspace(-2.2, -1.0, 500)
    pulses = RecordedPulses(
        gps_time=START + np.linspace(1.0, 9.0, 500),
        angle=angle,
        elevation=np.zeros(500),
        range=np.ones(500),
        intensity=np.linspace(500.0, 20_000.0, 500),
        incidence=np.ones(500),
    )
    return trajectory, mounting, pulses


def recorded(effect):
    "Sloping ground with an effect: Survey, recorded pulses, points, reference, true hits"
    trajectory, mounting, pulses = driven()
    reference = Reference(*trajectory.gps_time[[0, -1]], ORIGIN)
    true = Platform.of(trajectory, mounting, ORIGIN)
    place = pulses.gps_time, pulses.angle, pulses.elevation
    start = true.place(*place, np.zeros(500), np.zeros(3))
    incidence = (start - true.place(*place, np.ones(500), np.zeros(3))) @ SLOPE
    away = start @ SLOPE / incidence
    assert (away > 0).all() and (incidence > 0.1).all()

    def changed(stage, value):
        return apply_effects([effect], stage, value, reference, effect_streams(no_rng()))

    returns = Returns(*place[:2], away, pulses.intensity, incidence, np.ones(500, bool))
    values = {
        name: getattr(changed(stage, returns), name)
        for stage, name in (("clock", "gps_time"), ("angle", "angle"), ("range", "range"))
    }
    survey = Survey(
        name="ground",
        path=Path("ground"),
        crs=None,
        clouds=(),
        trajectory=changed("pos", trajectory),
        mounting=changed("mounting", mounting),
        control=None,
        check=None,
        scanner=Scanner(0.0, 0.0),
    )
    noted = replace(pulses, **values, incidence=incidence)
    by_record = Platform.of(survey.trajectory, survey.mounting, ORIGIN)
    points = by_record.place(noted.gps_time, noted.angle, noted.elevation, noted.range, ORIGIN)
    return survey, noted, points, reference, true.place(*place, away, np.zeros(3))


def no_rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("name", LARGE)
def test_taken_off_the_record_an_effect_gives_the_record_again(name):
    "However large: the truth is found behind it, and simulated with the effect it is the record"
    effect = effect_of(name, LARGE)
    survey, pulses, points, reference, hits = recorded(effect)
    ground = Planes(np.tile(SLOPE, (500, 1)), np.zeros(500), pulses.intensity)
    xyz, kept, met = replay(survey, pulses, ground, (effect,), reference, no_rng(), ORIGIN)
    assert kept.all()
    np.testing.assert_allclose(xyz, points, atol=2e-3)
    without, _, _ = replay(survey, pulses, ground, (), reference, no_rng(), ORIGIN)
    np.testing.assert_allclose((without - ORIGIN) @ SLOPE, 0.0, atol=1e-6)
    assert np.abs(without - points).max() > 0.01
    run = Replay(survey, pulses, (effect,), reference, Draws.of(500, no_rng()), ORIGIN)
    start, direction = run.beams
    np.testing.assert_allclose(start + met.range[:, None] * direction, hits, atol=2e-3)


def test_random_effects_are_drawn_alike_whatever_else_acts():
    "Jitter and noise of one seed are the same beside another effect; the pose has none"
    jitter = make_effect("time_jitter", magnitude=0.003)
    survey, pulses, _, reference, _ = recorded(make_effect("range_bias", magnitude=0.0))
    ground = Planes(np.tile(SLOPE, (500, 1)), np.zeros(500), pulses.intensity)

    def points(*effects):
        return replay(survey, pulses, ground, effects, reference, no_rng(), ORIGIN)[0]

    noisy = points(jitter)
    bias = make_effect("range_bias", magnitude=0.01)
    assert 1e-3 < np.std(noisy - points()) < 1e-2
    np.testing.assert_allclose(points(jitter, bias) - noisy, points(bias) - points(), atol=1e-4)
    np.testing.assert_array_equal(points(make_effect("position_noise", magnitude=1.0)), points())


def test_targets_are_painted_by_their_kind():
    "Places on disc, ring, plate, hole and checkerboard are bright, dark, or beside the target"
    nothing = np.nan
    wanted = {  # at the centre, a quarter, just outside the edge, on the corner, far away
        "circle": [9.0, 9.0, 1.0, 1.0, nothing],
        "square": [9.0, 9.0, nothing, nothing, nothing],
        "hole": [nothing, nothing, 9.0, 9.0, nothing],
        "board": [9.0, 9.0, nothing, nothing, nothing],
    }
    places = np.array([[0.0, 0.0], [0.15, 0.01], [0.31, 0.0], [0.4, 0.4], [0.9, 0.0]])
    one = np.ones(1)
    for kind, paint in wanted.items():
        form = np.array([FORMS.index(kind)])
        board = Boards(
            np.zeros((1, 3)), np.eye(3)[None], form, 0.6 * one, 0 * one, 9 * one, one, 0 * one
        )
        np.testing.assert_array_equal(board.paint(np.zeros(5, int), places), paint, kind)
    ring = replace(board, form=np.array([0]), inner=0.5 * one)
    np.testing.assert_array_equal(ring.paint(np.zeros(2, int), places[[0, 1]]), [1.0, 9.0])
    checked = replace(board, form=np.array([3]))
    quadrants = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1], [0.31, 0.1]])
    np.testing.assert_array_equal(checked.paint(np.zeros(5, int), quadrants), [9, 1, 9, 1, nothing])


def test_what_stands_before_a_target_hides_it():
    "Of three beams on a plate one is stopped before it, one meets it, one goes by to the wall"
    one = np.ones(1)
    axes = np.array([[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]])
    plate = Boards(
        np.array([[5.0, 0, 0]]), axes, one.astype(int), 0.6 * one, 0 * one, 9 * one, one, 0 * one
    )
    beyond = np.array([-1.0, 2.0, 2.0])
    intensity = np.array([3.0, 4.0, 5.0])
    world = TargetWorld(plate, np.zeros(3, int), beyond, intensity, np.zeros(3))
    direction = np.array([[1.0, 0, 0], [1.0, 0, 0], [1.0, 0.1, 0]])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    met = world.meet(np.zeros((3, 3)), direction)
    np.testing.assert_allclose(met.range, [4.0, 5.0, 5.0 * np.hypot(1, 0.1) + 2.0])
    np.testing.assert_array_equal(met.intensity, [3.0, 9.0, 5.0])
