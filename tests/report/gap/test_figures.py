"""Figures of a diagnosis and of a plan by name."""

import pytest

from mlscorr.report import draw
from mlscorr.report.gap import diagnosis_figures, plan_figures
from tests.beds.gap_documents import gap_document, plan_document


def test_each_figure_has_a_name():
    "Figures of a page, and none if a document has nothing to show"
    document = gap_document()
    names = ["where", "innovations", "evidence", "closure", "map", "channels", "separability"]
    assert list(diagnosis_figures(document)) == names
    assert list(plan_figures(plan_document())) == ["detectable", "accuracy", "map", "separability"]
    assert "where" not in diagnosis_figures(document | {"where": []})


def test_a_name_without_a_figure_is_answered_with_those_that_are():
    "As where a document has nothing to show"
    with pytest.raises(ValueError, match=r"no figure 'wher' here; .* where, innovations"):
        draw(diagnosis_figures(gap_document()), "wher")
    assert draw(plan_figures(plan_document()), "map").axes


def test_names_on_the_map_do_not_cover_one_another():
    "Of 60 targets a few metres apart some names are left out; the others can be read"
    document = gap_document()
    first = document["map"]["targets"][0]
    east, north, *up = first["position"]
    document["map"]["targets"] = [
        first | {"name": f"T{k:02d}", "position": [east + 7.0 * k, north + k % 3, *up]}
        for k in range(60)
    ]
    figure = draw(diagnosis_figures(document), "map")
    figure.draw_without_rendering()
    for panel in figure.axes[:2]:
        names = [text for text in panel.texts if text.get_text().startswith("T")]
        boxes = [text.get_window_extent() for text in names]
        assert 10 < len(names) < 60
        assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
