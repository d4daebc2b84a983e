"""Tables of figures."""

from mlscorr.gap.infer.decision import OPERATING_POINTS
from mlscorr.gap.train.report import print_figures


def test_a_table_has_a_column_each_operating_point(capsys):
    "A rate of 0.25 of 8 cases stands under each, three digits"
    print_figures({title: {"clean": (0.25, 8)} for title in OPERATING_POINTS})
    head, row = capsys.readouterr().out.splitlines()
    assert head.split() == ["cases", *OPERATING_POINTS]
    assert row.split() == ["clean", "8", *["0.250"] * len(OPERATING_POINTS)]
