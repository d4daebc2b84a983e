"""The map of the targets and their residuals."""

import re
from dataclasses import replace

import numpy as np

from mlscorr.estimate import NextControl
from mlscorr.evaluate import TargetRow
from mlscorr.report.maps import map_figure
from tests.beds.reports import because, drive, fabricate


def test_the_map_has_equal_scales_and_states_its_arrows():
    "A metre east is as long as a metre north, and the arrow key names length and enlargement"
    figure = map_figure(*fabricate(drive())[1:])
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    texts = [text.get_text() for text in axes.texts]
    assert {"N", "T01", "T08"} <= set(texts)
    assert any(
        re.fullmatch(r"Residual of [\d.]+ m \(arrows enlarged \d+ times\)", t) for t in texts
    )


def test_names_on_the_map_do_not_cover_one_another():
    "Of 300 targets side by side some names are left out; the outermost stay readable"
    figure = map_figure(*fabricate(drive(), 300)[1:])
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text().startswith("T")]
    boxes = [text.get_window_extent() for text in names]
    assert 10 < len(names) < 300
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_names_on_the_map_go_to_the_other_side_of_a_star():
    "A name stays legible if a control point is needed right next to its target"
    _, correction, report = fabricate(drive(), 6)
    row = report.targets[0]
    beside = 12.0 * np.array([-1.0 if row.before[0] > 0 else 1.0, 0.0])  # m
    place = NextControl(row.gps_time, *row.surveyed[:2] + beside, *[0.1] * 6, 0.2, 1, "far off")
    report = replace(report, next_control=(place,))
    axes = map_figure(correction, report).axes[0]
    axes.figure.draw_without_rendering()
    texts = {text.get_text(): text for text in axes.texts}
    (star,) = (line for line in axes.lines if line.get_marker() == "*" and len(line.get_xdata()))
    name = texts[row.name]
    box = star.get_window_extent().padded(5.0)
    assert not name.get_window_extent().overlaps(box)
    assert not name.get_window_extent().overlaps(texts["1"].get_window_extent())
    assert (name.xyann[0] > 0) == (row.before[0] > 0)


def test_a_point_far_away_does_not_shrink_the_drive():
    "A control point of another town, or at 0/0, is counted in the title and left out of the map"
    _, correction, report = fabricate(drive())
    far = TargetRow.unobserved(
        "far", None, "control", np.zeros(3), because("No target is left for it.")
    )
    figure = map_figure(correction, replace(report, targets=[*report.targets, far]))
    (axes,) = figure.axes
    assert "(far outside: 1)" in axes.get_title(loc="left")
    assert np.ptp(axes.get_xlim()) < 1e4  # m


def test_the_legend_of_the_map_is_within_its_picture():
    "With a place for the next control point, with check points and without"
    for checks in (True, False):
        _, correction, report = fabricate(drive(), checks=checks)
        row = report.targets[0]
        place = NextControl(row.gps_time, *row.surveyed[:2], *[0.1] * 6, 0.2, 1, "far off")
        close = [replace(row, after=row.after * 1e-6) for row in report.targets]
        figure = map_figure(correction, replace(report, targets=close, next_control=(place,)))
        figure.draw_without_rendering()
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= 0 and box.x1 <= figure.bbox.x1
