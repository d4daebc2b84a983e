"""Symbols of a picture next to the points."""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.pen import Pen
from mlscorr.report.render._views import Mark, View
from mlscorr.report.render.quantities import ColourScale
from mlscorr.report.render.symbols import (
    bar_length,
    directions,
    free_corner,
    legend,
    letter,
    scale_bar,
)
from mlscorr.report.render.view import Camera
from tests.beds.street_of_points import ORIGIN, SIZE


def test_the_scale_bar_is_a_round_length_that_fits_its_corner():
    "1, 2 or 5 times a power of ten, and no longer than a quarter of the picture"
    for scale in (0.7, 7.0, 300.0):
        length = bar_length(Camera.towards(ORIGIN, 0.0, 90.0, scale, SIZE))
        assert f"{length:.0e}"[0] in "125"
        assert 0.05 * SIZE[0] < length * scale <= 0.25 * SIZE[0]


def test_the_scale_bar_is_as_long_as_it_says():
    "Black pixels in the row of the bar: as many as its length at the picture's scale, to 1 pixel"
    camera = Camera.towards(ORIGIN, 0.0, 90.0, 7.0, SIZE)
    pen = Pen(np.full((SIZE[1], SIZE[0], 3), 255, np.uint8))
    scale_bar(pen, camera, 14.0)
    dark = (pen.pixels < 128).all(axis=2).sum(axis=1).max()
    assert abs(dark - bar_length(camera) * camera.scale) <= 1


def test_the_compass_names_north_or_what_is_up():
    "From above N and E; level, up and the direction to the right"
    for elevation, names in ((90.0, {"N", "E"}), (0.0, {"up", "E"})):
        assert set(directions(Camera.towards(ORIGIN, 0.0, elevation, 7.0, SIZE))) == names


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
    assert letter(180, 1.0) == 14
    assert letter(1080, 1.0) > 18
