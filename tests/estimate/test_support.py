"""Which part of a drive control points hold."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support, WeakStretch, estimate_correction
from mlscorr.survey import Pos
from tests.beds.lying_pos import START, TIME, survey, walk

EVEN = np.linspace(3.0, 237.0, 16)
EARLY, LATE = "before the first", "past the last"


def support_of(seed, outage, times):
    "(support, estimate) of a drive of 240 s whose outage no sigma states"
    rng = np.random.default_rng(seed)
    trajectory, matched = survey(rng, walk(rng, *outage), times)
    estimate = estimate_correction(trajectory, matched, Pos(position_sigma=0.5))
    return estimate.support, estimate


def weak_times(support):
    "Whether each epoch (2400,) is extrapolated"
    return support.contains(START + TIME)


def test_between_control_points_a_drive_is_held():
    "Without an outage only the first 2 s and the last 2 s are extrapolated, 20 m each"
    support, _ = support_of(1, (300.0, 300.0), EVEN)
    assert [stretch.why.partition(" control")[0] for stretch in support.weak] == [EARLY, LATE]
    assert [round(stretch.length_m) for stretch in support.weak] == [19, 18]
    assert support.outages == support.steps == ()


def test_an_outage_that_does_not_end_is_extrapolated_past_its_last_control_point():
    "From 190 s on, with a sigma that tells of decimetres and more"
    support, _ = support_of(2, (180.0, 400.0), EVEN[EVEN < 200.0])
    last = support.weak[-1]
    assert last.why.startswith(LATE)
    assert last.start - START == pytest.approx(191.4, abs=0.3)
    assert last.sigma > 0.3 and last.length_m == pytest.approx(485.0, abs=5.0)


def test_an_outage_without_control_is_extrapolated_until_gnss_returns():
    "The step at 140 s tells the drift at its end; before it decimetres stay open, after it none"
    support, estimate = support_of(1, (80.0, 140.0), EVEN[(EVEN < 80.0) | (EVEN > 140.0)])
    assert support.steps == pytest.approx([START + 140.0], abs=0.2)
    assert support.outages[0][1] == pytest.approx(START + 140.0, abs=0.2)
    (stretch,) = (stretch for stretch in support.weak if "outage" in stretch.why)
    assert [stretch.start - START, stretch.end - START] == pytest.approx([66.5, 139.9], abs=15.0)
    assert stretch.sigma > 0.2
    sigma = np.linalg.norm(estimate.correction.corrected.position_sigma, axis=1)
    assert sigma[~weak_times(support)].max() < 0.5 * stretch.sigma


def test_the_start_of_a_drive_without_control_is_extrapolated():
    "Control from 150 s on leaves all before it to the trend"
    support, _ = support_of(3, (80.0, 140.0), EVEN[EVEN > 150.0])
    weak = weak_times(support)
    assert weak[(TIME < 150.0)].all() and not weak[(TIME > 160.0) & (TIME < 236.0)].any()


def test_times_are_counted_once_at_the_edges():
    "Within a stretch, ends included; not before, between or after"
    weak = tuple(WeakStretch(a, b, 1.0, 0.1, "") for a, b in ((0.0, 1.0), (3.0, 4.0)))
    times = np.array([-0.1, 0.0, 1.0, 2.0, 3.5, 4.1])
    assert Support(weak).contains(times).tolist() == [False, True, True, False, True, False]
    assert not Support().contains(times).any()
    assert replace(weak[0], end=2.5).document()["to"] == 2.5
