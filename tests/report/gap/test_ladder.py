"""The ladder of evidence holds what a reader looks for."""

from mlscorr.effects import EFFECTS
from mlscorr.report.gap._evidence import ladder
from tests.beds.gap_documents import gap_document


def test_nothing_wrong_and_something_unknown_are_always_on_the_ladder():
    "However many labels are better, none, unknown and the best ones are drawn"
    many = [
        {"label": f"time_offset+{kind.name}", "log_evidence_ratio": 50.0 + i, "probability": 0.01}
        for i, kind in enumerate(EFFECTS * 2)
    ]
    last = [
        {"label": name, "log_evidence_ratio": -3.0, "probability": 0.0}
        for name in ("dropout", "unknown", "none")
    ]
    drawn = [one["label"] for one in ladder(gap_document(evidence=many + last))]
    assert drawn[0] == many[-1]["label"] and drawn[-2:] == ["unknown", "none"]
    assert "dropout" not in drawn
