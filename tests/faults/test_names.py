"""Names from files reach neither the terminal's control nor a parser of formulas."""

import matplotlib
import matplotlib.pyplot as plt
import pytest

from mlscorr.cli import warn
from mlscorr.io.store import shown
from mlscorr.report.style import STYLE, label


def test_no_name_moves_the_cursor(capsys):
    "Escape sequences are written out; lines stay lines"
    warn("Not used: \x1b[2J\x1b]0;title\x07T01\u202e: no reason\nnext")
    assert capsys.readouterr().err == (
        "Not used: \\x1b[2J\\x1b]0;title\\x07T01\\u202e: no reason\nnext\n"
    )
    assert shown("x" * 500) == "x" * 57 + "..."


@pytest.mark.parametrize("name", [r"$\frac{a_{$", "$x$", "100 $", r"\$"])
def test_a_name_with_dollars_is_drawn_as_it_is(name, tmp_path):
    "matplotlib's mathtext, which ends a run over half a formula, sees no name"
    with matplotlib.rc_context(STYLE):
        figure = plt.figure()
        text = figure.text(0.1, 0.1, label(name))
        figure.savefig(tmp_path / "a.svg")
        plt.close(figure)
    assert text.get_text() == name and not text.get_parse_math()
