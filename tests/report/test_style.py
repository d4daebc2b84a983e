"""Style common to all figures."""

import numpy as np

from mlscorr.report.style import (
    break_at_gaps,
    label,
    mark_handles,
    new_figure,
    nice,
    png,
    svg,
    thin,
)
from tests.beds.reports import START


def test_thinning_keeps_every_peak_and_every_edge():
    "A spike of one epoch in a long drive stays visible in at most 3000 epochs"
    gps_time = START + np.append(np.arange(30_000), np.arange(30_000) + 40_000) * 0.02
    values = np.sin(np.arange(60_000) / 5_000)[:, None]
    values[[12_345, 54_321]] = [[5.0], [-5.0]]
    gaps = np.array([[gps_time[29_999], gps_time[30_000]]])
    rows = thin(values, gps_time, gaps)
    assert len(rows) <= 3002
    assert {0, 12_345, 29_999, 30_000, 54_321, 59_999} <= set(rows.tolist())
    at, line = break_at_gaps(gps_time[rows], gaps, values[rows, 0])
    assert np.isnan(line).sum() == 1 and (np.diff(at) > 0).all()


def test_names_the_font_cannot_draw_become_question_marks():
    "A Chinese point name costs its glyphs in the figure, not the report"
    assert label("点7$\n<b>") == "?7$ <b>"
    assert label(None) == "no name"
    assert len(label("x" * 99)) == 14


def test_figures_repeat_byte_for_byte():
    "The same figure gives the same SVG and PNG, without a date"
    for write in (svg, png):
        pictures = []
        for _ in range(2):
            figure = new_figure(1.0)
            figure.add_subplot().plot([0.0, 1.0], [0.0, 2.0])
            pictures.append(write(figure))
        assert pictures[0] == pictures[1]
    assert pictures[0].startswith(b"\x89PNG")


def test_round_lengths_are_1_2_or_5():
    "Never above the value, never below two fifths of it"
    for value in np.geomspace(1e-4, 1e4, 50):
        assert 0.4 * value <= nice(value) <= value * (1 + 1e-9)


def test_the_legend_names_only_what_is_drawn():
    "Of three groups, two are there"
    words = {"control": "Control", "check": "Check", "unused": "Not used"}
    handles = mark_handles(words, {"control", "unused"})
    assert [handle.get_label() for handle in handles] == ["Control", "Not used"]
