"""Models of what the POS errs by."""

import numpy as np
import pytest

from mlscorr.gap.evidence import error_models
from mlscorr.gap.evidence.observations import shares


def test_settings_are_a_prior():
    "Weights of all settings sum to one"
    assert sum(model.weight for model in error_models()) == pytest.approx(1.0)


def test_shares_can_be_drawn_by_whatever_the_size_of_their_logs():
    "Of thousands of rows logs are as large as 1e5, where their sum alone is off by 1e-11"
    rng = np.random.default_rng(3)
    for _ in range(500):
        share = shares(1e5 + np.append(rng.uniform(0.0, 3.0, 7), -60.0))
        assert share.sum() == pytest.approx(1.0, abs=1e-15)
        assert rng.multinomial(50, share).sum() == 50
    assert shares(np.array([2.0, 2.0 + np.log(3.0)])) == pytest.approx([0.25, 0.75])
