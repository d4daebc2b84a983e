"""The nearest point of each pixel."""

import numpy as np

from mlscorr.report.render._zbuffer import Canvas
from mlscorr.report.render.view import Camera
from tests.beds.street_of_points import ORIGIN, SIZE, scattered


def test_the_nearest_point_is_seen():
    "Of two points on one pixel the upper one is seen from above, in either order"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 10.0, SIZE)
    pair = ORIGIN + np.array([[0.02, 0.02, 0.0], [0.03, 0.03, 0.001]])
    for order in ([0, 1], [1, 0]):
        canvas = Canvas.blank(camera)
        canvas.draw(pair[order], np.array([1.0, 2.0])[order])
        assert canvas.value[canvas.drawn] == 2.0


def test_order_and_chunks_change_no_pixel():
    "The same points give the same canvas shuffled, in pieces, and with equals in depth"
    camera = Camera.towards(ORIGIN, 30.0, 45.0, 8.0, SIZE)
    xyz = scattered(20_000)
    xyz[10_000:] = xyz[:10_000]
    value = np.random.default_rng(2).uniform(0, 9, len(xyz))
    whole = Canvas.blank(camera)
    pieces = Canvas.blank(camera)
    whole.draw(xyz, value)
    order = np.random.default_rng(3).permutation(len(xyz))
    for part in np.array_split(order, 7):
        pieces.draw(xyz[part], value[part])
    np.testing.assert_array_equal(whole.pixels, pieces.pixels)


def test_growing_points_equals_drawing_discs():
    "Discs grown after drawing are those that drawing each point as a disc would have given"
    camera = Camera.towards(ORIGIN, 30.0, 45.0, 8.0, SIZE)
    xyz = scattered(300)
    value = np.arange(300.0)
    canvas = Canvas.blank(camera)
    plain = Canvas.blank(camera)
    canvas.draw(xyz, value)
    pixel, depth = camera.project(xyz)
    column, row = np.floor(pixel).astype(int).T
    for i in range(-2, 3):
        for k in range(-2, 3):
            if i * i + k * k <= 4:
                flat = np.column_stack([column + k + 0.5 - 120, 90 - row - i - 0.5]) / camera.scale
                plain.draw(camera.focus + np.column_stack([flat, depth]) @ camera.axes, value)
    inside = (slice(5, -5), slice(5, -5))  # at the rim points off the picture reach in
    np.testing.assert_array_equal(canvas.grown(2.0).value[inside], plain.value[inside])


def test_what_is_drawn_comes_back_in_metres():
    "Points of the canvas lie where they were, to half a pixel of 0.1 m and 0.01 mm in depth"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 10.0, SIZE)
    canvas = Canvas.blank(camera)
    place = np.array([[2.03, 0.96, 3.0]])
    canvas.draw(ORIGIN + place, np.array([7.0]))
    np.testing.assert_allclose(canvas.points, place, atol=0.05)
    np.testing.assert_allclose(canvas.points[:, 2], 3.0, atol=1e-4)


def test_what_lies_behind_an_edge_is_darker():
    "Ground beside a wall that stands nearer to the eye; a slope keeps its light"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 1.0, SIZE)
    columns, rows = np.meshgrid(np.arange(-100.0, 100.0), np.arange(-80.0, 80.0))
    plan = np.column_stack([columns.ravel(), rows.ravel()]) + 0.5
    step = Canvas.blank(camera)
    slope = Canvas.blank(camera)
    step.draw(ORIGIN + np.column_stack([plan, 50.0 * (plan[:, 0] > 0)]), plan[:, 0])
    slope.draw(ORIGIN + np.column_stack([plan, plan[:, 0]]), plan[:, 0])
    assert step.light[90, 119] < 0.9 and step.light[90, 60] == 1.0
    assert slope.light.min() == 1.0


def test_points_behind_the_eye_are_not_drawn():
    "A perspective camera sees only what lies before it"
    camera = Camera.towards(ORIGIN, 0.0, 0.0, 10.0, SIZE, 40.0)
    canvas = Canvas.blank(camera)
    for beyond in (-camera.distance - 0.1, -2 * camera.distance):
        canvas.draw(ORIGIN + np.array([[0.0, beyond, 0.0]]), np.array([1.0]))
    assert not canvas.drawn.any()
