"""On which pixel a point lands."""

import numpy as np
import pytest

from mlscorr.report.render._zbuffer import Canvas
from mlscorr.report.render.view import Camera
from tests.beds.street_of_points import ORIGIN, SIZE


@pytest.mark.parametrize("view_angle", [0.0, 40.0])
def test_a_point_lands_on_the_pixel_that_its_coordinates_say(view_angle):
    "From above, a point 2 m east and 1 m north of the focus lies 20 pixels right and 10 up"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 10.0, SIZE, view_angle)
    canvas = Canvas.blank(camera)
    canvas.draw(ORIGIN + np.array([[2.05, 0.95, 0.0]]), np.array([7.0]))
    (row,), (column,) = np.nonzero(canvas.drawn)
    assert (column, row) == (120 + 20, 90 - 10)
    assert canvas.value[row, column] == 7.0


def test_perspective_shrinks_what_is_far():
    "At twice the distance a length takes half the pixels"
    camera = Camera.towards(ORIGIN, 0.0, 0.0, 10.0, SIZE, 40.0)
    beyond = ORIGIN + np.array([[4.0, camera.distance, 0.0]])
    pixel, depth = camera.project(beyond)
    np.testing.assert_allclose(pixel, [[120 + 20, 90]], atol=1e-9)
    np.testing.assert_allclose(depth, camera.distance)
