"""Models of what the POS errs by."""

import pytest

from mlscorr.gap.infer.error_models import error_models


def test_settings_are_a_prior():
    "Weights of all settings sum to one"
    assert sum(model.weight for model in error_models()) == pytest.approx(1.0)
