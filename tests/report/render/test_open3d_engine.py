"""Open3D in a process of its own."""

from functools import partial

import numpy as np
import pytest

from mlscorr.pipeline import doctor
from mlscorr.report.render import PictureOptions, draw
from mlscorr.report.render import _sheet as sheet
from tests.beds.street_of_points import SIZE


@pytest.mark.parametrize(
    "program, words, limit",  # s
    [
        ("import os; os.abort()", "exit code -6", 600.0),
        ("import time; time.sleep(600)", "no picture within", 1.0),
        ("raise ImportError('libGL.so.1')", "libGL.so.1", 600.0),
        ("pass", "without a picture", 600.0),
    ],
)
def test_a_broken_driver_costs_a_warning_and_no_picture(
    survey, estimated, drawn, program, words, limit, tmp_path, monkeypatch
):
    "If the child aborts, hangs or lacks a library, the z-buffer draws the same picture"
    child = tmp_path / "child.py"
    child.write_text(program)
    monkeypatch.setattr(sheet, "CHILD", child)
    hurried = partial(sheet.draw_pair, timeout=limit)
    monkeypatch.setattr(sheet, "draw_pair", hurried)
    with pytest.warns(UserWarning, match=words):
        (picture,) = draw(survey, *estimated, PictureOptions(SIZE), ["overview"], "open3d")
    np.testing.assert_array_equal(picture.before, drawn[0].before)


@pytest.mark.long
def test_open3d_draws_what_the_z_buffer_draws(survey, estimated, drawn):
    "Both engines put points of the same colours on the same pixels, but for their rims"
    (drawing,) = (part for part in doctor().parts if part.name == "off-screen picture")
    if not drawing.ok:
        pytest.skip(f"Open3D draws no off-screen picture here: {drawing.state}")
    (picture,) = draw(survey, *estimated, PictureOptions(SIZE), ["overview"], "open3d")
    painted, drawn_here = ((p != 255).any(axis=2) for p in (picture.before, drawn[0].before))
    assert (painted & drawn_here).sum() > 0.8 * (painted | drawn_here).sum()
