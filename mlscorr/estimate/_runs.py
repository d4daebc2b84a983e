"""Rejected control points near which the POS has an unstated drift.

A misread control point is isolated. If neighbors in time are all rejected with similar deviations,
the error is the POS's: its sigma is inflated there, as it grows between two places with GNSS, and
the estimation is repeated. If they deviate equally in another pass, the points are wrong, for
example by one setup of the instrument: no POS drifts twice in the same way.

Points rejected after that may still show drift that comes and goes between two points. But a wrong
point has the same error in all its passes, observations within a second share their drift, and
control points are seldom wrong in great numbers: the odds of both hypotheses decide.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.posterior import choose_parameters
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import Screening, TargetTest, all_tests, gross_evidence
from mlscorr.matching import log_share
from mlscorr.pos import SETTINGS as POS_SETTINGS
from mlscorr.pos import SignalParameters, runs
from mlscorr.survey import Statement, Trajectory


@dataclass(frozen=True)
class DriftWindow:
    """An interval of drift that the POS doesn't state.

    Parameters
    ----------
    first, last : float
        Times of the control points that bound it; the pass's end if there is none. Units: s.
    size : float
        One sigma per axis at its center. Units: m.
    is_open : bool
        True if no control point bounds its end.
    names : tuple of str
        The control points in it.
    """

    first: float
    last: float
    size: float
    is_open: bool
    names: tuple[str, ...]

    def sigma(self, gps_time: np.ndarray) -> np.ndarray:
        """One sigma (n,) of an integrated random walk with fixed ends. Units: m.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        share = np.clip((gps_time - self.first) / (self.last - self.first), 0.0, 1.0)
        held = share if self.is_open else 4.0 * share * (1.0 - share)
        inside = (gps_time >= self.first) & (gps_time <= self.last)
        return np.where(inside, self.size * held**1.5, 0.0)

    @property
    def statement(self) -> Statement:
        """Statement that the POS drifts there by more than its sigmas."""
        values = {"names": self.names, "size": self.size, "first": self.first, "last": self.last}
        return Statement("unstated drift", "warning", values)


def find_windows(adjustment: Adjustment, screening: Screening) -> tuple[DriftWindow, ...]:
    """Find intervals in which neighbors in time were rejected with similar deviations.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    screening : Screening
        Of these equations.
    """
    rejected = {test.name: test for test in screening.outliers}
    order = np.argsort(adjustment.observed, kind="stable")
    names = adjustment.names[order]
    times = adjustment.observed[order]
    is_out = np.isin(names, list(rejected))
    passes = np.flatnonzero(np.diff(adjustment.trajectory.segment(times))) + 1
    windows = []
    for start, end in runs(is_out, passes):
        rows = order[start:end]
        run = dict.fromkeys(names[start:end].tolist())
        deviations = [_Deviation.of(adjustment, rejected[name], rows) for name in run]
        if _is_drift(deviations):
            windows.append(_window(adjustment.trajectory, times, start, end, deviations))
    return tuple(w for w in windows if w.first < w.last)  # others were passed at the same time


class _Deviation(NamedTuple):
    """Deviations of a rejected target in a run (i, 3), with sigma, and outside of it (o, 3)."""

    name: str
    inside: np.ndarray
    sigma: np.ndarray
    beyond: np.ndarray

    @classmethod
    def of(cls, adjustment, test: TargetTest, rows):
        inside = np.isin(np.flatnonzero(adjustment.names == test.name), rows)
        return cls(test.name, test.left_out[inside], test.sigma[inside], test.left_out[~inside])


def _is_drift(run):
    """True if a run of targets agrees in direction, and does not deviate likewise elsewhere."""
    ways = np.array([deviation.inside.mean(axis=0) for deviation in run])
    if len(ways) < 2:
        return False
    if len(ways) == 2:
        sigma = np.linalg.norm(np.vstack([deviation.sigma for deviation in run]))
        if np.linalg.norm(ways[1] - ways[0]) < SETTINGS.setup_sigmas * sigma:
            return False
    beyond = np.vstack([deviation.beyond for deviation in run])
    apart = beyond - np.repeat(ways, [len(deviation.beyond) for deviation in run], axis=0)
    if np.sum(apart**2) < np.sum(beyond**2):
        return False
    return np.linalg.norm(ways.mean(axis=0)) > 0.5 * np.linalg.norm(ways, axis=1).mean()


def _window(trajectory, times, start, end, run):
    begin, finish = trajectory.passes[trajectory.segment(times[start])]
    last_before = times[start - 1] if start > 0 else -np.inf
    first_after = times[end] if end < len(times) else np.inf
    ways = np.vstack([deviation.inside for deviation in run])
    size = float(np.sqrt(np.mean(np.sum(ways**2, axis=1)) / 3))
    first = max(begin, last_before)
    last = min(finish, first_after)
    names = tuple(deviation.name for deviation in run)
    return DriftWindow(float(first), float(last), size, bool(first_after > finish), names)


def with_windows(trajectory: Trajectory, windows: tuple[DriftWindow, ...]) -> Trajectory:
    """Return the trajectory with its position sigma inflated in windows of drift.

    Parameters
    ----------
    trajectory : Trajectory
        Without sigmas it gets those of a POS with GNSS.
    windows : tuple of DriftWindow
    """
    sigma = trajectory.position_sigma
    if sigma is None:
        sigma = np.tile(POS_SETTINGS.gnss, (len(trajectory), 1))
    variance = sigma**2
    for window in windows:
        variance = variance + window.sigma(trajectory.gps_time)[:, None] ** 2
    return replace(trajectory, position_sigma=np.sqrt(variance))


def weighed_refusals(
    adjustment: Adjustment, plain: Adjustment, screening: Screening, windows: int
) -> Screening:
    """Return a Screening that rejects no more targets than are probably wrong.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    plain : Adjustment
        The same before any inflation in windows, for a POS with unstated drift.
    screening : Screening
        Of the former.
    windows : int
        Number of intervals of known unstated drift.
    """
    rejected = screening.outliers
    refused = {test.name for test in rejected}
    names = [name for name in adjustment.target_rows if name in refused]
    odds = drift_odds(adjustment, names, screening.posterior.modes[0][0], windows)
    if not names or odds <= 0.0:
        return screening
    size = max(np.linalg.norm(test.left_out, axis=1).max() for test in rejected)
    values = {"names": tuple(names), "targets": len(adjustment.target_rows), "size": float(size)}
    if odds < np.log(SETTINGS.strong_evidence):
        doubt = Statement("wrong or drift", "warning", values | {"odds": float(np.exp(odds))})
        warnings = (*screening.warnings, doubt)
        return replace(screening, warnings=warnings, drift_probability=float(expit(odds)))
    doubt = Statement("rather drift", "warning", values)
    posterior = choose_parameters(plain)
    return Screening(posterior, (), tuple(all_tests(plain, posterior)), (doubt,))


def doubtful_drift(adjustment: Adjustment, screening: Screening) -> np.ndarray:
    """One sigma (n, 3) at every epoch of the drift that refused targets may show. Units: m.

    With the probability p that they are correct, the POS error there is their deviation d: p d d^T
    is added to the covariance of the estimate without them. Between targets it is linear in time,
    and zero at those in use.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    screening : Screening
        Of these targets.
    """
    deviation = np.zeros((len(adjustment.names), 3))
    for test in screening.outliers:
        deviation[adjustment.names == test.name] = test.left_out
    order = np.argsort(adjustment.observed, kind="stable")
    time = adjustment.trajectory.gps_time
    known = adjustment.observed[order]
    drift = np.column_stack([np.interp(time, known, axis) for axis in deviation[order].T])
    return np.sqrt(screening.drift_probability) * drift


def drift_odds(
    adjustment: Adjustment, names: Collection[str], parameters: SignalParameters, windows: int
) -> float:
    """Log odds of drift at each of some targets against a gross error of each.

    Both are equally probable a priori: a fraction of the targets is wrong, with mean gross_share,
    and any fraction of the observations is affected by unstated drift.

    Parameters
    ----------
    adjustment : Adjustment
        Of all targets.
    names : collection of str
        Names of rejected ones.
    parameters : SignalParameters
        Chosen by the other targets.
    windows : int
        Number of intervals of known drift of this kind.
    """
    odds = 0.0
    drifts = windows
    for name in names:
        others = adjustment.without(set(names) - {name})
        solved = others.solve(parameters)
        passes = np.flatnonzero(others.names == name).tolist()
        misread = gross_evidence(solved, {name: others.target_rows[name]})[name]
        mistaken = _positive(solved, {number: _rows([number]) for number in passes})
        drift = _positive(solved, {number: _rows(_beside(others, number)) for number in passes})
        odds += sum(drift) - max(misread, sum(mistaken))
        drifts += len(drift)
    if windows:  # without any, the POS may never drift so
        odds -= log_share(windows, len(adjustment.names), 0.5)
    odds += log_share(drifts, len(adjustment.names), 0.5)
    return odds - log_share(len(names), len(adjustment.target_rows), SETTINGS.gross_share)


def _positive(solved, rows_of):
    """Evidence of those errors that are more probable than no error."""
    return [gain for gain in gross_evidence(solved, rows_of).values() if gain > 0.0]


def _beside(adjustment, number):
    """Indices of all observations within a second of one."""
    times = adjustment.observed
    return np.flatnonzero(np.abs(times - times[number]) <= POS_SETTINGS.sigma_interval)


def _rows(numbers):
    return (3 * np.array(numbers)[:, None] + np.arange(3)).ravel()
