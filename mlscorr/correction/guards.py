"""What the control points of a survey can't tell, and sentences about it."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from mlscorr.correction.model import pose_signals, stated_sigmas

FADED = 3.0  # correlation times after which a signal has practically fallen to zero
DETERMINED = 0.5  # posterior over prior variance below which the control points told a component
COMPONENTS = ("easting", "northing", "height", "roll", "pitch", "heading")
FEW = 3  # control points; with less neither the parameters nor a fault can be told
GLOBAL = 0.05  # significance of the global test, both sides together


@dataclass(frozen=True)
class GlobalTest:
    """sigma0^2 times the redundancy against the chi-squared limits of 95 %."""

    statistic: float
    redundancy: int
    lower: float
    upper: float

    @property
    def passed(self):
        return self.lower <= self.statistic <= self.upper


@dataclass(frozen=True)
class Guards:
    """Where the correction stands on control points, and where it doesn't.

    ``gap`` is the longest stretch without control inside a pass (start, end), the ends of passes
    included; ``passes_without_control`` (start, end) of each, in s; ``variance_ratio`` (6,) of
    posterior to prior variance of E, N, H, roll, pitch, heading, the median at control epochs.
    """

    gap: tuple[float, float]
    passes_without_control: tuple[tuple[float, float], ...]
    variance_ratio: np.ndarray
    global_test: GlobalTest | None

    @property
    def determined(self):
        """Which of the six components this geometry tells, (6,) bool."""
        return self.variance_ratio < DETERMINED


def look_at(model, solved, parameters, corrected):
    """Guards of an estimate; corrected is the corrected trajectory with its sigmas."""
    passes = _passes(model.trajectory)
    times = np.sort(model.gps_time)
    seen = [times[(times >= first) & (times <= last)] for first, last in passes]
    return Guards(
        gap=_longest_gap(passes, seen),
        passes_without_control=tuple(
            one for one, inside in zip(passes, seen, strict=True) if not len(inside)
        ),
        variance_ratio=_variance_ratio(model, parameters, corrected),
        global_test=_global_test(solved, model),
    )


def _passes(trajectory):
    """Start and end of each part of the trajectory without gaps. Units: s."""
    starts = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])
    ends = np.append(trajectory.gaps[:, 0], trajectory.gps_time[-1])
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _longest_gap(passes, seen):
    longest = (0.0, 0.0)
    for (first, last), inside in zip(passes, seen, strict=True):
        if len(inside):
            edges = np.concatenate([[first], inside, [last]])
            k = int(np.argmax(np.diff(edges)))
            longest = max(
                longest, (float(edges[k]), float(edges[k + 1])), key=lambda gap: gap[1] - gap[0]
            )
    return longest


def _variance_ratio(model, parameters, corrected):
    """Median over the control epochs of posterior over prior variance (6,), at most one."""
    trajectory = model.trajectory
    rows = np.clip(np.searchsorted(corrected.gps_time, model.gps_time), 0, len(trajectory) - 1)
    at = trajectory.at(trajectory.gps_time[rows])
    sigmas = stated_sigmas(at, model.pos, trajectory)
    # attitude sigmas are stated about body axes, where R diag(s^2) R^T is diagonal
    partials = np.broadcast_to(np.eye(6), (len(rows), 6, 6))
    prior = sum(
        s.mixing @ s.mixing.swapaxes(1, 2) for s in pose_signals(sigmas, parameters, partials)
    )
    body = at.attitude.inv().as_matrix()
    turned = np.einsum("qij,qjk,qik->qi", body, prior[:, 3:, 3:], body)[:, [1, 0, 2]]
    before = np.hstack([np.einsum("qii->qi", prior[:, :3, :3]), turned])
    after = np.hstack([corrected.position_sigma[rows], corrected.attitude_sigma[rows]]) ** 2
    ratio = np.divide(after, before, out=np.ones_like(after), where=before > 0)
    return np.minimum(np.median(ratio, axis=0), 1.0)


def _global_test(solved, model):
    redundancy = model.misclosure.size - len(solved.trend)
    if redundancy < 1:
        return None
    lower, upper = chi2.ppf([GLOBAL / 2, 1 - GLOBAL / 2], redundancy)
    return GlobalTest(solved.sigma0**2 * redundancy, redundancy, float(lower), float(upper))


def few_warnings(model, order, fitted_order):
    """Sentences about control points that are few, all at one epoch, or a lowered order."""
    targets, epochs = len(model.target_rows), model.epochs
    if fitted_order < order:
        yield (
            f"{targets} control points at {epochs} epochs are too few for a "
            f"trend of order {order}, which needs {order + 2}: order {fitted_order} is used."
        )
    if targets < FEW:
        yield (
            f"Only {targets} control {'point takes' if targets == 1 else 'points take'} part: a "
            "wrong one can't be found, and how fast the POS drifts is what it states itself. "
            f"Survey at least {FEW}."
        )
    if epochs == 1 and targets > 1:
        yield (
            f"All {targets} control points were seen within {np.ptp(model.gps_time):.1f} s at "
            f"{model.gps_time.min():.1f} s: the correction is known there, and elsewhere it is "
            "the same shift with growing sigmas."
        )


def warnings_of(guards, model, parameters):
    """Sentences about time without control points, and about the global test."""
    time = max(parameters.drift_time, parameters.bias_time if model.sigmas.jitter.any() else 0.0)
    yield from _extrapolated(model, time)
    length = guards.gap[1] - guards.gap[0]
    first, last = model.span
    if length > FADED * time and first <= guards.gap[0] and guards.gap[1] <= last:
        yield (
            f"No control point for {length:.0f} s from {guards.gap[0]:.1f} s "
            f"({length / time:.1f} correlation times): only the trend applies in the middle of it."
        )
    for first, last in guards.passes_without_control:
        yield (
            f"The pass from {first:.1f} to {last:.1f} s has no control point: only the trend of "
            "the other passes and what is left of their signal correct it."
        )
    test = guards.global_test
    if test is not None and not test.passed:
        side = "more" if test.statistic > test.upper else "less"
        yield (
            f"The global test fails: the misclosures vary {side} than the stated sigmas allow "
            f"(chi-squared {test.statistic:.0f} outside [{test.lower:.0f}, {test.upper:.0f}] of "
            f"{test.redundancy} degrees of freedom). Are the sigmas of control points right?"
        )


def _extrapolated(model, time):
    """Sentences about both ends beyond the control span."""
    first, last = model.span
    ends = model.trajectory.gps_time[[0, -1]]
    for length, where in ((first - ends[0], "before the first"), (ends[1] - last, "past the last")):
        if length > time:
            effect = "only the trend applies" if length >= FADED * time else "it fades to the trend"
            yield (
                f"Signal extrapolated {length:.0f} s {where} control point ({length / time:.1f} "
                f"correlation times): {effect} there."
            )
