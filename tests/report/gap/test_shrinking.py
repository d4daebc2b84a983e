"""Shrinking of the gap, in words."""

import pytest

from mlscorr.report.gap import diagnosis_page
from mlscorr.report.gap._splits import closure_figure
from mlscorr.report.gap._verdict import NOTHING_TO_CLOSE, is_within, shrinking, shrunk
from tests.beds.gap_documents import gap_document
from tests.report.gap.test_verdict import summary


@pytest.mark.parametrize(
    ("shrink", "interval", "said"),
    [
        (0.42, [0.1, 0.7], "The squared gap decreased by 42 % (95 %: 10 % to 70 %)."),
        (1.0, [0.97, 1.0], "The squared gap was removed completely (95 %: 97 % to 100 %)."),
        (-0.2, [-0.5, 0.1], "The squared gap increased (95 %: −50 % to 10 %)."),
        (0.9, [None, None], "The squared gap decreased by 90 %."),
    ],
)
def test_a_gap_that_shrinks_or_grows_is_said_in_words(shrink, interval, said):
    "More than all can't be gone; a gap that grew is called so"
    document = gap_document()
    document["closure"] |= {"shrink": shrink, "interval": interval}
    assert said in summary(document)


def test_heights_of_eight_sigma_are_not_closed():
    "An axis far beyond its simulated sigma is reported before any share of the gap that is gone"
    errors = {"axes": ["E", "N", "H"], "before": [30.0, 31.0, 9.0], "after": [1.1, 0.9, 8.0]}
    closure = gap_document()["closure"] | {"shrink": 0.92, "interval": [0.8, 0.97]}
    closed = closure | {"over_sigma": errors | {"beyond": []}}
    assert shrunk(closed).startswith("The squared gap decreased by 92 %")
    left = closure | {"over_sigma": errors | {"beyond": ["H"]}}
    assert shrunk(left).startswith(
        "Not closed: errors are still 8.0 times in height the simulated sigma."
    )


def test_a_gap_within_chance_is_not_closed_by_a_share():
    "0.0 mm before, -1.2 mm after: no percentage, but that there is nothing to close"
    document = gap_document()
    document["closure"] |= {"before": 0.0, "after": -1.2, "shrink": None, "interval": [None, None]}
    fact = shrinking(document)
    assert fact.number == "0.00 mm → −1.2 mm"
    assert fact.more == NOTHING_TO_CLOSE and "%" not in fact.more
    assert NOTHING_TO_CLOSE in summary(document)


@pytest.mark.parametrize(("value", "within"), [(3.0, True), (4.0, False), (None, False)])
def test_a_gap_below_its_band_is_within_chance(value, within):
    "Up to the upper end of the band; what is not known is not"
    assert is_within(value, [-1.0, 3.5]) is within


def test_only_returns_below_their_band_are_more_than_chance():
    "10 % of the returns lost where chance loses 1 %: a gap; a position 5 mm below its band is none"
    assert not is_within(-10.0, [-1.0, 1.0], "returns")
    assert is_within(-5.0, [-1.0, 1.0], "position")


def test_what_was_not_held_out_is_not_called_so():
    "A cause of one moment is measured where it was found: words and figure say so"
    document = gap_document("position_bump", 0.96)
    assert "on held-out data" in shrinking(document).title
    document["closure"]["is_held_out"] = False
    assert "on the data from which it was estimated" in shrinking(document).title
    whole, each = closure_figure(document).axes
    assert whole.get_title(loc="left") == "All data" and not each.get_visible()


@pytest.mark.long
def test_the_page_calls_nothing_held_out_that_was_not():
    "A cause of one moment is measured where it was found, as the figure beside it says"
    document = gap_document("position_bump", 0.96)
    document["closure"]["is_held_out"] = False
    page = diagnosis_page(document, "street").html()
    assert "measured on the data from which it was estimated" in page
    assert "not used to estimate" not in page


def test_less_than_chance_leaves_is_too_much_put_in():
    "A gap of 18.7 mm that became -53.9 mm is no chance: before, below the band is; after, not"
    band = [-0.5, 1.17]
    document = gap_document("range_noise", 0.99)
    assert is_within(-53.9, band, "scatter") and not is_within(-53.9, band, "scatter", is_left=True)
    over = {"before": 18.7, "after": -53.9, "null_band": band, "kind": "scatter", "shrink": -0.88}
    document["closure"] |= over
    assert shrinking(document).more.endswith(
        "smaller than by chance: the correction was too large."
    )
    document["closure"] |= {"after": 0.3, "shrink": 0.99}
    assert shrinking(document).more.endswith("The remaining gap is within chance.")
