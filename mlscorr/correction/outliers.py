"""Control points that the others contradict.

Wrong points hide each other: they pass as drift, or raise the scale until nothing is unlikely. So
the search doesn't start from the parameters that all points together choose. It eliminates the
most unlikely points under parameters of many scales, lets the Bayes factor between "gross error"
and "drift" choose, estimates anew, and at last tests every point against those that are left.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.stats import chi2, norm

from mlscorr.correction.likelihood import (
    Objective,
    Posterior,
    choose_parameters,
    most_probable,
)

SIGNIFICANCE = 0.001  # Baarda's (1968), but over all targets together: real drift has outliers
LEAST_TARGETS = 5  # four can't tell a wrong one from a POS that is worse than stated
BREAKDOWN = 0.3  # share of targets that may be wrong; beyond it "most" means little
GROSS_SHARE = 0.02  # of control points, before the data are seen
GROSS_SIZES = (0.1, 0.5, 2.5)  # m, one sigma of gross errors: misread targets to a wrong setup
SHRINK = (1.0, 0.5, 0.25, 0.125)  # of the scales, so that a search under some isn't masked
ROUNDS = 3  # of eliminating and estimating; the second seldom differs from the first
CLOSE_CALL = np.log(20.0)  # "strong" evidence begins there (Kass and Raftery 1995)
SAME_DIRECTION = 0.8  # cosine above which two misclosures agree


@dataclass(frozen=True)
class Outlier:
    """A target that the others contradict: chi-squared statistic and its critical value."""

    name: str
    statistic: float
    critical: float


@dataclass(frozen=True)
class TargetTest:
    """What the other targets say of one.

    ``left_out`` and ``sigma`` (k, 3) are its misclosures once the others have corrected them, for
    each of k passes, and their sigmas (m); ``redundancy`` (k, 3) is the share of an error that
    its residual shows. NaN where the others don't determine the trend.
    """

    name: str
    statistic: float
    critical: float
    left_out: np.ndarray
    sigma: np.ndarray
    redundancy: np.ndarray

    @property
    def w(self):
        """Data snooping's w (k, 3): standard normal without a gross error."""
        return self.left_out / self.sigma

    @property
    def detectable(self):
        """Least error (k, 3) that w finds in 4 of 5 cases. Units: m."""
        return (norm.isf(SIGNIFICANCE / 2) + norm.isf(0.2)) * self.sigma  # Baarda's usual 4.13

    @property
    def excess(self):
        """Statistic over critical value; zero where there is none."""
        return self.statistic / self.critical if np.isfinite(self.statistic) else 0.0


@dataclass(frozen=True)
class Screening:
    """Posterior of the parameters by the targets that are left, and tests of these; outliers."""

    posterior: Posterior
    outliers: tuple[Outlier, ...]
    tests: tuple[TargetTest, ...]
    warnings: tuple[str, ...]


def screen(model, order):
    """Find gross errors among the targets of a Model, and what the others say: a Screening."""
    (out, start), seen = _search(model, order), []
    while True:
        kept = model.without(out)
        posterior = choose_parameters(kept, order, start)
        start = [chosen for chosen, _ in posterior.modes]
        tests = _tests(kept, order, posterior)
        rejected = [_test_of(model.without(out - {name}), name, order, posterior) for name in out]
        back = {test.name for test in rejected if test.excess <= 1.0}
        worst = max(tests, key=lambda test: test.excess)
        seen.append(out)
        changed = out - back
        if not back and worst.excess > 1.0 and _may_go(model, out | {worst.name}):
            changed = out | {worst.name}
        if changed in seen:
            break
        out = changed
    rejected.sort(key=lambda test: -test.excess)
    return Screening(
        posterior,
        tuple(Outlier(test.name, test.statistic, test.critical) for test in rejected),
        tuple(tests),
        (*_rejected_groups(model, rejected), *_doubtful_pairs(kept, order, posterior)),
    )


def _may_go(model, names):
    """Whether so many targets may be wrong, and enough are left."""
    total = len(model.target_rows)
    return len(names) <= BREAKDOWN * total and total - len(names) >= LEAST_TARGETS - 1


def _search(model, order):
    """Names of the most probable set of wrong targets, and each family's Parameters; large
    surveys are searched in blocks."""
    best, modes = frozenset(), ()
    for _ in range(ROUNDS):
        modes = [chosen for chosen, _ in most_probable(model.without(best), order, modes)]
        found = frozenset()
        for block, low in Objective.of(model, order).blocks:
            scores = _scores(block, low, modes)
            found |= max(scores, key=scores.get)
        if found == best:
            break
        best = found
    return best, modes


def _scores(model, order, modes):
    """Log posterior of sets of wrong targets, each under the parameters that suit it best."""
    objective = Objective.of(model, order)
    scores = {}
    for parameters in _shrunk(modes):
        for names, score in _eliminate(model, order, parameters, objective):
            scores[names] = max(score, scores.get(names, -np.inf))
    return scores


def _shrunk(modes):
    """Parameters of each mode, and with smaller and smaller scales."""
    scales = ("drift_scale", "jitter_scale", "bias_scale")
    for mode in modes:
        for factor in SHRINK:
            yield replace(mode, **{name: factor * getattr(mode, name) for name in scales})


def _eliminate(model, order, parameters, objective):
    """Sets of wrong targets, growing by the most unlikely one, with their log posteriors."""
    names, score = frozenset(), objective(parameters.family, objective.logarithms(parameters))
    yield names, score
    while _may_go(model, names | {""}):
        kept = model.without(names)
        solved = kept.solve(parameters, order)
        gains = {
            name: _gain(solved, rows)
            for name, rows in kept.target_rows.items()
            if solved.determined_without(rows)
        }
        worst = max(gains, key=gains.get, default=None)
        if worst is None or gains[worst] < -CLOSE_CALL:
            return
        names, score = names | {worst}, score + gains[worst]
        yield names, score


def _gain(solved, rows):
    """Log posterior odds of one gross error, the same in all these rows' epochs, against none."""
    residual, covariance = solved.leave_out(rows)
    same = np.kron(np.ones((len(rows) // 3,) * 2), np.eye(3))
    sizes = np.array([0.0, *GROSS_SIZES])
    total = covariance + sizes[:, None, None] ** 2 * same
    squares = np.linalg.solve(total, residual[:, None])[..., 0] @ residual
    density = -0.5 * (squares + np.linalg.slogdet(total)[1])
    wrong = np.logaddexp.reduce(density[1:]) - np.log(len(GROSS_SIZES))
    return wrong - density[0] + np.log(GROSS_SHARE / (1.0 - GROSS_SHARE))


def _tests(model, order, posterior):
    """TargetTest of each target by all others."""
    tests = []
    for block, low in Objective.of(model, order).blocks:
        solved = [(block.solve(chosen, low), weight) for chosen, weight in posterior.points]
        targets = len(model.target_rows)
        tests += [_test(block, *target, solved, targets) for target in block.target_rows.items()]
    return tests


def _test_of(model, name, order, posterior):
    """TargetTest of one target by all others."""
    for block, low in Objective.of(model, order).blocks:
        if name in block.names:
            solved = [(block.solve(chosen, low), weight) for chosen, weight in posterior.points]
            rows = block.target_rows[name]
            return _test(block, name, rows, solved, len(model.target_rows))


def _test(model, name, rows, solved, targets):
    """TargetTest by the left-out misclosure, averaged over the parameters.

    What the parameters leave open is a part of its covariance, so that neither a mode that is too
    sure of itself decides nor one that the target itself has raised.
    """
    critical = float(chi2.isf(SIGNIFICANCE / targets, len(rows)))
    if not solved[0][0].determined_without(rows):
        nothing = np.full((len(rows) // 3, 3), np.nan)
        return TargetTest(name, float("nan"), critical, nothing, nothing, nothing)
    mean, square = 0.0, 0.0
    for one, weight in solved:
        residual, covariance = one.leave_out(rows)
        mean = mean + weight * residual
        square = square + weight * (covariance + np.outer(residual, residual))
    covariance = square - np.outer(mean, mean)
    redundancy = np.diag(model.noise.block(rows) @ np.linalg.inv(covariance))
    statistic = float(mean @ np.linalg.solve(covariance, mean))
    parts = (mean, np.sqrt(np.diag(covariance)), redundancy)
    return TargetTest(name, statistic, critical, *(part.reshape(-1, 3) for part in parts))


def _rejected_groups(model, rejected):
    """A sentence on each two neighbours in time that were rejected and agree in direction."""
    ways = {test.name: test.left_out.mean(axis=0) for test in rejected}
    for one, other in _neighbours(model):
        if one in ways and other in ways and _agree(ways[one], ways[other]):
            yield (
                f"{one} and {other} follow each other, were both rejected, and deviate in one "
                f"direction ({_metres(ways[one])} and {_metres(ways[other])} m). They may be wrong "
                "together, as by one setup of the instrument, or the POS drifted there for a short "
                "time: survey one of them again."
            )


def _doubtful_pairs(model, order, posterior):
    """A sentence on the two neighbours in time that may be wrong together, or tell of drift.

    Both readings are weighed, each under the parameters that suit it best.
    """
    if not _may_go(model, {"", " "}):
        return
    modes = [chosen for chosen, _ in posterior.modes]
    none, pairs, ways = -np.inf, {}, {}
    for block, low in Objective.of(model, order).blocks:
        objective, rows = Objective.of(block, low), block.target_rows
        for parameters in _shrunk(modes):
            score = objective(parameters.family, objective.logarithms(parameters))
            none = max(none, score)
            solved = block.solve(parameters, low)
            for pair in _neighbours(block):
                both = np.concatenate([rows[name] for name in pair])
                if not solved.determined_without(both):
                    continue
                gain = score + _gain(solved, both)
                if gain > pairs.get(pair, -np.inf):
                    pairs[pair], ways[pair] = gain, solved.leave_out(both)[0].reshape(-1, 3)
    pair = max(pairs, key=pairs.get, default=None)
    if pair is None or pairs[pair] < none - CLOSE_CALL or not _agree(*ways[pair][[0, -1]]):
        return
    yield (
        f"{pair[0]} and {pair[1]} follow each other and deviate from the others in one direction "
        f"({_metres(ways[pair][0])} and {_metres(ways[pair][-1])} m). This was taken as drift of "
        "the POS; that both are wrong together, as by one setup of the instrument, is not much "
        "less likely: survey one of them again."
    )


def _neighbours(model):
    """Names of targets that follow each other in time."""
    names = list(dict.fromkeys(model.names[np.argsort(model.gps_time, kind="stable")].tolist()))
    return list(pairwise(names))


def _agree(one, other):
    return one @ other > SAME_DIRECTION * np.linalg.norm(one) * np.linalg.norm(other)


def _metres(vector):
    return "/".join(f"{value:.2f}" for value in vector)
