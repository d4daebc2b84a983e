"""The figure of what can be told apart."""

from mlscorr.report.gap._evidence import classes_in_order
from tests.beds.gap_documents import gap_document


def test_a_box_holds_the_parameters_that_look_alike():
    "Lever arm up and vertical datum stand side by side in one box, the other parts outside"
    separability = gap_document()["separability"]
    names = separability["correlation"]["names"]
    order, boxes = classes_in_order(separability)
    assert sorted(order) == list(range(len(names))) and boxes == [(0, 1)]
    assert {names[i] for i in order[:2]} == {"lever_arm up", "vertical_datum"}
