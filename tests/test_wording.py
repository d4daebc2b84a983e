"""Numbers in words: figures, units and lists that a surveyor reads without stumbling."""

import numpy as np
import pytest

from mlscorr import wording


@pytest.mark.parametrize("share", [0.0004, 0.004, 0.02, 0.5, 0.985, 0.996, 0.99996])
def test_a_share_is_never_rounded_to_nothing_or_to_all(share):
    "Only zero is 0 %, only one is 100 %"
    assert wording.percent(share) not in ("0 %", "0.0 %", "100 %", "100.0 %")
    assert wording.percent(0.0) == "0 %" and wording.percent(1.0) == "100 %"


@pytest.mark.parametrize("value", [None, float("nan"), np.nan])
def test_what_was_not_determined_is_a_dash(value):
    "Whichever words a number has"
    for words in (wording.number, wording.percent, wording.millimetres, wording.plain):
        assert words(value) == wording.DASH
    assert wording.size(value, 0.1) == wording.signed(value) == wording.DASH


def test_nothing_is_less_than_zero():
    "A value that its sigma rounds to zero has no sign"
    assert wording.size(-1e-6, 0.01) == "0 mm ± 10 mm"
    assert wording.number(-1e-9) == "0.000" and wording.signed(-1e-9) == "0.00 mm"
