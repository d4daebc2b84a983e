"""Time systems: the constant that converts a cloud's gps_time to the trajectory's.

Three systems are in use: GPS seconds of week; GPS seconds since 1980-01-06; and these minus 1e9
("adjusted standard GPS time"), LAS's own. A LAS header states week or standard, but real files can
be wrong: plain GPS seconds occur with either flag.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta
from importlib.resources import files
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.io.settings import SETTINGS
from mlscorr.survey import WEEK, CloudFile, Trajectory, counted_on
from mlscorr.wording import percent

EPOCH = date(1980, 1, 6)  # origin of both
DAY = 86400.0  # s
ADJUSTMENT = 1e9  # s
NO_TIMES = (0.0, -1.0)  # written by programs for a point without a time
PLACEHOLDERS = (*NO_TIMES, *(time - ADJUSTMENT for time in NO_TIMES))  # s, converted likewise
SYSTEMS = ("week", "standard", "gps")
NAMES = {
    "week": "GPS seconds of week",
    "standard": "adjusted standard GPS time (GPS seconds minus 1e9)",
    "gps": "plain GPS seconds since 1980",
}


@dataclass(frozen=True)
class TimeMatch:
    """Match trajectory time = cloud time + constant (s), with both systems and the share inside.

    Another week is added to cloud times below new_week (s), where seconds of week restart.
    """

    constant: float
    cloud_system: str
    trajectory_system: str
    inside: float
    new_week: float = -np.inf

    def __str__(self) -> str:
        text = f"{NAMES[self.cloud_system]}, as in the trajectory"
        if self.constant != 0.0:
            text = (
                f"{NAMES[self.cloud_system]}; {self.constant:+.0f} s converts to the "
                f"trajectory's {NAMES[self.trajectory_system]}"
            )
        if self.new_week > -np.inf:
            text += (
                f"; the GPS week ends in the file, {WEEK:.0f} s are added after the rollover, "
                "and times are written as in the input"
            )
        return text

    def placed(self, times: np.ndarray) -> np.ndarray:
        """Return times (n,) of the cloud in the trajectory's system. Units: s.

        Parameters
        ----------
        times : (n,) array
            In the cloud's own system. Units: s.
        """
        return counted_on(times, self.new_week) + self.constant


def match_times(
    name: str,
    times: ArrayLike,
    is_standard: bool,
    trajectory: Trajectory,
    setting: str = "auto",
    time_offset: float = 0.0,
) -> TimeMatch:
    """Find the constant between a cloud's times and the trajectory's.

    Parameters
    ----------
    name : str
        Name of the cloud file, for messages.
    times : (n,) array
        Times sampled from the cloud, in its own system. Units: s.
    is_standard : bool
        True if the LAS header states adjusted standard GPS time, False for seconds of week.
    trajectory : Trajectory
    setting : str
        ``auto`` prefers the header but uses what fits; ``week`` and ``standard`` are binding.
    time_offset : float
        Offset that was added to the stored times. Units: s.

    Returns
    -------
    TimeMatch

    Raises
    ------
    ValueError
        If most of the times are outside the trajectory with every constant.

    Warns
    -----
    UserWarning
        If the match contradicts the header, or points have no time, which are ignored.

    Examples
    --------
    >>> from mlscorr.frames import attitude_from_angles
    >>> from mlscorr.survey import Trajectory
    >>> level = attitude_from_angles(np.zeros(2), 0.0, 0.0)
    >>> trajectory = Trajectory(np.array([413200.0, 413300.0]), np.zeros((2, 3)), level)
    >>> match_times("a.laz", np.array([391040000.0 + 413250.0]), True, trajectory).constant
    -391040000.0
    """
    times = np.asarray(times, dtype=float)
    times = times[np.isfinite(times)]
    if not len(times):
        raise ValueError(f"{name} has no points with a gps_time.")
    stored = times - time_offset
    is_missing = lacks_time(stored)
    if is_missing.all():
        raise ValueError(
            f"All points of {name} have gps_time {listed_times(stored)}, which means no time. "
            "Export it with gps_time, which locates points on the trajectory."
        )
    if is_missing.any():
        warnings.warn(
            f"{is_missing.sum()} of {len(times)} points sampled from {name} have gps_time "
            f"{listed_times(stored[is_missing])}, which means no time; the time system is taken "
            "from the others. Export all points with gps_time.",
            stacklevel=2,
        )
        times = times[~is_missing]
    _check_precision(name, times)
    match = _match(times, is_standard, trajectory, setting)
    new_week = _new_week(times)
    if new_week > -np.inf:
        counted = _match(counted_on(times, new_week), is_standard, trajectory, setting)
        is_of_week = counted is not None and counted.cloud_system == "week"
        if is_of_week and (match is None or counted.inside > match.inside):
            match = replace(counted, new_week=new_week)
    if match is None:
        raise ValueError(_nothing_fits(name, times, trajectory.gps_time[[0, -1]], setting))
    if setting == "auto":
        flagged = "standard" if is_standard else "week"
        match = _settle_equal(match, times)
        if match.cloud_system != flagged:
            warnings.warn(
                f"The header of {name} states {NAMES[flagged]}, but its times "
                f"[{times.min():.1f}, {times.max():.1f}] s were recognized as {match}.",
                stacklevel=2,
            )
    return match


def _match(times, is_standard, trajectory, setting):
    """TimeMatch of times in the preferred system, otherwise in others; or None."""
    candidates = _candidates(times, trajectory.gps_time[[0, -1]])
    if setting != "auto":
        return _best(candidates, times, trajectory, (setting,))
    flagged = "standard" if is_standard else "week"
    preferred = _best(candidates, times, trajectory, (flagged,))
    return preferred or _best(candidates, times, trajectory, _others(flagged, times))


def _check_precision(name, times):
    """Warn of times that fit single precision; refuse them if it is too coarse."""
    rounded = times.astype(np.float32)
    step = float(np.spacing(np.abs(rounded).max()))
    if step <= SETTINGS.single_time_step or (rounded != times).any():
        return
    sentence = (
        f"The times of {name} [{times.min():.3f}, {times.max():.3f}] s were rounded to single "
        f"precision, in steps of {step:.2g} s, too coarse for a moving vehicle. Export gps_time "
        "in double precision."
    )
    if usual_systems(times) != ("week",):
        raise ValueError(sentence)
    warnings.warn(sentence, stacklevel=3)  # drift hardly changes within 1/8 second


def _candidates(times, span):
    """Constants (s) as a list of (constant, cloud system, trajectory system), simplest first."""
    middle = np.median(times)
    goal = np.mean(span)
    candidates = [(0.0, system, system) for system in SYSTEMS]
    candidates += [(WEEK * k, "week", "week") for k in (-1, 1)]  # one of the two has rolled over
    to_gps = {"standard": ADJUSTMENT, "gps": 0.0}
    for cloud, added in to_gps.items():  # to seconds of week, or to the other continuous system
        week = np.floor((middle + added) / WEEK)
        candidates += [(added - WEEK * (week + k), cloud, "week") for k in (0, -1, 1)]
        candidates += [(added - taken, cloud, t) for t, taken in to_gps.items() if t != cloud]
    for system, taken in to_gps.items():  # from seconds of week
        week = np.floor((goal + taken) / WEEK)
        candidates += [(WEEK * (week + k) - taken, "week", system) for k in (0, -1, 1)]
    return candidates


def _inside(times, passes, constant):
    """Share of the times inside passes (k, 2) of the trajectory, or its time span (2,)."""
    starts, ends = np.reshape(passes, (-1, 2)).T
    number = np.searchsorted(starts, times + constant, side="right") - 1
    return np.mean((number >= 0) & (times + constant <= ends[number]))


def _best(candidates, times, trajectory, systems):
    """TimeMatch with most times in passes, otherwise in all; the first of equal ones; or None."""
    for passes in (trajectory.passes, trajectory.gps_time[[0, -1]]):  # gaps contain any by chance
        fits = [
            TimeMatch(float(constant), cloud, system, float(inside))
            for flagged in systems
            for constant, cloud, system in candidates
            if cloud == flagged
            and (inside := _inside(times, passes, constant)) >= SETTINGS.covered_share
        ]
        if fits:
            return max(fits, key=lambda match: match.inside)
    return None


def usual_systems(times: np.ndarray) -> tuple[str, ...]:
    """Names of the systems whose range includes the times, the most likely first.

    Parameters
    ----------
    times : (n,) array
        Units: s.
    """
    if times.min() >= 0 and times.max() <= 2 * WEEK:
        return ("week",)
    if times.min() >= ADJUSTMENT:
        return ("gps",)
    if times.min() >= SETTINGS.earliest_time:
        return ("gps", "standard")
    return ("standard",)


def _settle_equal(match, times):
    """Name the system of equal times by their size, because a constant of zero does not show it."""
    usual = usual_systems(times)
    if match.constant != 0.0 or match.cloud_system in usual:
        return match
    return replace(match, cloud_system=usual[0], trajectory_system=usual[0])


def _others(flagged, times):
    """Systems that the header does not name, sorted by likelihood from the size of the times."""
    usual = usual_systems(times)
    others = [system for system in SYSTEMS if system != flagged]
    return sorted(others, key=lambda system: system not in usual)


def _other_systems(lag, earlier):
    """Pairs (s, name) of other systems' differences from GPS time, up to whole weeks."""
    days = range(1, 7) if earlier <= DAY else ()  # otherwise of another day, not seconds of day
    unix = (EPOCH - date(1970, 1, 1)).days * DAY - lag
    differences = {lag: "UTC", unix: "Unix time", unix % WEEK: "Unix time"}
    differences |= {day * DAY: "seconds of the day" for day in days}
    return [(sign * s, system) for s, system in differences.items() for sign in (1, -1)]


def _nothing_fits(name, times, span, setting):
    """Sentence with both time spans, the likely cause and the remedy."""
    candidates = _candidates(times, span)
    shares = [(_inside(times, span, constant), cloud) for constant, cloud, _ in candidates]
    largest = max(inside for inside, cloud in shares if setting in ("auto", cloud))
    spans = (
        f"the sampled times of {name}, [{times.min():.3f}, {times.max():.3f}] s, are inside the "
        f"trajectory [{span[0]:.3f}, {span[1]:.3f}] s"
    )
    share = f"Only {percent(largest)} of" if largest > 0 else "None of"
    constants = [constant for constant, cloud, _ in candidates if setting in ("auto", cloud)]
    systems = _other_systems(utc_lag(span, times), min(times.max(), span[1]))
    for constant, (later, system) in product(constants, systems):
        if _inside(times, span, constant + later) == 1.0:
            return (
                f"{share} {spans}, but all would be with {later:+.0f} s: one may be in {system}, "
                "or the trajectory covers only part of the cloud. Export both completely in GPS "
                f"time; if one is in {system}, you can add {-later:.0f} to "
                "trajectory.time_constant (s) in survey.toml instead."
            )
    if largest > 0:
        return (
            f"{share} {spans}: the trajectory covers only part of the cloud. Export the whole "
            "trajectory, or clip the cloud to it."
        )
    if setting == "auto" or max(shares)[0] < SETTINGS.covered_share:
        return (
            f"None of {spans}, neither unchanged nor as seconds of week, adjusted standard GPS "
            "time or plain GPS seconds. Cloud and trajectory may be from different days, or one "
            "in UTC, local time or milliseconds: check that both are from one drive."
        )
    return (
        f'None of {spans}, taken as {NAMES[setting]}, as set by cloud.gps_time = "{setting}" '
        'in survey.toml. Try cloud.gps_time = "auto".'
    )


def utc_lag(*times: np.ndarray) -> int:
    """GPS time minus UTC on the day of the times that show it first, or today. Units: s.

    Parameters
    ----------
    *times : (n,) arrays
        Times of cloud or trajectory, each in its own system. Units: s.
    """
    for some in times:
        if (system := usual_systems(some)[0]) != "week":
            seconds = float(some[0]) + ADJUSTMENT * (system == "standard")
            # also of invalid values, up to the 23rd century
            return leap_seconds(EPOCH + timedelta(days=np.clip(seconds / DAY, 0, 1e5)))
    return leap_seconds(date.max)


def gps_epoch(trajectory: Trajectory, clouds: Sequence[CloudFile]) -> datetime | None:
    """Date and time at which a trajectory's gps_time is zero, in GPS time.

    Seconds of week do not show the date, but a cloud of the drive with continuous times does.

    Parameters
    ----------
    trajectory : Trajectory
    clouds : sequence of CloudFile

    Returns
    -------
    datetime.datetime or None
        None if no file states the week.
    """
    start = datetime.combine(EPOCH, datetime.min.time())
    continuous = {"standard": ADJUSTMENT, "gps": 0.0}
    system = usual_systems(trajectory.gps_time)[0]
    if system in continuous:
        return start + timedelta(seconds=continuous[system])
    for cloud in clouds:
        if cloud.time_system not in continuous:
            continue
        seconds = continuous[cloud.time_system] - cloud.time_constant
        if seconds % WEEK == 0:  # otherwise times with the header's own offset
            return start + timedelta(seconds=seconds)
    return None


def leap_seconds(day: date) -> int:
    """GPS time minus UTC on a day, from the table of the IANA time zone database. Units: s.

    Parameters
    ----------
    day : date

    Examples
    --------
    >>> leap_seconds(date(2016, 12, 31)), leap_seconds(date(2017, 1, 1))
    (17, 18)
    """
    table = (files("tzdata.zoneinfo") / "leapseconds").read_text(encoding="utf-8")
    rows = [line.split() for line in table.splitlines() if line.startswith("Leap")]
    ends = [datetime.strptime(" ".join(row[1:4]), "%Y %b %d").date() for row in rows]
    return sum(EPOCH <= end < day for end in ends)


def count_on(times: ArrayLike, period: float = WEEK) -> tuple[np.ndarray, np.ndarray | None]:
    """Continue times of successive epochs where seconds of week restart.

    A restart is a decrease by a week, minus a pause of up to a day, which no fault in a file
    causes.

    Parameters
    ----------
    times : (n,) array
        Units: s.
    period : float
        Period after which they restart. Units: s.

    Returns
    -------
    times : (n,) array
    periods : (n,) int array, or None
        Number of periods that were added; None if times never restart.

    Examples
    --------
    >>> count_on([604_799.5, 604_800.0, 0.5, 1.0])[0].tolist()
    [604799.5, 604800.0, 604800.5, 604801.0]
    """
    times = np.asarray(times, dtype=float)
    is_fallen = np.diff(times) < DAY / WEEK * period - period
    if not is_fallen.any() or not (times.min() >= 0 and times.max() <= period):
        return times, None
    periods = np.append(0, np.cumsum(is_fallen))
    return times + period * periods, periods


def counting_on(record: dict[str, np.ndarray], period: float = WEEK) -> dict[str, np.ndarray]:
    """Columns of a file with continued gps_time, and the added weeks, if any.

    Parameters
    ----------
    record : dict
        Name of a column to an (n,) array.
    period : float
        See count_on.

    Returns
    -------
    dict
    """
    times, periods = count_on(record["gps_time"], period)
    if periods is None:
        return record
    weeks = {"weeks": periods} if period == WEEK else {}
    return record | {"gps_time": times} | weeks


def _new_week(times):
    """Limit (s) below which seconds of week belong to the next week; minus infinity without one.

    Times at both ends of a week, and none for six days between them, belong to a drive across its
    end.
    """
    ordered = np.sort(times)
    gaps = np.diff(ordered)
    is_of_week = ordered[0] >= 0 and ordered[-1] <= WEEK
    if not is_of_week or not len(gaps) or gaps.max() < WEEK - DAY:
        return -np.inf
    last = int(np.argmax(gaps))
    return float((ordered[last] + ordered[last + 1]) / 2)


def lacks_time(times: np.ndarray) -> np.ndarray:
    """Flag (n,) of points without a time: not a number, or 0 or -1 instead.

    Parameters
    ----------
    times : (n,) array
        Stored times. Units: s.
    """
    times = np.round(times, 6)  # s; a remainder of an offset added and removed is smaller
    is_placeholder = np.isin(times, PLACEHOLDERS)
    is_missing = is_placeholder | ~np.isfinite(times)
    if np.count_nonzero(is_placeholder) == 1 and not is_missing.all():
        # a single one within the drive is a time: the week starts within one epoch
        rest = times[~is_missing]
        is_missing &= ~(is_placeholder & (np.abs(times - np.median(rest)) <= np.ptp(rest)))
    return is_missing


def listed_times(times: np.ndarray) -> str:
    """Values of points without a time, with the number of each if they differ.

    Parameters
    ----------
    times : (n,) array
        Stored times of these points. Units: s.
    """
    values, counts = np.unique(np.round(times, 6), return_counts=True)
    if len(values) == 1:
        return f"{values[0] + 0.0:.15g}"  # and not -0
    some = zip(values.tolist(), counts.tolist(), strict=True)
    return " and ".join(f"{value:.15g} ({number})" for value, number in some)
