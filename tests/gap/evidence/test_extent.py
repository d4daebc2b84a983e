"""The stretch of a covariate in which a cause acts."""

import numpy as np
import pytest

from mlscorr.gap.evidence.where import extent_of


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_stretch_is_told_to_a_row(noise):
    "A shift between 40 and 60 m, among noise of a tenth of it, to 1 m"
    rng = np.random.default_rng(1)
    away = np.sort(rng.uniform(0.0, 200.0, 2000))
    shift = np.where((away > 40.0) & (away < 60.0), 1.0, 0.0) + noise * rng.standard_normal(2000)
    extent = extent_of(away, shift**2)
    assert (extent.low, extent.high) == pytest.approx((40.0, 60.0), abs=1.0)
    assert extent.share > 0.9
    assert extent.rows == pytest.approx(0.1, abs=0.02)


def test_rows_that_see_nothing_of_it_do_not_part_a_stretch():
    "Two of three rows, along other axes, stay where they are: the stretch is the same to 2 s"
    time = np.repeat(np.arange(200.0), 3) + 413_200.0
    shift = np.where((time > 413_250.0) & (time < 413_280.0), 1.0, 0.0)
    shift[np.arange(600) % 3 > 0] = 0.0
    extent = extent_of(time, shift**2)
    assert (extent.low, extent.high) == pytest.approx((413_250.0, 413_280.0), abs=2.0)


def test_a_sector_over_the_turn_is_one():
    "From 170 over 180 to -160 deg: 30 deg wide, though its angles lie at both ends"
    angle = np.linspace(-180.0, 140.0, 641)
    angle = np.append(angle, np.linspace(165.0, 179.5, 30))
    square = ((angle > 169.0) | (angle < -160.0)).astype(float)
    extent = extent_of(angle, square, 360.0)
    assert extent.high - extent.low == pytest.approx(31.0, abs=2.0)
    assert extent.low == pytest.approx(169.5, abs=1.0)


def test_a_stretch_ends_before_a_gap():
    "Rows of two passes, 60 s apart: what acts in all of the first doesn't reach into the gap"
    time = np.append(np.arange(50.0), np.arange(110.0, 160.0))
    extent = extent_of(time, (time < 60.0).astype(float))
    assert (extent.low, extent.high) == (0.0, 49.0)


@pytest.mark.parametrize("square", [np.zeros(50), np.ones(50)])
def test_what_acts_nowhere_or_everywhere_alike_has_no_stretch(square):
    "No stretch is larger than another"
    assert extent_of(np.arange(50.0), square) is None
    assert extent_of(np.zeros(50), np.arange(50.0)) is None
