"""Views of the cloud in a report."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.report.cloud import CloudViews, close_ups, viewer_data
from mlscorr.report.correction_page import write_report
from mlscorr.report.render import Picture
from mlscorr.report.render._views import View
from mlscorr.report.render.quantities import ColourScale
from mlscorr.report.render.view import Camera
from mlscorr.report.settings import SETTINGS
from tests.beds.reports import drive, fabricate, words
from tests.beds.street_of_points import ORIGIN, street, target


def test_of_many_targets_the_worst_and_evenly_spread_ones_are_drawn():
    "24 of 300: the 8 that were predicted worst, and others from the first to the last"
    rng = np.random.default_rng(5)
    rows = [target(f"T{k}", ORIGIN, left_out=[0.01, 0.0, 0.0]) for k in range(300)]
    worst = sorted(rng.choice(np.arange(1, 299), 8, replace=False))
    for k in worst:
        rows[k] = replace(rows[k], left_out=np.array([0.0, 0.5, 0.0]))
    names = close_ups(rows)
    assert len(names) == 24 and {f"T{k}" for k in worst} <= set(names)
    assert names[0] == "T0" and names[-1] == "T299"
    numbers = [int(name[1:]) for name in names if int(name[1:]) not in worst]
    assert max(np.diff(numbers)) < 30
    assert close_ups(rows[:24]) == [f"T{k}" for k in range(24)]


@pytest.mark.long
def test_24_targets_fit_in_15_megabytes_whatever_they_look_like(tmp_path):
    "Pictures of pure noise, which no format makes smaller; names that hold a script don't run"
    rng = np.random.default_rng(6)
    evil = "</script><script>alert(1)</script>"
    survey, correction, report = fabricate(drive(), 24)
    report.targets[0] = replace(report.targets[0], name=evil)

    def picture(name, size):
        camera = Camera.towards(ORIGIN, 0.0, 30.0, 100.0, size)
        sides = rng.integers(0, 256, (2, size[1], size[0], 3), dtype=np.uint8)
        return Picture(View(name, name, "", camera, "intensity"), *sides, ColourScale(0.0, 1.0))

    names = [f"target-{row.name}" for row in report.targets[:3]]
    close = [picture(name, SETTINGS.close_up) for name in names]
    large = [picture(name, SETTINGS.panel) for name in ("overview", "section")]
    cloud = street(100_000, rng)
    scene = viewer_data(correction, cloud, report.targets, report.targets)
    path = tmp_path / "report.html"
    views = CloudViews((*large, *close), scene, 7)
    write_report(path, survey, correction, report, views)
    html = path.read_text(encoding="utf-8")
    each = sum(len(png) for png in close[0].panels()) * 4 / 3  # in base64
    assert each > 200_000
    assert path.stat().st_size + 21 * each < 15e6
    assert "<script>alert" not in html
    assert html.count('<input type="range"') == 6
    text = words(html)
    assert "show one in 7 points" in text and "3 of 24 targets" in text


def test_the_page_shows_the_pictures_of_its_survey(commanded):
    "Overview, each target that was seen, the 3D view, and the verdict on check points"
    html = (commanded[1] / "report.html").read_text(encoding="utf-8")
    text = words(html)
    assert "3D RMSE at independent check points" in text
    for name in ("T01", "T02", "T03", "T04", "T05"):
        assert f"{name}: how much of the picture" in html
    assert "not conformant" in text and 'id="scene"' in html
