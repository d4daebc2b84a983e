"""Supported and extrapolated parts of a correction, and its jumps."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mlscorr.collocation import Collocation
from mlscorr.correction import Correction
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.settings import SETTINGS
from mlscorr.pos import SignalParameters, drift_history, drift_signals
from mlscorr.survey import SAME_EPOCH, Trajectory

REASONS = (
    "constrained by control points",
    "pass without control point",
    "before the first control point of the pass",
    "after the last control point of the pass",
    "in a GNSS outage, after the last control point",
    "control points explain less than half of the variance of the drift",
)
CONSTRAINED, NO_CONTROL, BEFORE_FIRST, PAST_LAST, IN_OUTAGE, DRIFT = range(len(REASONS))


@dataclass(frozen=True)
class WeakInterval:
    """A part of the drive whose correction is extrapolated.

    Parameters
    ----------
    start, end : float
        Units: s.
    length_m : float
        Along the path. Units: m.
    sigma : float
        The largest 3D sigma of the corrected position: the error to expect. Units: m.
    why : str
    chainage : float
        Of its start: the length of the path from the first epoch, straight across gaps. Units: m.
    """

    start: float
    end: float
    length_m: float
    sigma: float
    why: str
    chainage: float = 0.0

    @property
    def seconds(self) -> float:
        """Duration of the interval."""
        return self.end - self.start

    def document(self) -> dict[str, object]:
        """The row of ``weak[]`` in report.json."""
        row = {"from": self.start, "to": self.end, "length_m": self.length_m}
        return {**row, "chainage": self.chainage, "sigma": self.sigma, "why": self.why}


@dataclass(frozen=True)
class Support:
    """Support of a correction along the drive.

    Parameters
    ----------
    weak : tuple of WeakInterval
        In time order, without overlap.
    outages : tuple of (float, float)
        Start of the growth of drift, and its restart. Units: s.
    steps : tuple of float
        Times at which the recorded position steps back. Units: s.
    """

    weak: tuple[WeakInterval, ...] = ()
    outages: tuple[tuple[float, float], ...] = ()
    steps: tuple[float, ...] = ()

    def contains(self, gps_time: np.ndarray) -> np.ndarray:
        """Mask (n,) of times within a weak interval.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.

        Examples
        --------
        >>> weak = WeakInterval(0.0, 2.0, 9.0, 0.3, "a"), WeakInterval(2.0, 3.0, 5.0, 0.2, "b")
        >>> Support(weak).contains(np.array([-1.0, 0.0, 2.0, 3.0, 3.5]))
        array([False,  True,  True,  True, False])
        """
        starts = np.array([interval.start for interval in self.weak])
        ends = np.array([interval.end for interval in self.weak])
        number = np.searchsorted(starts, gps_time, side="right")
        return gps_time <= np.append(-np.inf, ends)[number]


def find_support(
    adjustment: Adjustment, solved: Collocation, parameters: SignalParameters, corrected: Trajectory
) -> Support:
    """Find the support of a correction along the drive.

    Parameters
    ----------
    adjustment : Adjustment
        Of the control points in use.
    solved : Collocation
        Of these, under the parameters.
    parameters : SignalParameters
        The most probable ones.
    corrected : Trajectory
        With its sigmas.
    """
    is_drifting = _is_drifting(adjustment, parameters)
    codes = _reasons(adjustment, solved, parameters, corrected, is_drifting)
    history = adjustment.errors.history
    starts = adjustment.errors.starts
    ends_by_step = np.isin(history.edges[1:], history.steps.middle)
    drifting = adjustment.trajectory.gps_time[is_drifting]
    epochs = [np.searchsorted(drifting, times) for times in (starts, history.edges[1:])]
    # a start without a later re-acquisition may be caused by the noise of GNSS
    shown = ends_by_step | (history.is_stated & (epochs[1] > epochs[0]))
    return Support(
        tuple(weak_intervals(codes, corrected)),
        tuple(
            (float(start), float(end))
            for start, end, is_shown in zip(starts, history.edges[1:], shown, strict=True)
            if is_shown and end > start
        ),
        tuple(history.steps.middle.tolist()),
    )


def _reasons(adjustment, solved, parameters, corrected, is_drifting):
    """Number of the reason (n,) that each epoch of the trajectory is extrapolated; HELD if not.

    Control supports no epoch before the first or past the last control point of its pass, nor past
    the last one of an outage, because drift continues to grow there (unless a smoother limits it):
    a re-acquisition shows its final size, but leaves decimeters of uncertainty before it. Between
    control points their information has faded if the drift's variance exceeds half of that without
    control: there the correction is closer to the trend than to its neighbors. Drift below the
    noise of GNSS doesn't count. An epoch within a second of control is supported. If ties connect
    the passes, a control point supports both, and the variance alone decides.
    """
    trajectory = adjustment.trajectory
    stated = adjustment.errors.epochs
    time = trajectory.gps_time
    control = np.sort(adjustment.observed)
    if len(control) == 0:
        return np.full(len(time), NO_CONTROL)
    is_open = is_drifting & _is_drift_open(adjustment, solved, parameters, corrected)
    codes = np.where(is_open, DRIFT, CONSTRAINED)
    if adjustment.ties is not None:
        return codes
    for first, last in pairwise(adjustment.errors.history.edges):
        rows = (time > first) & (time <= last) & (stated.since > 0) & (stated.ahead == 1)
        inside = control[(control > first) & (control <= last)]
        codes[rows & (time > inside.max(initial=-np.inf) + SAME_EPOCH)] = IN_OUTAGE
    for first, last in trajectory.passes:
        rows = (time >= first) & (time <= last)
        inside = control[(control >= first) & (control <= last)]
        if len(inside) == 0:
            codes[rows] = NO_CONTROL
            continue
        codes[rows & (time < inside[0] - SAME_EPOCH)] = BEFORE_FIRST
        codes[rows & (time > inside[-1] + SAME_EPOCH)] = PAST_LAST
    near = np.searchsorted(control, time)
    gap = np.abs(control[np.clip([near - 1, near], 0, len(control) - 1)] - time).min(axis=0)
    codes[(codes == DRIFT) & (gap <= SAME_EPOCH)] = CONSTRAINED
    return codes


def _is_drift_open(adjustment, solved, parameters, corrected):
    """Mask (n,) of epochs at which control explains less than half of a drift's variance.

    The same must hold for the whole position error: drift and a slow bias may replace each other,
    so that only their sum is known.
    """
    time = adjustment.trajectory.gps_time
    signals = adjustment.errors.pose_signals(parameters)
    mixings = [signal.mixing for signal in signals]
    trend = adjustment.pose_design(time)
    parts = parameters.trend_sigma * trend, *mixings
    whole = sum((part[:, :3] ** 2).sum(axis=(1, 2)) for part in parts)
    is_open = (corrected.position_sigma**2).sum(axis=1) > SETTINGS.determined_ratio * whole
    for number in range(drift_signals(parameters), len(mixings)):
        mixings[number] = np.zeros_like(mixings[number])
    clocks = [signal.clock for signal in signals]
    covariance = solved.predict(time, np.zeros_like(trend), mixings, clocks)[1]
    after = np.einsum("qii->q", covariance[:, :3, :3])
    before = sum((mixing[:, :3] ** 2).sum(axis=(1, 2)) for mixing in mixings)
    return is_open & (after > SETTINGS.determined_ratio * before)


def _is_drifting(adjustment, parameters):
    """Mask (n,) of epochs at which possible drift since its start exceeds the noise of GNSS."""
    stated = adjustment.errors.epochs
    drift = adjustment.errors.pose_signals(parameters)[: drift_signals(parameters)]
    size = sum((signal.mixing[:, :3] ** 2).sum(axis=(1, 2)) for signal in drift)
    return size > (stated.gnss**2).sum(axis=1)


def weak_intervals(codes: np.ndarray, trajectory: Trajectory) -> Iterator[WeakInterval]:
    """Yield a WeakInterval for each run of epochs with one reason, split at the trajectory's gaps.

    Parameters
    ----------
    codes : (n,) int array
        Numbers of the REASONS.
    trajectory : Trajectory
        With its sigmas.
    """
    time = trajectory.gps_time
    part = trajectory.segment(trajectory.gps_time)
    size = np.linalg.norm(trajectory.position_sigma, axis=1)
    lengths = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
    is_empty = ~np.isin(np.arange(len(time)), trajectory.scanned_rows)
    codes = np.where(is_empty, CONSTRAINED, codes)  # no support is needed without points
    cuts = np.flatnonzero(np.diff(codes) | np.diff(part)) + 1
    for first, end in pairwise([0, *cuts.tolist(), len(time)]):
        if codes[first] != CONSTRAINED and end - first > 1:
            rows = slice(first, end)
            yield WeakInterval(
                float(time[first]),
                float(time[end - 1]),
                float(lengths[first : end - 1].sum()),
                float(size[rows].max()),
                REASONS[codes[first]],
                float(lengths[:first].sum()),
            )


@dataclass(frozen=True)
class Jump:
    """A jump of corrected - recorded position.

    Parameters
    ----------
    start, end : float
        Last epoch before and first one after it. Units: s.
    size : tuple of float
        Change of corrected - recorded E, N, H. Units: m.
    step : tuple of float
        Step of the recorded path beyond the vehicle's motion, E, N, H. Units: m.
    """

    start: float
    end: float
    size: tuple[float, float, float]
    step: tuple[float, float, float]

    @property
    def time(self) -> float:
        """Center of the interval. Units: s."""
        return (self.start + self.end) / 2

    @property
    def length(self) -> float:
        """Length of the change. Units: m."""
        return float(np.linalg.norm(self.size))

    def document(self) -> dict[str, object]:
        """The row of ``jumps[]`` in report.json."""
        row = {"time": self.time, "from": self.start, "to": self.end}
        return {**row, "size": list(self.size), "step": list(self.step)}


def find_jumps(correction: Correction) -> tuple[Jump, ...]:
    """Find jumps of a correction, in time order: one at each step of the recorded path.

    Parameters
    ----------
    correction : Correction
    """
    recorded = correction.recorded
    steps = drift_history(recorded).steps
    moved = correction.corrected.position - recorded.position
    first, last = np.searchsorted(recorded.gps_time, [steps.before, steps.after])
    sizes = moved[last] - moved[first]
    return tuple(
        Jump(float(start), float(end), tuple(size.tolist()), tuple(step.tolist()))
        for start, end, size, step in zip(steps.before, steps.after, sizes, steps.size, strict=True)
    )
