"""The pen that draws marks on pixels."""

import numpy as np

from mlscorr.report.pen import Pen
from mlscorr.report.settings import SETTINGS

WHITE = np.full((60, 80, 3), 255, np.uint8)


def test_what_is_not_drawn_on_stays_as_it_was():
    "Random pixels come back the same, bit by bit, and the picture given is not changed"
    pixels = np.random.default_rng(1).integers(0, 256, WHITE.shape, np.uint8)
    before = pixels.copy()
    pen = Pen(pixels)
    np.testing.assert_array_equal(pen.pixels, before)
    pen.dots(np.array([[40.0, 30.0]]), "black", 10.0)
    np.testing.assert_array_equal(pixels, before)
    np.testing.assert_array_equal(pen.pixels[:20], before[:20])


def test_a_dot_covers_its_area_where_it_is_put():
    "Diameter 20 pixels at (30, 25): its area to 3 %, its middle to 0.2 pixels"
    pen = Pen(WHITE)
    pen.dots(np.array([[30.0, 25.0]]), "black", 20.0)
    share = 1 - pen.pixels[..., 0] / 255
    rows, columns = np.indices(share.shape) + 0.5
    np.testing.assert_allclose(share.sum(), np.pi * 100, rtol=0.03)
    np.testing.assert_allclose((share * columns).sum() / share.sum(), 30.0, atol=0.2)
    np.testing.assert_allclose((share * rows).sum() / share.sum(), 25.0, atol=0.2)


def test_a_tint_lets_through_what_is_below():
    "92 % of white over black is 235 of 255"
    pen = Pen(np.zeros_like(WHITE))
    pen.tint(np.array([[10, 10], [40, 10], [40, 40], [10, 40]]), "white", 0.92)
    np.testing.assert_allclose(pen.pixels[25, 25], 235, atol=1)
    assert (pen.pixels[50, 50] == 0).all()


def test_an_arrow_ends_at_its_tip():
    "Nothing is drawn beyond it, and the head is wider than the shaft"
    pen = Pen(WHITE)
    pen.arrow(np.array([[10.0, 30.0], [60.0, 30.0]]), "black", 2.0, (9.0, 5.0))
    dark = pen.pixels[..., 0] < 128
    assert not dark[:, 61:].any()
    assert dark[:, 53].sum() > 2 * dark[:, 30].sum() > 0


def test_large_pictures_are_drawn_on_with_less_finesse():
    "So that memory stays within a limit"
    side = int(np.sqrt(SETTINGS.finest_picture / 4)) - 8
    pen = Pen(np.zeros((side, side, 3), np.uint8))
    assert pen.fineness == 2
    assert pen.pixels.shape == (side, side, 3)
