"""All figures of a correction."""

import pytest

from mlscorr.report import correction_figures, draw
from mlscorr.report.figures import write_pictures
from mlscorr.report.style import svg
from tests.beds.reports import drive, fabricate, page, words
from tests.beds.tied_reports import tied_report


def test_pictures_are_written_as_png(tmp_path):
    "The same figures for another document"
    paths = write_pictures(tmp_path, *fabricate(drive())[1:])
    assert [path.name for path in paths] == ["correction.png", "map.png", "residuals.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


@pytest.mark.long
def test_ties_have_a_map_of_their_own(tmp_path):
    "ties.png and the page's figure, where something was seen twice"
    _, correction, report, residuals = tied_report()
    assert "ties" in correction_figures(correction, report, residuals)
    paths = write_pictures(tmp_path, correction, report, residuals)
    assert "ties.png" in [path.name for path in paths]


def test_the_page_has_four_figures_as_svg():
    "Position, attitude, map and residuals, each below 1 MB"
    figures = correction_figures(*fabricate(drive())[1:])
    assert list(figures) == ["correction", "attitude", "map", "residuals"]
    pictures = [svg(figure()) for figure in figures.values()]
    assert all(b"<svg" in picture and len(picture) < 1e6 for picture in pictures)


def test_a_figure_by_name_shows_itself_in_a_notebook():
    "A notebook is given a PNG; a name that is none is answered with those that are"
    figures = correction_figures(*fabricate(drive())[1:])
    assert draw(figures, "map")._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match=r"no figure 'ties' here; .* correction, att"):
        draw(figures, "ties")


def test_without_targets_no_figure_of_them_is_drawn():
    "No residuals and no span of control where there is none; the rest is there"
    correction, report = fabricate(drive(), count=0)[1:]
    figures = correction_figures(correction, report)
    assert list(figures) == ["correction", "attitude", "map"]
    assert draw(figures, "map").axes[0].get_title(loc="left") == "The trajectory"
    spans = [
        sum(line.get_color() == "#8a6d00" for line in draw(case, "attitude").axes[0].lines)
        for case in (figures, correction_figures(*fabricate(drive())[1:]))
    ]
    assert spans == [0, 2]


@pytest.mark.long
def test_without_targets_no_section_of_them_is_empty(tmp_path):
    "No residuals and no statistics on the page where no target was seen; the rest is there"
    text = words(page(tmp_path, *fabricate(drive(), count=0)))
    assert "Over time" in text and "All statistics" not in text and "Every target" not in text
