"""Effects of the POS: noise that has one sigma at all times, events within the drive."""

import numpy as np
import pytest

from mlscorr.effects import (
    make_effect,
)
from tests.effects.bed import (
    CONTROL,
    REFERENCE,
    TRAJECTORY,
    applied,
)


def test_position_noise_has_one_sigma_at_all_times_and_forgets_in_two_seconds():
    "Over 200 seeds: RMS as stated at any time between fixes, smooth, unrelated after 2 s"
    noise = np.array([applied("position_noise", seed).position for seed in range(200)])
    noise = (noise - TRAJECTORY.position)[:, :6000]
    assert noise.std(axis=(0, 2)) == pytest.approx(0.02, rel=0.2)  # 600 values an epoch
    assert noise.std() == pytest.approx(0.02, rel=0.02)
    assert np.abs(np.diff(noise, axis=1)).max() < 0.002  # m in 10 ms
    by_lag = [np.mean(noise[:, lag:] * noise[:, :-lag]) / 0.02**2 for lag in (1, 100, 200)]
    assert by_lag == pytest.approx([1.0, 1 / np.pi, 0.0], abs=0.03)


def test_events_outside_the_drive_and_unknown_targets_are_refused():
    "A step between the passes, a bump after the last, an outlier on a target that isn't there"
    step = make_effect("position_step", magnitude=[0, 0, 1], time=80.0)
    with pytest.raises(ValueError, match=r"position_step at 80 s is outside .* 1 gaps"):
        step.apply(TRAJECTORY, REFERENCE)
    bump = make_effect("position_bump", magnitude=[0, 0, 1], time=200.0, width=5.0)
    with pytest.raises(ValueError, match=r"position_bump at 200 s .* ends after 160\.0 s"):
        bump.apply(TRAJECTORY, REFERENCE)
    outlier = make_effect("target_outlier", magnitude=[0, 0, 1], target="T3")
    with pytest.raises(ValueError, match=r"'T3', which is not among the 6 targets; .* 'T03'"):
        outlier.apply(CONTROL, REFERENCE)
