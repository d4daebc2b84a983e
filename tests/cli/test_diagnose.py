"""Output of a diagnosis in the terminal."""

from mlscorr.cli.diagnose import _print
from mlscorr.report.gap import gap_screen
from tests.beds.gap_documents import gap_document, round_document


def test_rounds_stand_beside_the_first_screen_not_in_its_place(capsys):
    "With --until-none the advice is said too; of something unknown no gap is said to be left"
    rounds = [round_document("unknown", after=None, shrink=None)]
    ablation = {"rounds": rounds, "alone": [], "ended": "Round 1: it ended."}
    content = gap_document("unknown", 0.9)
    _print(gap_screen(content) | content | {"ablation": ablation})
    said = capsys.readouterr()
    lines = (said.out + said.err).splitlines()
    assert "1. Have the scanner looked at." in lines
    (row,) = [line for line in lines if line.startswith("round 1: Something unknown")]
    assert row.split()[-3:] == ["38.2", "mm", "–"]
