"""Tables of a channel."""

import numpy as np
import pytest

from mlscorr.gap.contrast.tables import Binning, ContrastTable

RATIO = np.log([1.0, 0.5, 0.99])
TABLE = ContrastTable(
    "range",
    (0, 10, 20, 30),
    ("0 to 10", "10 to 20", "20 to 30"),
    np.full(3, 8.0),
    np.full(3, 9.0),
    RATIO,
    np.array([0.01, 0.02, 1e-4]),
    np.full(3, 50.0),
)


def test_a_difference_must_be_beyond_chance():
    "Half as much differs, and a percent that is known to a tenth of itself"
    assert TABLE.judged(10).differs.tolist() == [False, True, True]


def test_a_ratio_is_written_as_one():
    "0.5 ± 0.01 of log ratios, and the bins by their edges"
    content = TABLE.judged(10).document(is_ratio=True)
    assert content["value"] == pytest.approx([1.0, 0.5, 0.99])
    assert content["sigma"][1] == pytest.approx(0.01)
    assert content["edges"] == [0, 10, 20, 30]


def test_things_outside_all_bins_are_in_none():
    "Unknown, below and beyond: -1"
    split = Binning("range", np.array([np.nan, -3.0, 5.0, 30.0, 29.9]), TABLE.edges)
    assert split.number(split.edges).tolist() == [-1, -1, 0, -1, 2]
