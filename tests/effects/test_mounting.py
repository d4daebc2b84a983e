"""Effects of the mounting: the corrections that restore it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.effects.bed import (
    MOUNTING,
    applied,
)


def test_corrections_of_the_mounting_restore_it():
    "lever_arm_true = recorded + c and R_true = Exp(c) R_recorded, c about the body axes"
    arm = applied("lever_arm")
    boresight = applied("boresight")
    restored = Rotation.from_rotvec([0.004, -0.003, 0.006], degrees=True) * boresight.boresight
    assert arm.lever_arm + np.array([0.02, -0.01, 0.03]) == pytest.approx(
        MOUNTING.lever_arm, abs=1e-15
    )
    assert (restored * MOUNTING.boresight.inv()).magnitude() < 1e-15  # rad
