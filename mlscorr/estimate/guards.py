"""Limits of the information in a survey's control points, and warnings about them."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import chdtri

from mlscorr.collocation import INTEGRATED
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.posterior import Objective
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import angle_sigma
from mlscorr.pos import SignalParameters
from mlscorr.survey import Statement, Trajectory, control_epochs

COMPONENTS = ("easting", "northing", "height", "roll", "pitch", "heading")


@dataclass(frozen=True)
class GlobalTest:
    """Test of the estimated noise at the targets against the chi-squared limit of the stated noise.

    The scales of the signals are estimated from the same misclosures and absorb much of them, so
    the sum of all weighted squares is not informative; the noise contains no signals, and no part
    of re-acquisitions. Less noise than stated does no harm.

    Parameters
    ----------
    statistic : float
    redundancy : float
        Its degrees of freedom, as Satterthwaite (1946) approximates a sum of unequal squares.
    upper : float
        The limit.
    """

    statistic: float
    redundancy: float
    upper: float

    @property
    def passed(self) -> bool:
        """True if the statistic is within its limit."""
        return self.statistic <= self.upper


@dataclass(frozen=True)
class Guards:
    """Support of the correction by control points, and its absence.

    Parameters
    ----------
    gap : (float, float)
        Start and end of the longest interval without control inside a pass that has some, the ends
        of passes included. Units: s.
    passes_without_control : tuple of (float, float)
        Start and end of each. Units: s.
    variance_ratio : (6,) array
        Posterior over prior variance of E, N, H, roll, pitch, heading: median at control epochs.
    global_test : GlobalTest or None
        None with ties: those within a second share more error than is stated.
    """

    gap: tuple[float, float]
    passes_without_control: tuple[tuple[float, float], ...]
    variance_ratio: np.ndarray
    global_test: GlobalTest | None

    @property
    def determined(self) -> np.ndarray:
        """Mask (6,) of components that this geometry determines."""
        return self.variance_ratio < SETTINGS.determined_ratio

    @property
    def longest_gap(self) -> tuple[float, float]:
        """Start and end of the longest time without control, possibly a whole pass. Units: s."""
        return max([self.gap, *self.passes_without_control], key=np.ptp)


def find_guards(
    adjustment: Adjustment, parameters: SignalParameters, corrected: Trajectory
) -> Guards:
    """Guards of an estimate.

    Parameters
    ----------
    adjustment : Adjustment
    parameters : SignalParameters
    corrected : Trajectory
        With its sigmas.
    """
    ratio = _variance_ratio(adjustment, parameters, corrected)
    if adjustment.ties is not None:
        test = None
    else:
        test = _global_test(adjustment, parameters)
    everywhere = Guards((0.0, 0.0), (), ratio, test)
    return guards_of(adjustment.trajectory.scanned_passes, adjustment.observed, everywhere)


def guards_of(passes: np.ndarray, observed: np.ndarray, guards: Guards) -> Guards:
    """Guards with the gaps of some passes.

    Parameters
    ----------
    passes : (k, 2) array
        Start and end of scanning in each. Units: s.
    observed : (n,) array
        Times of control points. Units: s.
    guards : Guards
        Source of the variance ratio and test.
    """
    times = np.sort(observed)
    gaps: list[tuple[float, float]] = []
    empty = []
    for first, last in passes.tolist():
        inside = times[(times >= first) & (times <= last)].tolist()
        if inside:
            gaps += pairwise([first, *inside, last])
        else:
            empty.append((first, last))
    return replace(
        guards,
        gap=max(gaps, key=np.ptp, default=(0.0, 0.0)),
        passes_without_control=tuple(empty),
    )


def _variance_ratio(adjustment, parameters, corrected):
    """Median over the control epochs of posterior over prior variance (6,), at most one."""
    trajectory = adjustment.trajectory
    if len(adjustment.observed) == 0:
        return np.ones(6)
    last = len(trajectory) - 1
    rows = np.clip(np.searchsorted(corrected.gps_time, adjustment.observed), 0, last)
    rotation = adjustment.errors.epochs.at(rows).rotation
    trend = parameters.trend_sigma * adjustment.pose_design(trajectory.gps_time[rows])
    parts = trend, *(signal.mixing for signal in adjustment.errors.pose_signals(parameters, rows))
    prior = sum(part @ part.swapaxes(1, 2) for part in parts)
    turned = angle_sigma(rotation, prior[:, 3:, 3:])
    before = np.hstack([np.einsum("qii->qi", prior[:, :3, :3]), turned**2])
    after = np.hstack([corrected.position_sigma[rows], corrected.attitude_sigma[rows]]) ** 2
    ratio = np.divide(after, before, out=np.ones_like(after), where=before > 0)
    return np.minimum(np.median(ratio, axis=0), 1.0)


def _global_test(adjustment, parameters):
    """GlobalTest by w' N w of w = P l, whose covariance is P; None without redundancy."""
    if len(adjustment.target_rows) == 0:
        return None
    moments = np.zeros(3)  # value, expectation and variance
    for block in Objective.of(adjustment).blocks:
        solved = block.solve(parameters)
        rows = np.arange(3 * len(block.names))
        projected = solved.projected[rows]
        noise = block.targets.noise.block(rows)
        weights = solved.weights[rows]
        precision = solved.solver.precision(rows)
        shares = (precision - projected @ projected.T) @ noise
        moments += weights @ noise @ weights, np.trace(shares), 2 * np.sum(shares * shares.T)
    statistic, expected, variance = moments
    if expected < SETTINGS.smallest_redundancy:
        return None
    redundancy = 2 * expected**2 / variance
    upper = chdtri(redundancy, SETTINGS.significance)
    return GlobalTest(float(statistic * redundancy / expected), float(redundancy), float(upper))


def sparse_warnings(adjustment: Adjustment, order: int) -> Iterator[Statement]:
    """Statements about control points that are few, all at one epoch, or a lowered order.

    Parameters
    ----------
    adjustment : Adjustment
    order : int
        Of the trend, as asked for.
    """
    targets = len(adjustment.target_rows)
    epochs = len(control_epochs(adjustment.observed))
    if adjustment.order < order:
        values = {"targets": targets, "epochs": epochs, "asked": order, "order": adjustment.order}
        yield Statement("lowered order", "warning", values)
    yield from few_targets(targets)
    if epochs == 1 and targets > 1:
        values = {
            "targets": targets,
            "seconds": float(np.ptp(adjustment.observed)),
            "start": float(adjustment.observed.min()),
        }
        yield Statement("one epoch", "warning", values)


def few_targets(targets: int) -> Iterator[Statement]:
    """Yield a Statement if a wrong control point could not be found.

    Parameters
    ----------
    targets : int
        Number of control points in use.
    """
    if 0 < targets < SETTINGS.smallest_targets:
        values = {"targets": targets, "least": SETTINGS.smallest_targets}
        yield Statement("few targets", "warning", values)


def guard_warnings(
    guards: Guards, adjustment: Adjustment, parameters: SignalParameters
) -> Iterator[Statement]:
    """Statements about time without control points, and about the global test.

    Parameters
    ----------
    guards : Guards
    adjustment : Adjustment
    parameters : SignalParameters
    """
    if len(adjustment.names) == 0:
        yield Statement("relative only", "warning")
        return
    time = parameters.bias_time
    if parameters.family != INTEGRATED:
        time = max(time, parameters.drift_time)
    ties = adjustment.ties
    if ties is None:  # they support gaps in control, and Support reports unsupported ones
        yield from _extrapolated(adjustment, time)
        yield from _faded(adjustment, time, *guards.gap)
    for first, last in guards.passes_without_control:
        if ties is None or not np.any((ties.gps_time >= first) & (ties.gps_time <= last)):
            yield Statement("pass without control", "warning", {"first": first, "last": last})
    yield from global_test_warnings(guards)


def global_test_warnings(guards: Guards) -> Iterator[Statement]:
    """Yield a Statement if the global test fails.

    Parameters
    ----------
    guards : Guards
    """
    test = guards.global_test
    if test is not None and not test.passed:
        yield Statement("global test", "warning", asdict(test))


def _scanned_times(adjustment):
    """Times (k,) of the trajectory with points of the clouds. Units: s."""
    return adjustment.trajectory.gps_time[adjustment.trajectory.scanned_rows]


def _extrapolated(adjustment, time):
    """Statements about both ends beyond the control span."""
    first, last = adjustment.span
    ends = _scanned_times(adjustment)[[0, -1]]
    for length, side in ((first - ends[0], "before the first"), (ends[1] - last, "past the last")):
        if length > time:
            values = {
                "seconds": float(length),
                "side": side,
                "correlation_times": float(length / time),
                "is_faded": bool(length >= SETTINGS.faded_times * time),
            }
            yield Statement("extrapolated", "warning", values)


def _faded(adjustment, time, start, end):
    """Statement on the longest gap between control points, if signals fade in it."""
    first, last = adjustment.span
    scanned = _scanned_times(adjustment)
    length = end - start
    away = np.minimum(scanned - start, end - scanned).max(initial=0.0)
    if 2 * away > SETTINGS.faded_times * time and first <= start and end <= last:
        values = {"seconds": length, "start": start, "correlation_times": length / time}
        yield Statement("faded", "warning", values)
