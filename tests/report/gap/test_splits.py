"""Figures of where the gap lies and how far it shrinks."""

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from mlscorr.report.gap._splits import closure_figure, where_figure
from tests.beds.gap_documents import gap_document


def whisker(document):
    "Ends of the black whisker on the gap after"
    panel = closure_figure(document).axes[0]
    (lines,) = [c.lines[2][0] for c in panel.containers if hasattr(c, "lines")]
    return np.sort(lines.get_segments()[0][:, 1])


def test_the_whisker_holds_what_the_interval_leaves():
    "16.42 mm of which 93.1 to 99.4 % of the square goes leave 1.27 to 4.31 mm"
    assert whisker(gap_document()) == pytest.approx(
        [16.42 * 0.006**0.5, 16.42 * 0.069**0.5], rel=1e-6
    )


def test_without_an_interval_or_folds_there_is_none():
    "A closure that nobody could test shows its bars alone"
    document = gap_document()
    document["closure"] |= {"interval": [None, None], "folds": []}
    figure = closure_figure(document)
    assert not [c for c in figure.axes[0].containers if hasattr(c, "lines")]
    assert not figure.axes[1].get_visible()


def test_the_share_stands_on_the_bin_that_holds_more_than_its_rows():
    "Of four bins with as many rows, the one with 70 % of the gap, out of the band, has its number"
    split = {"by": "time", "name": "time", "unit": "s", "edges": [0.0, 1.0, 2.0, 3.0, 4.0]}
    split |= {"count": [10] * 4, "before": [2.0, 9.0, 2.0, 2.0], "after": [0.0] * 4}
    split |= {"share": [0.1, 0.7, 0.1, 0.1], "null_band": [[-3.0, 4.0]] * 4}
    (text,) = where_figure(gap_document(where=[split])).axes[0].texts
    assert (text.get_text(), text.xy) == ("70 %", (1.5, 9.0))
    split["share"] = [0.25] * 4
    assert not where_figure(gap_document(where=[split])).axes[0].texts


@pytest.mark.parametrize(
    ("by", "extent", "drawn"),
    [
        ("time", {"low": 1.5, "high": 3.0, "share": 0.9, "rows": 0.3}, [(1.5, 3.0)]),
        ("time", {"low": 0.5, "high": 3.5, "share": 0.8, "rows": 0.75}, []),
        (
            "scan_angle",
            {"low": 3.5, "high": 361.0, "share": 0.9, "rows": 0.3},
            [(3.5, 4.0), (0.0, 1.0)],
        ),
    ],
)
def test_the_stretch_in_which_the_cause_acts_is_shaded(by, extent, drawn):
    "From its low to its high end, over the turn of an angle; not what acts nearly everywhere"
    split = {"by": by, "name": by, "unit": "s", "edges": [0.0, 1.0, 2.0, 3.0, 4.0]}
    split |= {"count": [10] * 4, "before": [2.0] * 4, "after": [0.0] * 4, "share": [0.25] * 4}
    split |= {"null_band": [[-3.0, 4.0]] * 4, "extent": extent}
    panel = where_figure(gap_document(where=[split])).axes[0]
    pink = [p for p in panel.patches if isinstance(p, Rectangle)]
    assert [(p.get_x(), p.get_x() + p.get_width()) for p in pink] == drawn
