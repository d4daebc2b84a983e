"""The constant between the cloud's gps_time and the trajectory's."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import match_times
from mlscorr.survey import Trajectory

WEEK_NUMBER = 2300  # the week of 2024-02-04
OF_WEEK = np.linspace(413200.0, 413800.0, 500)  # s
SYSTEMS = {
    "week": OF_WEEK,
    "standard": OF_WEEK + 604800.0 * WEEK_NUMBER - 1e9,
    "gps": OF_WEEK + 604800.0 * WEEK_NUMBER,
}


def trajectory(start=OF_WEEK[0] - 5.0, end=OF_WEEK[-1] + 5.0):
    gps_time = np.arange(start, end, 0.1)
    level = attitude_from_angles(np.zeros(len(gps_time)), 0.0, 0.0)
    return Trajectory(gps_time, np.zeros((len(gps_time), 3)), level)


@pytest.mark.parametrize("trajectory_system", SYSTEMS)
@pytest.mark.parametrize("cloud_system", SYSTEMS)
def test_recovers_the_constant_between_any_two_systems(cloud_system, trajectory_system):
    "Cloud and trajectory may each use any of three systems: the constant is found to the bit"
    cloud = SYSTEMS[cloud_system]
    goal = SYSTEMS[trajectory_system]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # plain GPS seconds contradict either flag
        match = match_times(
            "a.laz", cloud, cloud_system == "standard", trajectory(goal[0] - 5, goal[-1] + 5)
        )
    assert match.constant == goal[0] - cloud[0]
    assert (match.cloud_system, match.trajectory_system) == (cloud_system, trajectory_system)
    assert match.inside == 1.0


@pytest.mark.parametrize("is_standard", [False, True])
@pytest.mark.parametrize("trajectory_system", SYSTEMS)
def test_a_header_that_lies_is_overruled_and_warned_of(is_standard, trajectory_system):
    "Real files carry plain GPS seconds under either flag: what fits is taken, and said"
    goal = SYSTEMS[trajectory_system]
    with pytest.warns(UserWarning, match="plain GPS seconds since 1980"):
        match = match_times(
            "Car.laz", SYSTEMS["gps"], is_standard, trajectory(goal[0] - 5, goal[-1] + 5)
        )
    assert match.cloud_system == "gps"
    assert match.constant == goal[0] - SYSTEMS["gps"][0]


def test_week_seconds_under_a_standard_flag_are_found():
    "Equal times need no constant, but their size tells that the header is wrong"
    with pytest.warns(UserWarning, match=r"header of a\.laz.*adjusted standard"):
        match = match_times("a.laz", OF_WEEK, True, trajectory())
    assert (match.constant, match.cloud_system) == (0.0, "week")


def test_a_rollover_at_the_end_of_the_week_is_bridged():
    "A drive through Saturday midnight: the trajectory counts on, the cloud starts again at 0 s"
    match = match_times("a.laz", np.linspace(3.0, 80.0, 50), False, trajectory(604700.0, 604900.0))
    assert match.constant == 604800.0
    standard = np.linspace(604803.0, 604880.0, 50) + 604800.0 * WEEK_NUMBER - 1e9
    match = match_times("a.laz", standard, True, trajectory(604700.0, 604900.0))
    assert match.constant == 1e9 - 604800.0 * WEEK_NUMBER


def test_a_few_times_outside_are_normal():
    "The scanner is switched on before the POS: a tenth outside doesn't spoil the fit"
    match = match_times("a.laz", OF_WEEK, False, trajectory(OF_WEEK[50], OF_WEEK[-1] + 1))
    assert match.constant == 0.0
    assert 0.85 < match.inside < 0.95


@pytest.mark.parametrize("system", ["week", "gps"])
def test_a_few_points_past_the_end_do_not_choose_the_system(system):
    "A gap of days holds nothing: equal times stay equal where others put all points into the gap"
    first = SYSTEMS[system][0] - 300_000.0
    last = SYSTEMS[system][-1]
    days = Trajectory.concatenate([trajectory(first, first + 500.0), trajectory(last - 500, last)])
    match = match_times("a.laz", OF_WEEK + 9.0, False, days)
    assert (match.constant, match.trajectory_system) == (last - OF_WEEK[-1], system)
    assert 0.75 < match.inside < 0.85


def test_a_cloud_of_the_second_week_goes_into_it():
    "Drives at one hour of two weeks, both within the span: most times inside a pass tell the week"
    later = SYSTEMS["gps"] + 604_800.0
    weeks = [trajectory(t[0] + lag, t[-1]) for t, lag in ((SYSTEMS["gps"], 250.0), (later, -5.0))]
    match = match_times("a.laz", OF_WEEK, False, Trajectory.concatenate(weeks))
    assert match.constant == later[0] - OF_WEEK[0]


def test_both_sides_of_the_end_of_the_week_have_one_system():
    "A trajectory that counts on through Saturday midnight: both clouds are in seconds of week"
    running = np.linspace(604_780.1, 604_820.1, 81)
    for part in (running[:40], running[40:] - 604_800.0):
        match = match_times("a.laz", part, False, trajectory(604_775.0, 604_825.0))
        assert match.trajectory_system == "week"
        assert match.constant == (0.0 if part[0] > 1e5 else 604_800.0)
    parted = Trajectory.concatenate([trajectory(0.0, 20.0), trajectory(604_780.0, 604_799.9)])
    for part in (running[:40] + 0.3, running[40:] - 604_800.0):
        assert match_times("a.laz", part, False, parted).constant == 0.0


def test_an_explicit_system_is_obeyed():
    "cloud.gps_time overrides the header, without a warning"
    match = match_times("a.laz", OF_WEEK, True, trajectory(), "week")
    assert (match.constant, match.cloud_system) == (0.0, "week")


def test_an_explicit_system_that_does_not_fit_is_refused():
    "An order is not overruled by what would fit: the way back to auto is named"
    with pytest.raises(ValueError, match=r'cloud.gps_time = "standard".*Try .*"auto"'):
        match_times("a.laz", SYSTEMS["gps"], True, trajectory(), "standard")


def test_times_of_another_day_are_refused_with_both_spans():
    "Cloud and trajectory of different days: no constant may be invented"
    with pytest.raises(ValueError, match=r"None of .*\[499600.000, 500200.000\].*413195.*days"):
        match_times("a.laz", OF_WEEK + 86400.0, False, trajectory())


def test_utc_is_not_taken_for_gps_time():
    "18 leap seconds are no system of their own: a short trajectory tells, a long one can't"
    with pytest.raises(ValueError, match="Only 42 % of"):
        match_times("a.laz", OF_WEEK[:26] - 18.0, False, trajectory(OF_WEEK[0], OF_WEEK[25]))


@pytest.mark.parametrize("rows", [slice(None), slice(0, 45), slice(15, None), slice(27, 34)])
def test_a_week_that_ends_within_a_cloud_counts_on(rows):
    "Seconds of week that start again are placed to the microsecond where the trajectory's run on"
    running = np.linspace(604_770.3, 604_829.3, 60)[rows]  # s
    times = running % 604_800.0
    for system, start in (("week", 0.0), ("week", -604_800.0), ("gps", 604_800.0 * WEEK_NUMBER)):
        covering = trajectory(604_765.0 + start, 604_835.0 + start)
        match = match_times("a.laz", times, False, covering)
        assert np.abs(match.placed(times) - start - running).max() < 1e-6
        assert match.inside == 1.0
        assert match.trajectory_system == system
        assert "604800 s are added after the rollover" in str(match)
    with pytest.raises(ValueError, match="None of"):
        match_times("a.laz", times, False, trajectory(100_000.0, 100_100.0))


def test_a_cloud_of_both_ends_of_one_week_is_as_it_is():
    "A tile with points of Sunday and of the Saturday after it needs no week more"
    days = [trajectory(100.0, 200.0), trajectory(604_600.0, 604_700.0)]
    times = np.concatenate([np.linspace(110.0, 190.0, 30), np.linspace(604_610.0, 604_690.0, 30)])
    match = match_times("a.laz", times, False, Trajectory.concatenate(days))
    assert np.array_equal(match.placed(times), times)


def test_a_trajectory_in_utc_that_starts_before_the_cloud_is_named():
    "If 18 s bring all times inside, the sentence gives the offset, and other possible causes"
    for early in (18.0, -18.0):
        covering = trajectory(OF_WEEK[0] - early - 0.5, OF_WEEK[25] - early + 0.5)
        sentence = (
            rf"Only 42 % of.*with \{-early:+.0f} s: one may be in UTC, or the trajectory covers "
            f"only part.*add {early:.0f} to trajectory.time_constant"
        )
        with pytest.raises(ValueError, match=sentence):
            match_times("a.laz", OF_WEEK[:26], False, covering)


@pytest.mark.parametrize(
    ("cloud", "goal", "system"),
    [
        (OF_WEEK % 86400.0, OF_WEEK, "seconds of the day"),
        (OF_WEEK, OF_WEEK % 86400.0, "seconds of the day"),
        (SYSTEMS["gps"] + 315_964_800.0 - 18.0, OF_WEEK, "Unix time"),
        (SYSTEMS["standard"], SYSTEMS["gps"] + 315_964_800.0 - 18.0, "Unix time"),
    ],
)
def test_seconds_of_the_day_and_unix_time_are_named(cloud, goal, system):
    "The offset in the sentence, added to the trajectory's times, makes both match"
    with pytest.raises(ValueError, match=f"all would be with .* may be in {system}") as refusal:
        match_times("a.laz", cloud, False, trajectory(goal[0] - 5, goal[-1] + 5))
    added = float(re.search(r"add (-?\d+) to trajectory.time_constant", str(refusal.value))[1])
    with warnings.catch_warnings(action="ignore"):  # Unix time contradicts either flag
        match = match_times(
            "a.laz", cloud, False, trajectory(goal[0] + added - 5, goal[-1] + added + 5)
        )
    assert match.inside == 1.0


def test_times_in_single_precision_are_named():
    "Steps of 1/32 s in seconds of week move no drift; of 32 s in standard time, they are refused"
    rounded = {system: times.astype(np.float32).astype(float) for system, times in SYSTEMS.items()}
    with pytest.warns(UserWarning, match=r"single precision, in steps of 0\.031 s"):
        match = match_times("a.laz", rounded["week"], False, trajectory())
    assert (match.constant, match.inside) == (0.0, 1.0)
    with pytest.raises(ValueError, match=r"single precision, in steps of 32 s"):
        match_times("a.laz", rounded["standard"], True, trajectory())


@pytest.mark.parametrize("factor", [1e3, 1e9, -1e9])
def test_times_in_other_units_are_refused(factor):
    "Unix time in milliseconds or nanoseconds is beyond all dates, and is refused all the same"
    unix = SYSTEMS["gps"] + 315_964_782.0
    with pytest.raises(ValueError, match=r"None of the sampled times .* or milliseconds"):
        match_times("a.laz", factor * unix, False, trajectory())


def test_a_trajectory_that_covers_a_part_is_refused():
    "With a third of the cloud covered, the file is said to be short, not the system wrong"
    with pytest.raises(ValueError, match="covers only part of the cloud"):
        match_times("a.laz", OF_WEEK, False, trajectory(OF_WEEK[0], OF_WEEK[170]))


def test_a_cloud_without_times_is_refused():
    "No points, no times: nothing can be worked out"
    with pytest.raises(ValueError, match=r"a\.laz has no points"):
        match_times("a.laz", np.empty(0), False, trajectory())


@pytest.mark.parametrize("share", [0.1, 0.7])
def test_points_without_a_time_beside_others_are_counted(share):
    "However many there are, gps_time 0 is said as such, and the others tell the system"
    times = SYSTEMS["standard"].copy()
    times[: int(share * len(times))] = 0.0
    words = rf"^{share * 500:.0f} of 500 points sampled from a\.laz have gps_time 0,"
    with pytest.warns(UserWarning, match=words):
        match = match_times("a.laz", times, True, trajectory())
    assert match.constant == SYSTEMS["week"][0] - SYSTEMS["standard"][0]


@settings(max_examples=50, deadline=None)
@given(
    week=st.integers(1100, 3000),
    start=st.floats(2_000.0, 600_000.0),
    cloud_system=st.sampled_from(["week", "standard", "gps"]),
    trajectory_system=st.sampled_from(["week", "standard", "gps"]),
)
def test_any_week_is_recovered(week, start, cloud_system, trajectory_system):
    "From 2001 to 2037 the constant between two systems puts each time on its own to 1e-6 s"
    of_week = start + np.linspace(0.0, 600.0, 50)
    shift = {"week": 0.0, "standard": 604800.0 * week - 1e9, "gps": 604800.0 * week}
    goal = of_week + shift[trajectory_system]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # plain GPS seconds contradict either flag
        match = match_times(
            "a.laz",
            of_week + shift[cloud_system],
            cloud_system == "standard",
            trajectory(goal[0] - 5.0, goal[-1] + 5.0),
        )
    placed = of_week + shift[cloud_system] + match.constant
    np.testing.assert_allclose(placed, goal, rtol=0, atol=1e-6)


@pytest.mark.parametrize("value", [0.0, -1.0, -1e9, -1_000_000_001.0])
@pytest.mark.parametrize("system", SYSTEMS)
def test_points_without_a_time_do_not_judge_the_time_system(value, system):
    "Three times of 0 or -1 are named as what they are, and the system is that of the others"
    times = SYSTEMS[system].copy()
    times[[0, 250, 499]] = value
    goal = trajectory(SYSTEMS[system][0] - 5, SYSTEMS[system][-1] + 5)
    with pytest.warns(UserWarning) as caught:
        match = match_times("a.laz", times, system != "week", goal, setting="auto")
    told = [str(warning.message) for warning in caught]
    assert told[0].startswith(f"3 of 500 points sampled from a.laz have gps_time {value:.15g},")
    assert len(told) == (2 if system == "gps" else 1)  # of the header, which can't state it
    assert match.constant == 0.0
    assert match.cloud_system == system
    assert match.inside == 1.0


def test_both_placeholders_are_counted():
    "Points with 0 and with -1 are counted apart; where all points have one of them, that is said"
    times = SYSTEMS["week"].copy()
    times[:3] = -1.0
    times[3:5] = 0.0
    with pytest.warns(UserWarning, match=r"5 of 500 points.*gps_time -1 \(3\) and 0 \(2\)"):
        match_times("a.laz", times, False, trajectory())
    with pytest.raises(ValueError, match=r"have gps_time -1 \(3\) and 0 \(2\)"):
        match_times("a.laz", times[:5], False, trajectory())


def test_the_first_second_of_a_week_is_a_time():
    "A drive over the start of the week has one sample at 0 s, which is its time: nothing is warned"
    times = np.arange(0.0, 600.0, 1.0)
    match = match_times("a.laz", times, False, trajectory(-5.0, 605.0))
    assert match.constant == 0.0
    assert match.inside == 1.0


def test_an_offset_of_the_header_hides_no_placeholder():
    "Times stored less an offset: those stored as -1 are found after it was added"
    times = SYSTEMS["standard"].copy()
    offset = 1e6 * 1300 - 1e9  # s
    times[[3, 4]] = offset - 1.0
    goal = trajectory(times[0] - 5, times[-1] + 5)
    with pytest.warns(UserWarning, match=r"2 of 500 points sampled from a\.laz have gps_time -1"):
        match = match_times("a.laz", times, True, goal, time_offset=offset)
    assert match.inside == 1.0
