"""Tests of each control point against the others, and the search for outliers.

Wrong points mask each other: they pass as drift, or increase the scale until nothing is unlikely.
So the search doesn't start from the parameters estimated from all points together. It eliminates
the most unlikely points under parameters of many scales, chooses by the Bayes factor between "gross
error" and "drift", repeats the estimation, and finally tests every point against the remaining
ones.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import chdtri, ndtri

from mlscorr.collocation import INTEGRATED, Collocation
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.posterior import Objective, Posterior, choose_parameters, most_probable
from mlscorr.estimate.settings import SETTINGS
from mlscorr.survey import Statement


@dataclass(frozen=True)
class TargetTest:
    """Test of one target, of k passes, against the others.

    Parameters
    ----------
    name : str
    statistic, critical : float
        Chi-squared, and its critical value.
    left_out, sigma : (k, 3) array
        Leave-one-out misclosures, and their sigmas. Units: m.
    redundancy : (k, 3) array
        The fraction of an error that its residual shows.
    """

    name: str
    statistic: float
    critical: float
    left_out: np.ndarray
    sigma: np.ndarray
    redundancy: np.ndarray

    @property
    def w(self) -> np.ndarray:
        """Data snooping's w (k, 3): standard normal without a gross error."""
        return self.left_out / self.sigma

    @property
    def detectable(self) -> np.ndarray:
        """Smallest error (k, 3) that w detects in 4 of 5 cases. Units: m."""
        factor = -ndtri(SETTINGS.significance / 2) - ndtri(SETTINGS.undetected)
        return factor * self.sigma  # Baarda's usual 4.13

    @property
    def excess(self) -> float:
        """Statistic over critical value."""
        return self.statistic / self.critical

    def document(self) -> dict[str, str | float]:
        """The entry of an outlier in report.json."""
        return {"name": self.name, "statistic": self.statistic, "critical": self.critical}


def all_tests(
    adjustment: Adjustment, posterior: Posterior, visit: Callable | None = None
) -> list[TargetTest]:
    """Return a TargetTest of each target against all others.

    Parameters
    ----------
    adjustment : Adjustment
    posterior : Posterior
        Of the parameters, by these equations.
    visit : function of SignalParameters and a Collocation, optional
        Called with each solution of these equations while it is in memory, for further results.
    """
    tests = []
    targets = len(adjustment.target_rows)
    for block in Objective.of(adjustment).blocks:
        if len(block.names) < len(adjustment.names):  # visitors need whole solutions
            visit = None
        tests += _tests(block, block.target_rows, posterior, targets, visit)
    return tests


def single_test(adjustment: Adjustment, name: str, posterior: Posterior) -> TargetTest:
    """Return a TargetTest of one target against all others.

    Parameters
    ----------
    adjustment : Adjustment
        Including this target.
    name : str
    posterior : Posterior
        Of the parameters, by the others.
    """
    block = next(block for block in Objective.of(adjustment).blocks if name in block.names)
    return _tests(block, [name], posterior, len(adjustment.target_rows))[0]


def _tests(adjustment, names, posterior, targets, visit=None):
    """TargetTests of some targets, by one Collocation at a time: many would fill the memory."""
    left_out = {name: [] for name in names}
    # targets of several passes first: sparse rows release the factor that these need for the
    # inverse, which those of one pass need, and the visitor
    largest_first = sorted(names, key=lambda name: -len(adjustment.target_rows[name]))
    for chosen, weight in reversed(posterior.mixture):  # a visitor may keep the most probable
        solved = adjustment.solve(chosen)
        for name in largest_first:
            left_out[name].append((weight, *solved.leave_out(adjustment.target_rows[name])))
        if visit is not None:
            visit(chosen, solved)
        del solved  # before the next one takes as much
    return [_test(adjustment, name, parts[::-1], targets) for name, parts in left_out.items()]


def _test(adjustment, name, left_out, targets):
    """TargetTest by the leave-one-out misclosure, averaged over the parameters.

    The uncertainty of the parameters is included in its covariance, so that the test depends
    neither on an overconfident mode nor on one that the target itself has inflated.
    """
    rows = adjustment.target_rows[name]
    critical = float(chdtri(len(rows), SETTINGS.significance / targets))
    mean = 0.0
    square = 0.0
    for weight, residual, covariance in left_out:
        mean = mean + weight * residual
        square = square + weight * (covariance + np.outer(residual, residual))
    covariance = square - np.outer(mean, mean)
    redundancy = np.diag(adjustment.targets.noise.block(rows) @ np.linalg.inv(covariance))
    statistic = float(mean @ np.linalg.solve(covariance, mean))
    parts = (mean, np.sqrt(np.diag(covariance)), redundancy)
    return TargetTest(name, statistic, critical, *(part.reshape(-1, 3) for part in parts))


def error_evidence(weights: np.ndarray, precision: np.ndarray, course: np.ndarray) -> float:
    """Log Bayes factor of errors in k observations against none.

    With b = E^T V^-1 (l - A x) and M = E^T V^-1 E of the design matrix E of the errors, errors of
    sigma s have the log factor (s^2 b^T (I + s^2 M)^-1 b - log det(I + s^2 M)) / 2, along the
    eigenvectors of M; averaged over the sizes that gross errors have.

    Parameters
    ----------
    weights : (3 k,) array
        V^-1 (l - A x) of the observations, from a Collocation.
    precision : (3 k, 3 k) array
        Their block of V^-1 without the trend. Units: 1/m^2.
    course : (k,) or (k, q) array
        Fraction of one error vector, or of each of q, in each observation.
    """
    design = np.kron(np.reshape(course, (len(weights) // 3, -1)), np.eye(3))
    return float(_evidence(design.T @ weights, design.T @ precision @ design))


def gross_evidence(solved: Collocation, rows_of: dict) -> dict:
    """Log Bayes factor of one error vector in all observations of a target, by name.

    Parameters
    ----------
    solved : Collocation
    rows_of : dict
        Rows of three each by name.
    """
    score = [solved.weights[rows].reshape(-1, 3).sum(axis=0) for rows in rows_of.values()]
    blocks = [
        solved.precision_of(rows).reshape(-1, 3, len(rows) // 3, 3) for rows in rows_of.values()
    ]
    gains = _evidence(np.array(score), np.array([block.sum(axis=(0, 2)) for block in blocks]))
    return dict(zip(rows_of, gains.tolist(), strict=True))


def _evidence(score, precision):
    """Log Bayes factors (...,) by b (..., q) and M (..., q, q) of error_evidence."""
    values, vectors = np.linalg.eigh(precision)
    along = np.einsum("...ij,...i->...j", vectors, score) ** 2
    variance = np.square(SETTINGS.gross_sizes).reshape(-1, *(1,) * values.ndim)
    more = 1.0 + variance * np.maximum(values, 0.0)
    density = 0.5 * np.sum(variance * along / more - np.log(more), axis=-1)
    return np.logaddexp.reduce(density, axis=0) - np.log(len(SETTINGS.gross_sizes))


@dataclass(frozen=True)
class Screening:
    """Accepted and rejected targets.

    Parameters
    ----------
    posterior : Posterior
        Of the parameters, by the accepted targets.
    outliers : tuple of TargetTest
        Of targets that contradict the others.
    tests : tuple of TargetTest
        Of the accepted targets.
    warnings : tuple of Statement
    """

    posterior: Posterior
    outliers: tuple[TargetTest, ...]
    tests: tuple[TargetTest, ...]
    warnings: tuple[Statement, ...]

    @classmethod
    def untested(cls, adjustment: Adjustment) -> Screening:
        """Return a Screening without any test, under the prior parameters."""
        objective = Objective.of(adjustment)
        mode = ((objective.parameters(INTEGRATED, objective.initial), 1.0),)
        return cls(Posterior(mode, mode), (), (), ())


def screen(adjustment: Adjustment, kept_in: Collection[str] = ()) -> Screening:
    """Find gross errors among targets, and test every target against the others.

    Parameters
    ----------
    adjustment : Adjustment
    kept_in : collection of str
        Names of targets that are never rejected.
    """
    out, start = _search(adjustment, kept_in)
    tried = []
    while True:
        kept = adjustment.without(out)
        posterior = choose_parameters(kept, start)
        start = [chosen for chosen, _ in posterior.modes]
        tests = all_tests(kept, posterior)
        rejected = [single_test(adjustment.without(out - {name}), name, posterior) for name in out]
        back = {test.name for test in rejected if test.excess <= 1.0}
        worst = _worst(tests, kept_in)
        tried.append(out)
        changed = out - back
        if (
            not back
            and worst is not None
            and worst.excess > 1.0
            and may_go(adjustment, out | {worst.name})
        ):
            changed = out | {worst.name}
        if changed in tried:
            break
        out = changed
    return Screening(
        posterior,
        tuple(sorted(rejected, key=lambda test: -test.excess)),
        tuple(tests),
        (*_rejected_groups(adjustment, rejected), *_doubtful_pairs(kept, posterior)),
    )


def _worst(tests, kept_in):
    """Test of the removable target that contradicts the others most."""
    free = [test for test in tests if test.name not in kept_in]
    return max(free, key=lambda test: test.excess, default=None)


def may_go(adjustment: Adjustment, names: Collection[str]) -> bool:
    """Return True if this number of targets may be wrong, and enough remain.

    Parameters
    ----------
    adjustment : Adjustment
    names : collection of str
    """
    total = len(adjustment.target_rows)
    return (
        len(names) <= SETTINGS.breakdown * total
        and total - len(names) >= SETTINGS.screened_targets - 1
    )


def _search(adjustment, kept_in):
    """Names of the most probable set of wrong targets, and each family's SignalParameters.

    Large surveys are searched block by block.
    """
    best = frozenset()
    modes = ()
    for _ in range(SETTINGS.rounds):
        modes = [chosen for chosen, _ in most_probable(adjustment.without(best), modes)]
        names = frozenset()
        for block in Objective.of(adjustment).blocks:
            scores = _scores(block, modes, kept_in)
            names |= max(scores, key=scores.get)
        if names == best:
            break
        best = names
    return best, modes


def _scores(adjustment, modes, kept_in):
    """Log posterior of sets of wrong targets, each under its most probable parameters."""
    objective = Objective.of(adjustment)
    scores = {}
    for parameters in _shrunk(modes):
        for names, score in _eliminate(adjustment, parameters, objective, kept_in):
            scores[names] = max(score, scores.get(names, -np.inf))
    return scores


def _shrunk(modes):
    """Parameters of each mode, and with smaller and smaller scales."""
    scales = ("drift_scale", "jitter_scale", "bias_scale")
    for mode in modes:
        for factor in SETTINGS.scale_factors:
            yield replace(mode, **{name: factor * getattr(mode, name) for name in scales})


def _eliminate(adjustment, parameters, objective, kept_in):
    """Sets of wrong targets, growing by the most unlikely one, with their log posteriors."""
    names = frozenset()
    score = objective(parameters.family, objective.logarithms(parameters))
    yield names, score
    while may_go(adjustment, names | {""}):
        kept = adjustment.without(names)
        gains = _gains(kept.solve(parameters), kept.target_rows)
        gains = {name: gain for name, gain in gains.items() if name not in kept_in}
        worst = max(gains, key=gains.get, default=None)
        if worst is None or gains[worst] < -np.log(SETTINGS.strong_evidence):
            return
        names = names | {worst}
        score = score + gains[worst]
        yield names, score


def _gains(solved, rows_of):
    """Log posterior odds of a gross error common to all epochs of its rows, against none."""
    odds = np.log(SETTINGS.gross_share / (1.0 - SETTINGS.gross_share))
    return {name: gain + odds for name, gain in gross_evidence(solved, rows_of).items()}


def _rejected_groups(adjustment, rejected):
    """Statement on each two neighbors in time that were rejected and agree in direction."""
    means = {test.name: test.left_out.mean(axis=0) for test in rejected}
    for first, other in _neighbours(adjustment):
        if first in means and other in means and _agree(means[first], means[other]):
            misclosures = means[first].tolist(), means[other].tolist()
            values = {"names": (first, other), "misclosures": misclosures}
            yield Statement("neighbours rejected", "warning", values)


def _doubtful_pairs(adjustment, posterior):
    """Statement on the two neighbors in time that may be wrong together, or show drift.

    Both hypotheses are compared, each under its most probable parameters.
    """
    if not may_go(adjustment, {"", " "}):
        return
    modes = [chosen for chosen, _ in posterior.modes]
    none = -np.inf
    pairs = {}
    by_pair = {}
    for block in Objective.of(adjustment).blocks:
        objective = Objective.of(block)
        rows = block.target_rows
        for parameters in _shrunk(modes):
            score = objective(parameters.family, objective.logarithms(parameters))
            none = max(none, score)
            solved = block.solve(parameters)
            both = {
                pair: np.concatenate([rows[name] for name in pair]) for pair in _neighbours(block)
            }
            if not both:  # a target of very many passes is a block without a neighbor
                continue
            for pair, gain in _gains(solved, both).items():
                if score + gain > pairs.get(pair, -np.inf):
                    pairs[pair] = score + gain
                    by_pair[pair] = solved.leave_out(both[pair])[0].reshape(-1, 3)
    pair = max(pairs, key=pairs.get, default=None)
    if (
        pair is None
        or pairs[pair] < none - np.log(SETTINGS.strong_evidence)
        or not _agree(*by_pair[pair][[0, -1]])
    ):
        return
    misclosures = by_pair[pair][0].tolist(), by_pair[pair][-1].tolist()
    yield Statement("neighbours kept", "warning", {"names": pair, "misclosures": misclosures})


def _neighbours(adjustment):
    """Names of targets that follow each other in time."""
    names = list(
        dict.fromkeys(adjustment.names[np.argsort(adjustment.observed, kind="stable")].tolist())
    )
    return list(pairwise(names))


def _agree(vector, other):
    return vector @ other > SETTINGS.same_direction * np.linalg.norm(vector) * np.linalg.norm(other)
