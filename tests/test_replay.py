"""The simulator run again on a survey's own pulses: noise without effects, with them the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.effects import Reference, Returns, apply_effects, effect_streams, make_effect
from mlscorr.gap.about_targets import unreturned
from mlscorr.gap.changes import Bench
from mlscorr.gap.pairing import build_rows
from mlscorr.gap.rerun import collect_beams, rerun
from mlscorr.gap.rows import Rows
from mlscorr.io.survey_file import read_survey
from mlscorr.pipeline.finding import find_targets
from mlscorr.simulate import Scenario, simulate
from mlscorr.simulate.rays import Platform
from mlscorr.simulate.replay import Draws, RecordedPulses, Replay, replay
from mlscorr.simulate.worlds import FORMS, Boards, Planes, TargetWorld
from mlscorr.survey import Mounting, Scanner, Survey, Trajectory

ORIGIN = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
START = 413_200.0  # s
SLOPE = np.array([0.1, 0.2, np.sqrt(0.95)])  # normal of the ground through ORIGIN
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


def effect_of(name, sizes):
    return make_effect(name, **sizes[name])


# ---- the simulator itself


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
    values = {name: getattr(changed(stage, returns), name) for stage, name in
              (("clock", "gps_time"), ("angle", "angle"), ("range", "range"))}  # fmt: skip
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

    noisy, bias = points(jitter), make_effect("range_bias", magnitude=0.01)
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
    beyond, intensity = np.array([-1.0, 2.0, 2.0]), np.array([3.0, 4.0, 5.0])
    world = TargetWorld(plate, np.zeros(3, int), beyond, intensity, np.zeros(3))
    direction = np.array([[1.0, 0, 0], [1.0, 0, 0], [1.0, 0.1, 0]])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    met = world.meet(np.zeros((3, 3)), direction)
    np.testing.assert_allclose(met.range, [4.0, 5.0, 5.0 * np.hypot(1, 0.1) + 2.0])
    np.testing.assert_array_equal(met.intensity, [3.0, 9.0, 5.0])


def test_pulses_that_met_the_sky_are_known_from_those_beside_them():
    "Removed from regular lines they come back at their times and angles; from irregular ones not"
    n, step, rate = 4000, 1e-5, 0.004
    time = START + step * np.arange(n)
    angle = np.mod(rate * np.arange(n) + np.pi, 2 * np.pi) - np.pi
    zero, noise = np.zeros(n), 2e-4 * np.random.default_rng(1).standard_normal(n)
    pulses = RecordedPulses(time, angle + noise, zero, zero + 5.0, zero, zero)
    span = START - step / 2, START + (n - 0.5) * step
    about = np.abs(angle - 0.5) < 0.25
    sky = about & ((np.abs(angle - 0.5) < 0.05) | (time > START + 0.03))  # and whole lines
    found = unreturned(pulses[about & ~sky], span, 0.1)
    number = np.rint((found.gps_time - START) / step).astype(int)
    np.testing.assert_allclose(found.gps_time, time[number], atol=step / 100)
    np.testing.assert_allclose(found.angle, angle[number], atol=rate / 10)
    assert set(np.flatnonzero(sky)) <= set(number)
    assert not (about & ~sky)[number].any()
    assert np.isnan(found.range).all() and np.abs(found.angle - 0.5).max() < 0.36
    random = np.sort(np.random.default_rng(0).choice(n, n // 3, replace=False))
    assert len(unreturned(pulses[random], span, 0.5)) == 0


# ---- the rows of a survey


def write_reference(simulated, path):
    "The scene as an OBJ in map coordinates"
    triangles = simulated.scene.mesh.triangles
    places = triangles.reshape(-1, 3) + np.array(simulated.scenario.origin)
    lines = ["v {:.4f} {:.4f} {:.4f}".format(*place) for place in places]
    lines += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(triangles))]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    "Two passes of five seconds past six targets, with a reference: Survey, Finding, Rows, Beams"
    scenario = Scenario(
        drive={
            "duration": 5.0,
            "speed": 5.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 4, "check": 1, "hidden": 0.2},
        scanner=[{"lines_per_second": 150, "points_per_line": 400}],
    )
    simulated = simulate(scenario, np.random.default_rng(4))
    folder = tmp_path_factory.mktemp("replay") / "survey"
    simulated.write(folder)
    write_reference(simulated, folder / "reference.obj")
    with (folder / "survey.toml").open("a") as file:
        file.write('\n[scene]\nreference = "reference.obj"\n')
    survey = read_survey(folder)
    finding = find_targets(survey)
    pairing = build_rows(survey, finding.matches.matched, finding.candidates, patches=120)
    rows = Rows.concatenate([pairing.rows, pairing.check])
    return survey, finding, rows, collect_beams(survey, rows, finding)


def run(case, *effects, rows=None):
    survey, _, all_rows, beams = case
    rows = all_rows if rows is None else rows
    return rerun(rows, survey, beams, effects, np.random.default_rng(9))


@pytest.fixture(scope="module")
def without(case):
    return run(case)


def test_all_pulses_are_found_again(case):
    "Each row has its looks, and a patch the points that it had, up to the limit"
    _, _, rows, beams = case
    assert set(beams.item) == set(rows.item)
    assert beams.second.sum() == (rows.channel == "shared").sum() > 50
    number = np.bincount(beams.look)
    first = np.flatnonzero((beams.target < 0) & ~beams.second)
    of = {item: number[look] for item, look in zip(beams.item[first], first, strict=True)}
    rough = np.flatnonzero(rows.channel == "roughness")
    found = np.array([of[item] for item in rows.item[rough]])
    wanted = np.minimum(rows.points[rough], 400)
    assert np.mean(np.abs(found / wanted - 1) < 0.01) > 0.95


def test_a_file_that_holds_nothing_of_the_rows_is_passed_over(case):
    "Of one patch of the first pass, nothing is in the second file"
    survey, finding, rows, _ = case
    first = np.flatnonzero((rows.channel == "roughness") & (rows.covariates["pass"] == 1.0))[:1]
    beams = collect_beams(survey, rows.select(first), finding)
    assert set(beams.item) == set(rows.item[first])


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
    growth = np.log1p(Bench(rows, survey).change(effect, no_rng()).growth[rough]).mean()
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
    changed, linear = run(case, turn) - without, Bench(rows, survey).change(turn).shift
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
    with pytest.raises(ValueError, match=r"rows have another time .* collect the beams anew"):
        run(case, rows=replace(rows, gps_time=rows.gps_time + 1.0))


def test_without_a_mounting_the_pose_can_still_be_wrong(case):
    "Clock and POS effects are simulated from the navigation centre; those of beams are refused"
    survey, finding, _, _ = case
    blind = replace(survey, mounting=None, reference=None)
    pairing = build_rows(blind, finding.matches.matched, finding.candidates, patches=60)
    rows = pairing.rows.select(pairing.rows.metric)
    blind_case = blind, finding, rows, collect_beams(blind, rows, finding)
    effect = make_effect("time_offset", magnitude=2e-3)
    left = run(blind_case, effect) - run(blind_case) - Bench(rows, blind).change(effect).shift
    for channel, rms in (("target", 2.5e-3), ("shared", 5e-4)):
        assert np.sqrt(np.nanmean(left[rows.channel == channel] ** 2)) < rms
    with pytest.raises(ValueError, match=r"range_bias acts on the range, .* no \[mounting\]"):
        run(blind_case, make_effect("range_bias", magnitude=0.01))
