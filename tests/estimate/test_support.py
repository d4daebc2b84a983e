"""Parts of a drive that control points constrain."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support, WeakInterval, estimate_correction, place_control
from mlscorr.evaluate import largest_sigma
from mlscorr.survey import Pos
from tests.beds.lying_pos import START, TIME, survey, walk

EVEN = np.linspace(3.0, 237.0, 16)
EARLY = "before the first"
LATE = "after the last"


def support_of(seed, outage, times):
    "(support, estimate) of a drive of 240 s whose outage no sigma states"
    rng = np.random.default_rng(seed)
    trajectory, matched = survey(rng, walk(rng, *outage), times)
    estimate = estimate_correction(trajectory, matched, Pos(position_sigma=0.5))
    return estimate.support, estimate


def weak_times(support):
    "Flags (2400,) of extrapolated epochs"
    return support.contains(START + TIME)


def test_between_control_points_a_drive_is_held():
    "Without an outage only the first 2 s and the last 2 s are extrapolated, 20 m each"
    support, _ = support_of(1, (300.0, 300.0), EVEN)
    assert [interval.why.partition(" control")[0] for interval in support.weak] == [EARLY, LATE]
    assert [round(interval.length_m) for interval in support.weak] == [19, 18]
    assert support.outages == support.steps == ()


def test_an_outage_that_does_not_end_is_extrapolated_past_its_last_control_point():
    "From 190 s on, with a sigma that tells of decimetres and more"
    support, _ = support_of(3, (180.0, 400.0), EVEN[EVEN < 200.0])
    last = support.weak[-1]
    assert last.why.startswith(LATE)
    assert last.start - START == pytest.approx(191.4, abs=0.3)
    assert last.sigma > 0.3 and last.length_m == pytest.approx(485.0, abs=5.0)


def test_an_outage_without_control_is_extrapolated_until_gnss_returns():
    "The step at 140 s tells the drift at its end; before it decimetres stay open, after it none"
    support, estimate = support_of(1, (80.0, 140.0), EVEN[(EVEN < 80.0) | (EVEN > 140.0)])
    assert support.steps == pytest.approx([START + 140.0], abs=0.2)
    assert support.outages[0][1] == pytest.approx(START + 140.0, abs=0.2)
    (interval,) = (interval for interval in support.weak if "outage" in interval.why)
    assert [interval.start - START, interval.end - START] == pytest.approx([66.5, 139.9], abs=15.0)
    assert interval.sigma > 0.2
    sigma = np.linalg.norm(estimate.correction.corrected.position_sigma, axis=1)
    assert sigma[~weak_times(support)].max() < 0.5 * interval.sigma


@pytest.mark.long
def test_a_sigma_that_hardly_rises_is_no_outage():
    "An outage of 60 s that states metres is shown; 3 cm instead of 2 cm in the last 15 s are not"
    rng = np.random.default_rng(2)
    trajectory, matched = survey(rng, walk(rng, 80.0, 140.0), EVEN)
    since = np.where((TIME > 80.0) & (TIME < 140.0), TIME - 80.0, 0.0)
    size = 0.02 + 5.0 * (since / 60.0) ** 1.5 + 0.01 * (TIME > 225.0)
    stated = replace(trajectory, position_sigma=np.tile(size[:, None], 3))
    estimate = estimate_correction(stated, matched)
    assert np.isfinite(estimate.adjustment.errors.starts[-1])
    ((_, end),) = estimate.support.outages
    assert end - START == pytest.approx(140.0, abs=0.2)


def test_the_start_of_a_drive_without_control_is_extrapolated():
    "Control from 150 s on leaves all before it to the trend"
    support, _ = support_of(3, (80.0, 140.0), EVEN[EVEN > 150.0])
    weak = weak_times(support)
    assert weak[(TIME < 150.0)].all() and not weak[(TIME > 160.0) & (TIME < 236.0)].any()


def scanned_from(begin, end, *more):
    "Whole seconds of a drive from which clouds hold points"
    spans = ((begin, end), *more)
    return np.concatenate([START + np.arange(*span) for span in spans]).astype(int)


def test_times_at_which_nothing_was_scanned_are_not_extrapolated():
    "Clouds of 100 to 180 s of a drive of 240 s: its ends matter to nobody, 2 s on each side do"
    rng = np.random.default_rng(1)
    trajectory, matched = survey(rng, walk(rng, 300.0, 300.0), np.linspace(102.0, 178.0, 12))
    trajectory = trajectory.scanned_at(scanned_from(100, 180))
    estimate = estimate_correction(trajectory, matched, Pos(position_sigma=0.5))
    spans = [(interval.start - START, interval.end - START) for interval in estimate.support.weak]
    assert np.ravel(spans) == pytest.approx([99.9, 101.0, 179.0, 180.0], abs=0.15)
    assert "extrapolated" not in [warning.key for warning in estimate.statements]
    assert estimate.guards.gap[1] - estimate.guards.gap[0] < 8.0
    sigma = largest_sigma(estimate.correction.corrected)
    places = place_control(estimate)
    times = np.array([sigma["time"], *(place.gps_time for place in places)]) - START
    assert len(places) == 3 and (times > 99.8).all() and (times < 180.2).all()


@pytest.mark.long
def test_no_control_is_asked_for_in_a_pause_of_the_scanner():
    "60 s without points between control: the next points belong beside it, not into it"
    rng = np.random.default_rng(2)
    times = np.concatenate([np.linspace(3.0, 87.0, 8), np.linspace(153.0, 237.0, 8)])
    trajectory, matched = survey(rng, walk(rng, 80.0, 160.0), times)
    between = []
    for recorded in (trajectory, trajectory.scanned_at(scanned_from(0, 90, (150, 240)))):
        estimate = estimate_correction(recorded, matched, Pos(position_sigma=0.5))
        places = [place.gps_time - START for place in place_control(estimate)]
        between.append([90.2 < place < 149.8 for place in places])
    assert any(between[0]) and not any(between[1])


def test_times_are_counted_once_at_the_edges():
    "Within a stretch, ends included; not before, between or after"
    weak = tuple(WeakInterval(a, b, 1.0, 0.1, "") for a, b in ((0.0, 1.0), (3.0, 4.0)))
    times = np.array([-0.1, 0.0, 1.0, 2.0, 3.5, 4.1])
    assert Support(weak).contains(times).tolist() == [False, True, True, False, True, False]
    assert not Support().contains(times).any()
    assert replace(weak[0], end=2.5).document()["to"] == 2.5
