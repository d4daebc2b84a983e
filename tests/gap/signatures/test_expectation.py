"""What a simulator has already is taken from the rows."""

import numpy as np

from mlscorr.effects import make_effect
from mlscorr.gap.signatures.expectation import expected
from tests.beds.short_drive import EXACT, in_simulation


def test_known_effects_can_be_taken_from_the_rows(clean):
    "What a simulator has already is the sum of its effects' changes"
    survey, rows, _, _ = clean
    effects = [make_effect(name, **EXACT[name]) for name in ("time_offset", "lever_arm")]
    truth = sum(in_simulation(clean, effect.name) for effect in effects)
    change = expected(rows, survey, effects)
    np.testing.assert_allclose(change.shift, truth, atol=0.03 * np.abs(truth).max())
