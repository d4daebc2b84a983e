"""Pictures on paper, and one over the other."""

import io

import numpy as np
from PIL import Image

from mlscorr.report.render import panel_size
from tests.beds.street_of_points import SIZE


def test_both_panels_are_png_of_the_asked_size(drawn):
    "For a slider: two PNGs of one size, undecorated with the points' own pixels in place"
    picture = drawn[1]
    for decorated in (True, False):
        images = [Image.open(io.BytesIO(b)) for b in picture.panels(decorated)]
        assert [image.size for image in images] == [SIZE, SIZE]
    blank = (np.asarray(images[0].convert("RGB")) == 255).all(axis=2)
    np.testing.assert_array_equal(blank, (picture.before == 255).all(axis=2))


def test_two_panels_fit_on_a_page():
    "Side by side or one above the other, with room for title and legend"
    page = (1920, 1080)
    width, height = panel_size(page)
    assert 2 * width < page[0] and height < 0.8 * page[1]
    width, height = panel_size(page, stacked=True)
    assert width < page[0] and 2 * height < 0.8 * page[1]


def test_a_page_has_the_asked_size(drawn):
    "A PNG of 520 x 280 pixels, whatever the view"
    for picture in drawn[:2]:
        assert Image.open(io.BytesIO(picture.page((520, 280)))).size == (520, 280)
