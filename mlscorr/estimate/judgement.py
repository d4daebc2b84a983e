"""Rejected control points: wrong, or correct but near an unstated drift of the POS.

A wrong point has one error vector in all its passes, a wrong setup of the instrument moves
neighboring points likewise, and control points are seldom wrong in great numbers. Drift comes and
goes between two points, differs from pass to pass, and moves everything observed within a second.
The evidence of both hypotheses and their prior odds decide, for each group of related rejected
points; if drift is far more likely, the sigma is inflated there and the estimation is repeated.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import Screening, error_evidence
from mlscorr.matching import log_share
from mlscorr.pos import SETTINGS as POS_SETTINGS
from mlscorr.pos import runs
from mlscorr.survey import Statement, Trajectory


@dataclass(frozen=True)
class UnstatedDrift:
    """An interval in which the POS drifts by more than its sigmas state.

    Parameters
    ----------
    first, last : float
        Times of the observed control points that constrain it, or the end of the pass if there are
        none. Units: s.
    size : float
        One sigma per axis at its largest. Units: m.
    is_open : bool
        True if no control point constrains its end.
    names : tuple of str
        Control points observed in it.
    """

    first: float
    last: float
    size: float
    is_open: bool
    names: tuple[str, ...]

    def course(self, gps_time: np.ndarray) -> np.ndarray:
        """Fraction (n,) of its size at each time, like an integrated random walk between its ends.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        share = np.clip((gps_time - self.first) / (self.last - self.first), 0.0, 1.0)
        inside = (gps_time >= self.first) & (gps_time <= self.last)
        if self.is_open:
            return np.where(inside, share**1.5, 0.0)
        return np.where(inside, (4.0 * share * (1.0 - share)) ** 1.5, 0.0)

    @property
    def statement(self) -> Statement:
        """A warning that the POS drifts there by more than it states."""
        values = {"names": self.names, "size": self.size, "first": self.first, "last": self.last}
        return Statement("unstated drift", "warning", values)


def with_drifts(trajectory: Trajectory, drifts: tuple[UnstatedDrift, ...]) -> Trajectory:
    """Return the trajectory with an inflated sigma of its position in unstated drifts.

    Parameters
    ----------
    trajectory : Trajectory
        One without sigmas gets those of a POS with GNSS.
    drifts : tuple of UnstatedDrift
    """
    sigma = trajectory.position_sigma
    if sigma is None:
        sigma = np.tile(POS_SETTINGS.gnss, (len(trajectory), 1))
    variance = sigma**2
    for drift in drifts:
        variance = variance + (drift.size * drift.course(trajectory.gps_time)[:, None]) ** 2
    return replace(trajectory, position_sigma=np.sqrt(variance))


@dataclass(frozen=True)
class Judgement:
    """Probability that each rejected point is correct, and the drifts to allow for.

    Parameters
    ----------
    probability : dict of str to float
        By the name of each rejected target.
    drifts : tuple of UnstatedDrift
        Drifts that are far more likely.
    """

    probability: Mapping[str, float]
    drifts: tuple[UnstatedDrift, ...]


def judge(adjustment: Adjustment, screening: Screening, known: int = 0) -> Judgement:
    """Compare gross errors of all rejected targets with drift of the POS near them.

    With n groups of related rejected targets, n + 1 hypotheses are compared: drift near none of
    them, near the most likely one, near the two most likely ones, and so on.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    screening : Screening
        Of these targets.
    known : int
        Number of unstated drifts already included in the sigmas.
    """
    rejected = {test.name: test for test in screening.outliers}
    if not rejected:
        return Judgement({}, ())
    parameters = screening.posterior.modes[0][0]
    groups = []
    for names, bursts in _groups(adjustment, rejected):
        others = adjustment.without(rejected.keys() - set(names))
        solved = others.solve(parameters)
        sized = [_sized(burst, adjustment, rejected) for burst in bursts]
        groups.append(_Group.of(others, names, sized, solved))
    drifting, posterior = _in_order(adjustment, groups, known)
    share = np.exp(posterior - posterior.max())
    share /= share.sum()
    probability = {}
    drifts: list[UnstatedDrift] = []
    is_likely = True
    for number, group in enumerate(drifting, 1):
        correct = share[number:].sum()
        probability |= dict.fromkeys(group.names, float(correct))
        # drift near the groups before it is known by now
        is_likely = is_likely and correct > SETTINGS.strong_evidence * share[number - 1]
        if is_likely:
            drifts += group.drifts
    return Judgement(probability, tuple(sorted(drifts, key=lambda drift: drift.first)))


def _in_order(adjustment, groups, known):
    """Groups (n,), the one with the most likely drift first, and the log posteriors (n + 1,) of
    drift near the first k of them.
    """
    drifting: list[_Group] = []
    posterior = [_log_posterior(adjustment, drifting, groups, known)]
    while groups:
        candidates = [
            _log_posterior(adjustment, [*drifting, group], _others(groups, group), known)
            for group in groups
        ]
        drifting.append(groups.pop(int(np.argmax(candidates))))
        posterior.append(max(candidates))
    return drifting, np.array(posterior)


class _Group(NamedTuple):
    """Rejected targets that follow each other in time, in one pass or several.

    Parameters
    ----------
    names : tuple of str
    wrong, drift : float
        Log evidence that they are wrong, and that the POS drifts near them.
    drifts : tuple of UnstatedDrift
        Drifts that explain them.
    """

    names: tuple[str, ...]
    wrong: float
    drift: float
    drifts: tuple[UnstatedDrift, ...]

    @classmethod
    def of(cls, adjustment, names, bursts, solved):
        time = adjustment.observed
        inside = np.isin(adjustment.names, names)
        for burst in bursts:
            inside |= (time > burst.first) & (time < burst.last)
        inside = np.flatnonzero(inside)
        rows = (3 * inside[:, None] + np.arange(3)).ravel()
        normal = solved.weights[rows], solved.precision_of(rows)
        wrong = _wrong_evidence(normal, adjustment.names[inside], names)
        drift = 0.0
        drifts = []
        courses = np.empty((len(inside), 0))
        for burst in bursts:
            tried = [np.column_stack([courses, own]) for own in _courses_of(burst, time[inside])]
            evidence = [error_evidence(*normal, each) for each in tried]
            if max(evidence) > drift:
                drift = max(evidence)
                courses = tried[int(np.argmax(evidence))]
                drifts.append(burst)
        return cls(names, wrong, drift, tuple(drifts))


def _others(groups, group):
    return [other for other in groups if other is not group]


def _log_posterior(adjustment, drifting, others, known):
    """Log posterior of drift of the POS near some groups, with gross errors of all others."""
    wrong = sum(len(group.names) for group in others)
    bursts = known + sum(len(group.drifts) for group in drifting)
    evidence = sum(group.drift for group in drifting) + sum(group.wrong for group in others)
    prior = log_share(wrong, len(adjustment.target_rows), SETTINGS.gross_share)
    often = np.log(0.5) + log_share(bursts, len(adjustment.names), 0.5)
    if bursts == 0:  # the POS may well never have unstated drift
        often = np.logaddexp(often, np.log(0.5))
    return evidence + prior + often


def _groups(adjustment, rejected):
    """Names of related rejected targets, with an UnstatedDrift of each run of them."""
    order = np.argsort(adjustment.observed, kind="stable")
    time = adjustment.observed[order]
    names = adjustment.names[order]
    is_out = np.isin(names, list(rejected))
    passes = np.flatnonzero(np.diff(adjustment.trajectory.segment(time))) + 1
    spans = runs(is_out, passes)
    number = {name: k for k, name in enumerate(rejected)}
    edges = [(number[name], k) for k, (i, j) in enumerate(spans) for name in set(names[i:j])]
    target, run = np.array(edges).T
    size = len(number) + len(spans)
    graph = coo_array((np.ones(len(edges)), (target, len(number) + run)), (size, size))
    label = connected_components(graph, directed=False)[1]
    for group in np.unique(label):
        own = tuple(name for name in rejected if label[number[name]] == group)
        bursts = [
            _burst(adjustment.trajectory, time, names, *rows)
            for k, rows in enumerate(spans)
            if label[len(number) + k] == group
        ]
        yield own, [burst for burst in bursts if burst.first < burst.last]


def _burst(trajectory, time, names, start, end):
    """The UnstatedDrift of a run of observations, of unit size."""
    begin, finish = trajectory.passes[trajectory.segment(time[start])]
    # so that a target observed in the first or last epoch of a pass is inside
    begin = np.nextafter(begin, -np.inf)
    finish = np.nextafter(finish, np.inf)
    interval = POS_SETTINGS.sigma_interval  # observations within it share their drift
    first = time[time < time[start] - interval].max(initial=begin)
    last = time[time > time[end - 1] + interval].min(initial=finish)
    is_open = bool(last == finish)
    return UnstatedDrift(
        float(first), float(last), 1.0, is_open, tuple(dict.fromkeys(names[start:end]))
    )


def _wrong_evidence(normal, observed, names):
    """Log evidence that targets are wrong: each, in all passes or in one; or all by one setup."""
    courses = [(observed == name).astype(float) for name in names]
    setup = error_evidence(*normal, np.sum(courses, axis=0))
    evidence = error_evidence(*normal, np.column_stack(courses))
    for number, course in enumerate(courses):
        passes = np.flatnonzero(course)
        if len(passes) == 1:
            continue
        for single in np.eye(len(observed))[passes]:
            tried = [*courses[:number], single, *courses[number + 1 :]]
            gain = error_evidence(*normal, np.column_stack(tried))
            if gain > evidence:
                evidence = gain
                courses = tried
    return max(evidence, setup)


def _courses_of(burst, time):
    """Courses of a drift: a walk constrained at its ends, a constant one, and any other one.

    Observations within a second share their drift.
    """
    inside = (time > burst.first) & (time < burst.last)
    walk = burst.course(time)
    order = np.argsort(time, kind="stable")
    is_new = np.diff(time[order], prepend=-np.inf) > POS_SETTINGS.sigma_interval
    moment = np.empty(len(time), int)
    moment[order] = np.cumsum(is_new)
    free = (moment[:, None] == np.unique(moment[inside])) & inside[:, None]
    return walk / walk.max(), inside, free


def _sized(burst, adjustment, rejected):
    """The drift, scaled to the deviations of its rejected targets."""
    time = adjustment.observed
    inside = (time > burst.first) & (time < burst.last)
    deviations = [
        rejected[name].left_out[inside[adjustment.names == name]].mean(axis=0)
        for name in burst.names
    ]
    return replace(burst, size=float(np.sqrt(np.mean(np.square(deviations)))))


def doubtful_drift(
    adjustment: Adjustment, screening: Screening, probability: Mapping[str, float]
) -> np.ndarray:
    """One sigma (n, 3) of possible drift at every epoch, as rejected targets show. Units: m.

    With the probability p that a target is correct, the POS error there is its deviation d: p d d^T
    is added to the covariance of the estimate without it. Between targets it is linear in time, and
    zero at those in use.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    screening : Screening
        Of these targets.
    probability : dict of str to float
        By the name of each rejected target.
    """
    deviation = np.zeros((len(adjustment.names), 3))
    for test in screening.outliers:
        share = np.sqrt(probability[test.name])
        deviation[adjustment.names == test.name] = share * test.left_out
    order = np.argsort(adjustment.observed, kind="stable")
    time = adjustment.trajectory.gps_time
    known = adjustment.observed[order]
    return np.column_stack([np.interp(time, known, axis) for axis in deviation[order].T])


def doubts(
    adjustment: Adjustment, screening: Screening, probability: Mapping[str, float]
) -> tuple[Statement, ...]:
    """Warning about rejected targets that are more probably correct than wrong.

    Parameters
    ----------
    adjustment, screening, probability
        See ``doubtful_drift``.
    """
    doubtful = [test for test in screening.outliers if probability[test.name] > 0.5]
    if not doubtful:
        return ()
    size = max(np.linalg.norm(test.left_out, axis=1).max() for test in doubtful)
    p = max(probability[test.name] for test in doubtful)
    values = {
        "names": tuple(test.name for test in doubtful),
        "targets": len(adjustment.target_rows),
        "size": float(size),
        "odds": p / (1.0 - p),
    }
    return (Statement("wrong or drift", "warning", values),)
