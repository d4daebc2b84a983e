"""Rows that can judge a cause."""

from dataclasses import replace

import numpy as np

from mlscorr.effects.vehicle import PositionStep
from mlscorr.gap.evidence import Cause
from mlscorr.gap.signatures import Bench, signature


def test_check_points_at_the_moment_of_a_jump_dont_judge(late):
    "Seen within a second of it, where no used row tells before from after; all others do"
    rows = late.rows
    time = 20.0
    near = np.abs(rows.gps_time - rows.reference.start - time) < 1.0
    near_2 = rows.two_times & (np.abs(rows.gps_time_2 - rows.reference.start - time) < 1.0)
    jump = signature(
        Bench(rows, late.survey), PositionStep, {"time": time}, np.random.default_rng(0)
    )
    size = np.array([1.0, 0.0, 0.0])
    cause = Cause("position_step", 1.0, (), ((jump, size),), jump.jacobian @ size)
    case = replace(late.found(cause), used=~(near | near_2))
    assert 0 < near.sum() < len(rows)
    np.testing.assert_array_equal(case.undecided, near)
    assert not late.found(late.cause("time_offset")).undecided.any()
