"""Changes of the rows by single effects."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.signatures import Bench, check_mounting


def test_a_change_grows_with_its_effect(clean):
    "A range bias of 2 cm shifts rows twice as far as one of 1 cm, to a micrometre"
    survey, rows, _, _ = clean
    small, large = (
        Bench(rows, survey).change(make_effect("range_bias", magnitude=size)).shift
        for size in (0.01, 0.02)
    )
    assert np.abs(small).max() > 1e-3
    np.testing.assert_allclose(2 * small, large, atol=1e-6)


def test_beams_that_nobody_knows_are_refused(clean):
    "Without a mounting an effect on ranges is an error that names both; one on the clock is none"
    survey = replace(clean[0], mounting=None)
    check_mounting(survey, [make_effect("time_offset", magnitude=1e-3)])
    with pytest.raises(ValueError, match=r"range_bias acts on the range, .* no \[mounting\]"):
        check_mounting(survey, [make_effect("range_bias", magnitude=0.01)])


def test_a_jump_moves_what_was_measured_after_it_alone(clean):
    "A row two epochs before a jump of 2 m stays, later ones move by all of it, to a nanometre"
    survey, rows, _, _ = clean
    trajectory = survey.trajectory
    times = np.unique(clean[1].gps_time)
    number = trajectory.segment(times)
    earlier = np.flatnonzero(number[1:] == number[:-1])[0]
    start = times[earlier] + 2 * np.median(np.diff(trajectory.gps_time))
    size = (0.0, 0.0, 2.0)
    time = float(start - rows.reference.start)
    jump = make_effect("position_step", magnitude=size, time=time)
    after = (rows.gps_time >= start) & (trajectory.segment(rows.gps_time) == number[earlier])
    shift = Bench(rows, survey).change(jump).shift
    assert after.any()
    np.testing.assert_allclose(shift, after * (rows.direction @ size), atol=1e-9)
