"""Control points that the others contradict.

Wrong points hide each other: they pass as drift, or raise the scale until nothing is unlikely. So
the search doesn't start from the parameters that all points together choose. It eliminates the
most unlikely points under parameters of many scales, lets the Bayes factor between "gross error"
and "drift" choose, estimates anew, and at last tests every point against those that are left.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mlscorr.collocation import INTEGRATED
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.posterior import Objective, Posterior, choose_parameters, most_probable
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import TargetTest, all_tests, gross_evidence, single_test


@dataclass(frozen=True)
class Screening:
    """Targets that are left and those that are not.

    Parameters
    ----------
    posterior : Posterior
        Of the parameters, by the targets that are left.
    outliers : tuple of TargetTest
        Of targets that the others contradict.
    tests : tuple of TargetTest
        Of the targets that are left.
    warnings : tuple of str
    """

    posterior: Posterior
    outliers: tuple[TargetTest, ...]
    tests: tuple[TargetTest, ...]
    warnings: tuple[str, ...]

    @classmethod
    def believed(cls, equations: Equations) -> Screening:
        """Nothing screened: the parameters are those that are believed before any target."""
        objective = Objective.of(equations)
        mode = ((objective.parameters(INTEGRATED, objective.initial), 1.0),)
        return cls(Posterior(mode, mode), (), (), ())


def screen(equations: Equations) -> Screening:
    """Find gross errors among targets, and what the others say of them.

    Parameters
    ----------
    equations : Equations
    """
    (out, start), tried = _search(equations), []
    while True:
        kept = equations.without(out)
        posterior = choose_parameters(kept, start)
        start = [chosen for chosen, _ in posterior.modes]
        tests = all_tests(kept, posterior)
        rejected = [single_test(equations.without(out - {name}), name, posterior) for name in out]
        back = {test.name for test in rejected if test.excess <= 1.0}
        worst = max(tests, key=lambda test: test.excess)
        tried.append(out)
        changed = out - back
        if not back and worst.excess > 1.0 and may_go(equations, out | {worst.name}):
            changed = out | {worst.name}
        if changed in tried:
            break
        out = changed
    return Screening(
        posterior,
        tuple(sorted(rejected, key=lambda test: -test.excess)),
        tuple(tests),
        (*_rejected_groups(equations, rejected), *_doubtful_pairs(kept, posterior)),
    )


def may_go(equations: Equations, names: Collection[str]) -> bool:
    """Whether so many targets may be wrong, and enough are left.

    Parameters
    ----------
    equations : Equations
    names : collection of str
    """
    total = len(equations.target_rows)
    return (
        len(names) <= SETTINGS.breakdown * total
        and total - len(names) >= SETTINGS.screened_targets - 1
    )


def _search(equations):
    """Names of the most probable set of wrong targets, and each family's SignalParameters.

    Large surveys are searched in blocks.
    """
    best = frozenset()
    modes = ()
    for _ in range(SETTINGS.rounds):
        modes = [chosen for chosen, _ in most_probable(equations.without(best), modes)]
        names = frozenset()
        for block in Objective.of(equations).blocks:
            scores = _scores(block, modes)
            names |= max(scores, key=scores.get)
        if names == best:
            break
        best = names
    return best, modes


def _scores(equations, modes):
    """Log posterior of sets of wrong targets, each under the parameters that suit it best."""
    objective = Objective.of(equations)
    scores = {}
    for parameters in _shrunk(modes):
        for names, score in _eliminate(equations, parameters, objective):
            scores[names] = max(score, scores.get(names, -np.inf))
    return scores


def _shrunk(modes):
    """Parameters of each mode, and with smaller and smaller scales."""
    scales = ("drift_scale", "jitter_scale", "bias_scale")
    for mode in modes:
        for factor in SETTINGS.scale_factors:
            yield replace(mode, **{name: factor * getattr(mode, name) for name in scales})


def _eliminate(equations, parameters, objective):
    """Sets of wrong targets, growing by the most unlikely one, with their log posteriors."""
    names = frozenset()
    score = objective(parameters.family, objective.logarithms(parameters))
    yield names, score
    while may_go(equations, names | {""}):
        kept = equations.without(names)
        gains = _gains(kept.solve(parameters), kept.target_rows)
        worst = max(gains, key=gains.get)
        if gains[worst] < -np.log(SETTINGS.strong_evidence):
            return
        names = names | {worst}
        score = score + gains[worst]
        yield names, score


def _gains(solved, rows_of):
    """Log posterior odds of a gross error, the same in all its rows' epochs, against none."""
    odds = np.log(SETTINGS.gross_share / (1.0 - SETTINGS.gross_share))
    return {name: gain + odds for name, gain in gross_evidence(solved, rows_of).items()}


def _rejected_groups(equations, rejected):
    """A sentence on each two neighbours in time that were rejected and agree in direction."""
    ways = {test.name: test.left_out.mean(axis=0) for test in rejected}
    for first, other in _neighbours(equations):
        if first in ways and other in ways and _agree(ways[first], ways[other]):
            yield (
                f"{first} and {other} follow each other, were both rejected, and deviate in one "
                f"direction ({_metres(ways[first])} and {_metres(ways[other])} m). They may be "
                "wrong together, as by one setup of the instrument, or the POS drifted there for a "
                "short time: survey one of them again."
            )


def _doubtful_pairs(equations, posterior):
    """A sentence on the two neighbours in time that may be wrong together, or tell of drift.

    Both readings are weighed, each under the parameters that suit it best.
    """
    if not may_go(equations, {"", " "}):
        return
    modes = [chosen for chosen, _ in posterior.modes]
    none = -np.inf
    pairs = {}
    ways = {}
    for block in Objective.of(equations).blocks:
        objective = Objective.of(block)
        rows = block.target_rows
        for parameters in _shrunk(modes):
            score = objective(parameters.family, objective.logarithms(parameters))
            none = max(none, score)
            solved = block.solve(parameters)
            both = {
                pair: np.concatenate([rows[name] for name in pair]) for pair in _neighbours(block)
            }
            # a target of very many passes is a block without a neighbour
            for pair, gain in (_gains(solved, both) if both else {}).items():
                if score + gain > pairs.get(pair, -np.inf):
                    pairs[pair] = score + gain
                    ways[pair] = solved.leave_out(both[pair])[0].reshape(-1, 3)
    pair = max(pairs, key=pairs.get, default=None)
    if (
        pair is None
        or pairs[pair] < none - np.log(SETTINGS.strong_evidence)
        or not _agree(*ways[pair][[0, -1]])
    ):
        return
    yield (
        f"{pair[0]} and {pair[1]} follow each other and deviate from the others in one direction "
        f"({_metres(ways[pair][0])} and {_metres(ways[pair][-1])} m). This was taken as drift of "
        "the POS; that both are wrong together, as by one setup of the instrument, is not much "
        "less likely: survey one of them again."
    )


def _neighbours(equations):
    """Names of targets that follow each other in time."""
    names = list(
        dict.fromkeys(equations.names[np.argsort(equations.observed, kind="stable")].tolist())
    )
    return list(pairwise(names))


def _agree(vector, other):
    return vector @ other > SETTINGS.same_direction * np.linalg.norm(vector) * np.linalg.norm(other)


def _metres(vector):
    return "/".join(f"{value:.2f}" for value in vector)
