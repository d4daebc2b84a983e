"""What stands beside the points."""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.render._views import Mark, View
from mlscorr.report.render.quantities import ColourScale
from mlscorr.report.render.symbols import compass, free_corner, legend, letter, scale_bar
from mlscorr.report.render.view import Camera
from tests.beds.street_of_points import ORIGIN, SIZE


def axes_of(size=SIZE):
    "Axes in pixels on a figure of a size"
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100)
    return figure.add_axes((0, 0, 1, 1), xlim=(0, size[0]), ylim=(size[1], 0))


def test_the_scale_bar_is_as_long_as_it_says():
    "A round number of metres at the picture's scale, to 1e-9 pixels"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 7.0, SIZE)
    axes = axes_of()
    scale_bar(axes, camera)
    left, right = axes.lines[0].get_xdata()
    metres = float(axes.texts[0].get_text().removesuffix(" m"))
    np.testing.assert_allclose(right - left, metres * camera.scale, atol=1e-9)


def test_the_compass_names_north_or_what_is_up():
    "From above N and E; level, up and the direction to the right"
    for elevation, names in ((90.0, {"N", "E"}), (0.0, {"up", "E"})):
        axes = axes_of()
        compass(axes, Camera.towards(ORIGIN, 0.0, elevation, 7.0, SIZE), (1, 1))
        assert {text.get_text() for text in axes.texts} == names


def test_the_compass_stands_where_the_fewest_points_are():
    "Never in the scale bar's corner; else in the emptiest one"
    picture = np.full((180, 240, 3), 255, np.uint8)
    picture[90:, 120:] = 0
    assert free_corner(picture) == (1, 0)
    picture[:90, 120:] = 0
    assert free_corner(picture) == (0, 0)


def test_the_legend_names_what_the_view_shows():
    "A colour bar and the marks of a target; swatches where two visits are told apart"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 7.0, SIZE)
    outline = Mark("surveyed", ORIGIN + np.zeros((5, 3)))
    for colour, words in (("height", "Surveyed position"), ("visit", "Scanned in the first")):
        figure = Figure(figsize=(9, 5), dpi=100)
        view = View("a", "", "", camera, colour, marks=((outline,), (outline,)))
        legend(figure, view, ColourScale(0.0, 1.0), (0.012, 0.11))
        labels = [text.get_text() for text in figure.legends[0].texts]
        assert any(label.startswith(words) for label in labels)
        assert len(figure.axes) == (colour == "height")


def test_letters_can_be_read_on_small_pictures():
    "14 pixels at least, and larger on a large page"
    small, large = (letter(axes_of(size), 1.0) for size in ((240, 180), (1920, 1080)))
    np.testing.assert_allclose(small, 14 * 0.72)
    assert large > small
