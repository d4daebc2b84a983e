"""The small figures of targets in the report."""

import base64
import re

import numpy as np
import pytest

import mlscorr
from mlscorr.report.target_figures import _upright, target_drawings


@pytest.fixture(scope="module")
def corrected(street):
    "The corrected street"
    return mlscorr.correct(mlscorr.read_survey(street))


def test_every_observation_has_a_small_figure(corrected):
    "One PNG below 40 kB for each target and pass, with its name"
    drawings = target_drawings(corrected.targets, corrected.fitted)
    assert len(drawings) == len(corrected.fitted) == 5
    for title, picture in drawings:
        assert re.fullmatch(r"T\d\d, pass 1", title)
        assert picture.startswith(b"\x89PNG")
        assert len(picture) < 40_000


def test_figures_show_targets_upright_as_the_scanner_sees_them(corrected):
    "Right, up and towards the scanner are a right-handed system, and up is up where it can be"
    for target in corrected.fitted.values():
        right, up = _upright(target) @ target.view.axes
        assert np.allclose(np.cross(right, up), target.normal, atol=1e-6)
        assert up[2] > 0.7 or up[1] > 0.5


def test_the_report_holds_the_figures(commanded):
    "The section on targets stands in report.html, one image for each observation"
    process, out = commanded
    assert process.returncode == 0, process.stderr
    page = (out / "report.html").read_text(encoding="utf-8")
    section = page[page.index('<h2 id="targets">') : page.index('<h2 id="model">')]
    pictures = re.findall(r'src="data:image/png;base64,([^"]+)" alt="T\d\d, pass 1"', section)
    assert len(pictures) == 5
    assert all(base64.b64decode(picture).startswith(b"\x89PNG") for picture in pictures)
