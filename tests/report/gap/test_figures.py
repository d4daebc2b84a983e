"""Figures of a diagnosis and of a plan by name."""

import pytest

from mlscorr.report.gap import diagnosis_figures, draw, plan_figures
from tests.beds.gap_documents import gap_document, plan_document


def test_each_figure_has_a_name():
    "Those of a page, and nothing where a document has nothing to show"
    document = gap_document()
    names = ["where", "innovations", "evidence", "closure", "map", "channels", "separability"]
    assert list(diagnosis_figures(document)) == names
    assert list(plan_figures(plan_document())) == ["detectable", "accuracy", "map", "separability"]
    assert "where" not in diagnosis_figures(document | {"where": []})


def test_a_name_without_a_figure_is_answered_with_those_that_are():
    "As where a document has nothing to show"
    with pytest.raises(ValueError, match="no figure 'wher' here: where, innovations"):
        draw(diagnosis_figures(gap_document()), "wher")
    assert draw(plan_figures(plan_document()), "map").axes
