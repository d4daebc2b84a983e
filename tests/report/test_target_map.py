"""The map of the targets and their residuals."""

import re

from mlscorr.report.target_map import map_figure
from tests.beds.reports import drive, fabricate


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
