"""Pictures before and after: repeatable, from any chunks."""

import numpy as np
import pytest

from mlscorr.report.render import PictureOptions, draw
from tests.beds.street_of_points import SIZE


def test_pictures_repeat_bit_for_bit_from_any_chunks(survey, estimated, chunk, drawn):
    "Every picture of the street comes out the same from chunks of 7 777 points, on paper too"

    def small():
        for first in range(0, len(chunk), 7_777):
            yield chunk[first : first + 7_777]

    again = list(draw(survey, *estimated, PictureOptions(SIZE), chunks=small))
    assert [p.name for p in again] == [p.name for p in drawn]
    for new, old in zip(again, drawn, strict=True):
        np.testing.assert_array_equal(new.before, old.before)
        np.testing.assert_array_equal(new.after, old.after)
    assert again[0].page((520, 280)) == drawn[0].page((520, 280))


def test_there_is_an_overview_and_a_picture_of_each_target(drawn):
    "Each target has its picture, and its title says how far off it was and is"
    names = [picture.name for picture in drawn]
    assert names[0] == "overview" and {f"target-T0{k}" for k in range(1, 6)} <= set(names)
    titles = {picture.name: picture.view.title for picture in drawn}
    assert "m before, " in titles["target-T01"]


@pytest.mark.parametrize(
    "change, words",
    [
        ({"options": PictureOptions((10, 10))}, "10 x 10 pixels"),
        ({"options": PictureOptions(SIZE, colour="green")}, "no colour 'green'"),
        ({"views": ["side"]}, "no view 'side'"),
        ({"engine": "opengl"}, "no engine 'opengl'"),
        ({"chunks": lambda: iter([])}, "no points"),
    ],
)
def test_what_cannot_be_drawn_is_refused(survey, estimated, change, words):
    "Each refusal names what was asked"
    with pytest.raises(ValueError, match=words):
        list(draw(survey, *estimated, **{"options": PictureOptions(SIZE), **change}))
