"""The map of what was seen twice."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.report.maps import tie_figure
from mlscorr.report.style import svg
from tests.beds.tied_reports import tied_report


def test_colours_are_misfits_in_millimetres_on_one_scale():
    "Each used tie has its misclosure before above, what remains of it below, none under 1 mm"
    _, correction, _, residuals = tied_report(wrong=0.2)
    before, after, _ = tie_figure(correction, residuals).axes
    used = residuals.used
    for panel, misfit in ((before, residuals.ties.misclosure), (after, residuals.after)):
        (dots,) = panel.collections
        expected = np.sort(np.maximum(1000 * np.abs(misfit[used]), 1.0))
        np.testing.assert_allclose(np.sort(dots.get_array()), expected)
        assert (dots.norm.vmin, panel.get_aspect()) == (1.0, 1.0)
    assert before.collections[0].norm.vmax == after.collections[0].norm.vmax


def test_the_worst_place_is_not_hidden():
    "Dots are drawn in the order of their misfit, the largest last"
    _, correction, _, residuals = tied_report()
    for panel in tie_figure(correction, residuals).axes[:2]:
        assert (np.diff(panel.collections[0].get_array()) >= 0).all()


def test_a_legend_names_what_is_drawn_and_nothing_else():
    "Refused ties only where there are any; a map without a used tie still has its crosses"
    _, correction, _, residuals = tied_report()
    for used, expected in ((True, ["Used"]), (False, ["Rejected"])):
        every = replace(residuals, used=np.full(len(residuals.used), used))
        figure = tie_figure(correction, every)
        labels = [text.get_text() for text in figure.legends[0].texts]
        assert len(labels) == 2 and labels[1].startswith(expected[0])


@pytest.mark.long
def test_a_hundred_thousand_ties_make_a_small_figure():
    "Dots are pixels: the bytes of the page don't grow with the survey"
    _, correction, _, residuals = tied_report()
    rows = np.random.default_rng(1).integers(len(residuals.used), size=100_000)
    many = replace(
        residuals, ties=residuals.ties[rows], used=residuals.used[rows], after=residuals.after[rows]
    )
    assert len(svg(tie_figure(correction, many))) < 600_000  # B
