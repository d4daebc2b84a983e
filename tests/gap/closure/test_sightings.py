"""A target's board is built as it was fitted, and what lies beside it is not taken for it."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure.surroundings import SightedTarget, Sighting, board_of, sightings_of
from mlscorr.simulate.scan import FORMS, RecordedPulses
from mlscorr.survey import PointCloud
from mlscorr.targets import FittedTarget, Outline, TargetView

PLACE = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
START = 413_200.0  # s
SIZE = 0.6  # m
TURN = np.radians(25.0)
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # of a wall that faces east
SCANNER = PLACE + np.array([8.0, 0.0, 0.0])


def fitted(kind, turn=TURN, inner=0.0, axes=AXES):
    "A target as the extraction gives it, seen from the east"
    none = np.zeros(0)
    outline = Outline(np.zeros(2), 1e-6 * np.eye(2), turn, SIZE, inner, 0.0, 0.9)
    view = TargetView(np.zeros((0, 2)), none, outline, axes)
    normal = np.cross(*axes)
    cloud = PointCloud(np.zeros((0, 3)), none, none)
    return FittedTarget(
        PLACE, 1e-6 * np.eye(3), START, 0.01, normal, kind, SIZE, 0.0, 300, 0.9, cloud, view
    )


def along(u, v):
    "Places in the target's plane from its centre, along its own edges"
    return np.column_stack(np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float)))


@pytest.mark.parametrize("kind", FORMS)
def test_a_board_stands_where_its_target_was_fitted(kind):
    "Centre about the origin, three unit axes at right angles, the third along the normal"
    board = board_of(fitted(kind), PLACE - 5.0, 900.0, 100.0, 0.1)
    np.testing.assert_allclose(board.centre, [[5.0, 5.0, 5.0]], atol=1e-9)
    np.testing.assert_allclose(board.axes[0] @ board.axes[0].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(board.axes[0, 2], [1.0, 0.0, 0.0], atol=1e-12)
    assert FORMS[board.form[0]] == kind and board.size[0] == SIZE
    assert (board.bright[0], board.dark[0], board.speckle[0]) == (900.0, 100.0, 0.1)


@pytest.mark.parametrize("kind", ["square", "hole", "checkerboard", "board"])
def test_edges_are_turned_as_they_were_fitted(kind):
    "25 degrees from the view's u towards v; u, v and the normal are right-handed"
    edges = board_of(fitted(kind), PLACE).axes[0]
    np.testing.assert_allclose(edges[0], [0.0, np.cos(TURN), np.sin(TURN)], atol=1e-12)
    np.testing.assert_allclose(edges[1], [0.0, -np.sin(TURN), np.cos(TURN)], atol=1e-12)


def test_the_board_of_a_disc_stands_upright():
    "Nobody knows its turn: one edge is level, whatever turn the fit has"
    edges = board_of(fitted("circle"), PLACE).axes[0]
    assert abs(edges[0, 2]) < 1e-12 and abs(edges[1, 2]) == pytest.approx(1.0)
    lying = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    level = board_of(fitted("circle", axes=lying), PLACE).axes[0]
    np.testing.assert_allclose(level @ level.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.abs(level[2]), [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize(
    "kind, bright, dark, missing",
    [
        ("circle", [(0.0, 0.0), (0.29, 0.0)], [(0.0, 0.32)], [(0.0, 1.0)]),
        ("square", [(0.29, 0.29), (0.0, 0.0)], [], [(0.31, 0.0)]),
        ("hole", [(0.0, 0.35)], [], [(0.0, 0.0), (0.2, 0.2), (0.0, 1.0)]),
        ("checkerboard", [(0.1, 0.1), (-0.2, -0.1)], [(0.1, -0.1), (-0.2, 0.1)], [(0.31, 0.0)]),
        ("board", [(0.29, -0.29)], [], [(0.0, 0.31)]),
    ],
)
def test_paint_is_where_the_target_has_it(kind, bright, dark, missing):
    "White, black and nothing at places of a target of 0.6 m"
    board = board_of(fitted(kind), PLACE, 900.0, 100.0)
    for places, value in ((bright, 900.0), (dark, 100.0), (missing, np.nan)):
        for place in places:
            paint = board.paint(np.zeros(1, int), np.array([place]))
            np.testing.assert_array_equal(paint, [value])


def look(kind, beside=3.0, count=41, hidden=False):
    "Pulses on a grid over a target and what stands 3 m behind it, as Surroundings gives them"
    axis = np.linspace(-0.9, 0.9, count)
    place = np.array([(u, v) for u in axis for v in axis])
    board = board_of(fitted(kind), np.zeros(3), 900.0, 100.0)
    paint = board.paint(np.zeros(len(place), int), place)
    on = np.isfinite(paint)
    distance = np.full(len(place), 8.0)
    off = np.where(on, 0.0, beside)
    intensity = np.where(on, np.nan_to_num(paint), 40.0)
    if hidden:  # a post before the left side
        post = place[:, 0] < -0.2
        off = np.where(post, -2.0, off)
        intensity = np.where(post, 77.0, intensity)
    time = START + 1e-4 * np.arange(len(place))
    zero = np.zeros(len(place))
    pulses = RecordedPulses(time, zero, zero, distance + off, intensity, zero + 1.0)
    return Sighting(7, fitted(kind), PLACE), [(pulses, distance, zero + 1.0, place)], on


@pytest.mark.parametrize("kind", FORMS)
def test_what_is_behind_a_target_is_taken_from_beside_it(kind):
    "All pulses meet 3 m behind its plane without the target, of the intensity of what is there"
    sighting, parts, on = look(kind)
    sighted = SightedTarget.join(sighting, parts)
    assert on.sum() > 100
    np.testing.assert_allclose(sighted.beyond[~on], 3.0)
    np.testing.assert_allclose(sighted.behind[~on], 40.0)
    behind = sighted.beyond[on]
    assert np.mean(np.abs(behind - 3.0) < 1e-9) > 0.9


@pytest.mark.parametrize("kind", ["circle", "square", "board"])
def test_paint_is_as_bright_as_it_was_recorded(kind):
    "900 counts without speckle, and black by the simulator's ratio of reflectances"
    board = SightedTarget.join(*look(kind)[:2]).board
    assert board.bright[0] == pytest.approx(900.0)
    assert board.speckle[0] < 0.01 and 0.0 <= board.dark[0] < 0.5 * board.bright[0]


def test_a_checkerboard_has_both_paints_as_recorded():
    "900 and 100 counts"
    board = SightedTarget.join(*look("checkerboard")[:2]).board
    assert (board.bright[0], board.dark[0]) == pytest.approx((900.0, 100.0))


def test_what_stands_before_a_target_stays_there():
    "A post 2 m before its left side is met first, and is not what lies behind the right side"
    sighting, parts, on = look("square", hidden=True)
    sighted = SightedTarget.join(sighting, parts)
    left = parts[0][3][:, 0] < -0.2
    np.testing.assert_allclose(sighted.beyond[left], -2.0)
    np.testing.assert_allclose(sighted.beyond[on & ~left], 3.0)
    np.testing.assert_allclose(sighted.behind[on & ~left], 40.0)


def test_before_the_sky_there_is_nothing_behind():
    "Pulses on a target hit nothing without it if all other pulses are lost"
    sighting, [(pulses, distance, slant, place)], _ = look("square")
    inside = np.abs(place).max(axis=1) < 0.25
    parts = [(pulses[inside], distance[inside], slant[inside], place[inside])]
    sighted = SightedTarget.join(sighting, parts)
    assert np.isnan(sighted.beyond).all() and not sighted.behind.any()


def test_pulses_nearest_in_time_are_kept():
    "Of a vehicle that stands, the pulses about the time of the fit, in order, up to the limit"
    sighting, parts, _ = look("square", count=11)
    repeats = SETTINGS.target_pulses // len(parts[0][3]) + 2
    many = [
        (replace(p, gps_time=p.gps_time + 2.0 * k), d, s, place)
        for k in range(repeats)
        for p, d, s, place in parts
    ]
    sighted = SightedTarget.join(sighting, many[::-1])
    assert len(sighted.pulses) == SETTINGS.target_pulses
    assert (np.diff(sighted.pulses.gps_time) >= 0).all()
    assert sighted.pulses.gps_time[0] == START
    assert sighted.pulses.gps_time[-1] < START + 2.0 * repeats - 2.0


def test_rows_know_the_targets_that_they_are_of(case):
    "Each target row's item once, at the place where it was surveyed, with the fit of its pass"
    _, read, rows, _ = case
    sightings = sightings_of(rows, read.finding)
    on = rows.channel == "target"
    assert sorted(s.item for s in sightings) == sorted(set(rows.item[on])) and len(sightings) >= 6
    for sighting in sightings:
        row = np.flatnonzero(on & (rows.item == sighting.item))[0]
        np.testing.assert_array_equal(
            sighting.surveyed, rows.targets.position[rows.survey_item[row]]
        )
        assert abs(sighting.fitted.gps_time - rows.gps_time[row]) < 1.0
        assert np.linalg.norm(sighting.fitted.position - sighting.surveyed) < 0.3
        assert sighting.fitted.kind == rows.targets.kind[rows.survey_item[row]]


def test_rows_that_are_no_targets_have_no_sighting(case):
    "Of patches alone there is none"
    _, read, rows, _ = case
    assert sightings_of(rows.select(rows.channel != "target"), read.finding) == []
