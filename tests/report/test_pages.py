"""Frame common to all pages."""

import re

import pytest
from jinja2 import UndefinedError

from mlscorr.report.pages import Page, data_uri, show, versions
from tests.beds.reports import Links

CONTENT = {
    "document": {"name": "<street>", "crs": None, "methods": [], "unseen": []}
    | {"rating": "green", "statements": []},
    "kinds": {},
}


def made(**changes):
    "The text of a small page"
    parts = {
        "title": "A page",
        "summary": "compare-summary.html",
        "sections": {"unseen": "Not seen", "methods": "Methods"},
        "content": CONTENT,
        "prefix": "compare-",
    }
    return Page(**parts | changes).html()


def test_sections_stand_in_their_order_and_are_linked():
    "The navigation names each section, and leads to its heading"
    html = made()
    assert Links(html).links == ["#unseen", "#methods"]
    assert html.index('<h2 id="unseen">') < html.index('<h2 id="methods">')
    assert "<title>A page</title>" in html and "&lt;street&gt;" in html


def test_styles_and_scripts_lie_in_the_page():
    "Styles and scripts of all pages, and those of one"
    assert "tr.best" not in made() and ".js .pair" in made()
    html = made(styles=("compare.css",), scripts=("slide.js",))
    assert "tr.best" in html and "const handles" in html
    assert "default-src 'none'" in html


def test_a_page_refuses_to_show_what_it_was_not_given():
    "A missing value is an error, not a blank"
    with pytest.raises(UndefinedError, match="document"):
        made(content={key: value for key, value in CONTENT.items() if key != "document"})


def test_a_page_says_when_and_by_what_it_was_written():
    "UTC, and the versions of the libraries that made the numbers"
    assert dict(versions())["mlscorr"]
    assert re.search(r"Written \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC by mlscorr [\d.]+, numpy", made())


def test_values_are_shown_in_words():
    "A value that is not a number is not determined; numbers have four figures"
    assert show(float("nan")) == "not determined" and show(1 / 3) == "0.3333"
    assert data_uri(b"a", "png") == "data:image/png;base64,YQ=="
