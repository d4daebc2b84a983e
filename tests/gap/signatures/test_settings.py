"""Steps and replicas give the digits that they are said to give."""

import numpy as np
import pytest

from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.signatures import SETTINGS
from mlscorr.gap.signatures.settings import Settings


def test_steps_stand_as_close_as_the_narrowest_events():
    "2 s, and with other widths the first of these"
    assert SETTINGS.step_spacing == min(SETTINGS.widths)
    assert Settings(widths=(3.0, 9.0)).step_spacing == 3.0


@pytest.mark.parametrize("pulses, limit", [(1, 0.11), (OBSERVE.samples, 0.031)])
def test_replicas_give_a_variance_to_a_tenth(pulses, limit):
    "200 draws of one pulse know a variance to 10 %, with 12 pulses to 3 %"
    freedom = SETTINGS.random_replicas * pulses
    assert np.sqrt(2.0 / freedom) < limit
    rng = np.random.default_rng(1)
    variances = rng.normal(size=(300, freedom)).var(axis=1)
    assert variances.std() == pytest.approx(np.sqrt(2.0 / freedom), rel=0.15)


def test_events_are_sampled_finer_than_they_are_wide():
    "Twenty epochs and more across the narrowest event; widths grow threefold"
    assert min(SETTINGS.widths) / SETTINGS.epoch_step >= 20
    ratio = np.divide(SETTINGS.widths[1:], SETTINGS.widths[:-1])
    assert ((ratio > 2.0) & (ratio <= 3.0)).all()


def test_a_half_is_counted_best():
    "The relative error of a count of few pulses by its slope is least at a share of one half"
    share = np.linspace(0.05, 0.95, 181)
    information = 1.0 / (share * (1.0 - share))
    assert share[np.argmin(information)] == pytest.approx(SETTINGS.loss)
