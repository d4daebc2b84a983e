"""Why an observation has no name, and a surveyed point no observation."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.matching.pairs import LARGEST_GATE, same_appearance

NEAR = 3.0  # m; what is farther from the place that its neighbours tell is another object
POSSIBLE = 0.001  # probability from which a rival is named
DOUBTFUL = 0.02  # probability of a pair from which an observation isn't surely another object


@dataclass(frozen=True)
class Refusal:
    """A control point that stays without observation in a pass, and why; pass None = in all."""

    name: str
    pass_number: int | None
    reason: str


@dataclass(frozen=True)
class _Case:
    """What the sentences are made of: observations in order of time, and what was decided."""

    observations: object
    control: object
    pairs: object
    decision: object
    gate: np.ndarray

    def free(self, row, columns):
        """Which control points (k,) have no match in the pass of an observation."""
        same = self.observations.pass_number == self.observations.pass_number[row]
        return ~np.isin(columns, self.decision.column[same])

    def when(self, row):
        return f"{self.observations.gps_time[row]:.1f} s"

    def limit(self, row):
        """The gate of an observation, in words."""
        at_most = ", the largest however much the POS states"
        return f"gate {self.gate[row]:.2f} m{at_most if self.gate[row] >= LARGEST_GATE else ''}"

    def name(self, column):
        return self.control.name[column]

    def of_pairs(self, row):
        """Control points (k,) of an observation's pairs, most probable first, and probabilities."""
        pairs, found = self.pairs.of(row), self.decision.marginals
        probability = found.sound[pairs] + found.moved[pairs]
        order = np.argsort(-probability)
        return self.pairs.control[pairs][order], probability[order], self.pairs.alike[pairs][order]

    def misclosure(self, row, column):
        return self.control.position[column] - self.observations.position[row]

    def off(self, row, column):
        """How far a control point lies from where the neighbours say it should (m)."""
        expected = self.decision.marginals.expected[row]
        return float(np.linalg.norm(self.misclosure(row, column) - expected))

    def corrected(self, row):
        """By which neighbours an observation was corrected, and how well, in words."""
        time, column = self.observations.gps_time, self.decision.column
        matched = np.flatnonzero(column >= 0)
        at = np.searchsorted(matched, row)
        near = [matched[i] for i in (at - 1, at) if 0 <= i < len(matched)]
        sigma = np.linalg.norm(self.decision.marginals.sigma[row])
        if not near:
            return f"no other target tells the misclosure there (sigma {sigma:.2f} m)"
        words = [f"{self.name(column[i])} ({time[i] - time[row]:+.1f} s)" for i in near]
        return f"its neighbours {' and '.join(words)} tell it to {sigma:.2f} m (one sigma)"


def explain(observations, control, pairs, decision, gate):
    """Refusals of control points, and the reason (n,) of each observation without a name.

    observations are in order of time.
    """
    case = _Case(observations, control, pairs, decision, gate)
    tree = cKDTree(control.position) if len(control) else None
    reasons, claims = [None] * len(observations), []
    unnamed = np.flatnonzero(decision.column < 0)
    other_kind = {row: one for row in unnamed if (one := _of_another_kind(case, row)) is not None}
    for row in unnamed:
        if row in other_kind:
            claimed = [other_kind[row]]
            reasons[row] = _exchanged(case, row, other_kind)
        else:
            claimed, reasons[row] = (
                _wrong_place(case, row)
                or _doubt(case, row)
                or _not_there(case, row)
                or ([], _alone(case, row, tree))
            )
        claims += [(one, row) for one in claimed if case.free(row, [one])[0]]
    refusals = {}
    for one, row in claims:
        key = control.name[one], int(observations.pass_number[row])
        refusals.setdefault(key, reasons[row])
    refused = [Refusal(*key, reason) for key, reason in refusals.items()]
    return (*refused, *_unseen(case, refused)), reasons


def _of_another_kind(case, row):
    """The control point of another kind or size that an observation probably is, or None."""
    column, probability, alike = case.of_pairs(row)
    if len(column) == 0 or alike[0] or probability[0] < 0.5:
        return None
    return int(column[0])


def _exchanged(case, row, other_kind):
    """The sentence for a position that fits and a kind or size that doesn't."""
    seen, surveyed, column = case.observations, case.control, other_kind[row]
    sentence = (
        f"The observation at {case.when(row)} is a {seen.kind[row]} of {seen.size[row]:.2f} m and "
        f"{case.name(column)} a {surveyed.kind[column]} of {surveyed.size[column]:.2f} m, but they "
        f"lie {case.off(row, column):.2f} m apart once corrected; {case.corrected(row)}"
    )
    partners = {
        case.name(one)
        for other, one in other_kind.items()
        if one != column
        and same_appearance(seen, row, surveyed, np.array([one]))[0]
        and same_appearance(seen, other, surveyed, np.array([column]))[0]
    }
    if not partners:
        return sentence + ". Kind or size is wrong in the survey or in the extraction."
    return sentence + f". {case.name(column)} and {' or '.join(sorted(partners))} look exchanged."


def _wrong_place(case, row):
    """(control points, sentence) of an observation whose surveyed point lies elsewhere."""
    column, probability, _ = case.of_pairs(row)
    wrong = case.decision.wrong
    if len(column) == 0 or probability[0] < 0.5 or wrong[column[0]] <= 0.5:
        return None
    one = column[0]
    misclosure, passes = np.linalg.norm(case.misclosure(row, one)), case.decision.passes[one]
    return [one], (
        f"{case.name(one)} lies {case.off(row, one):.2f} m from where the observation at "
        f"{case.when(row)} says once corrected; {case.corrected(row)}. Its surveyed point is "
        f"wrong, or this is another object (probability {wrong[one]:.3f} by {passes} "
        f"observations; misclosure {misclosure:.2f} m, {case.limit(row)})."
    )


def _doubt(case, row):
    """(control points, sentence) where an observation may be one of them, but isn't surely."""
    column, probability, _ = case.of_pairs(row)
    if probability.max(initial=0.0) < DOUBTFUL:
        return None
    one, chance = column[0], probability[0]
    end = f"({case.limit(row)}, probability {chance:.3f}"
    if len(column) > 1 and probability[1] >= POSSIBLE:
        apart = np.linalg.norm(case.control.position[one] - case.control.position[column[1]])
        return column[:2], (
            f"{case.name(one)} and {case.name(column[1])} lie {apart:.2f} m apart and both claim "
            f"the observation at {case.when(row)} {end} and {probability[1]:.3f}); "
            f"{case.corrected(row)}."
        )
    rival = _rival(case, row, one)
    if rival is not None:
        apart = np.linalg.norm(np.diff(case.observations.position[[row, rival]], axis=0))
        return [one], (
            f"Two observations {apart:.2f} m apart, at {case.when(row)} and {case.when(rival)}, "
            f"both claim {case.name(one)} {end} of the first); {case.corrected(row)}."
        )
    return [one], (
        f"{case.name(one)}, {np.linalg.norm(case.misclosure(row, one)):.2f} m from the observation "
        f"at {case.when(row)}, isn't surely its target {end}, and "
        f"{case.decision.wrong[one]:.3f} that the surveyed point is wrong); {case.corrected(row)}."
    )


def _rival(case, row, column):
    """The other observation of the pass that most probably is this control point, or None."""
    number, found = case.observations.pass_number, case.decision.marginals
    others = np.flatnonzero(case.pairs.control == column)
    rows = np.searchsorted(case.pairs.first, others, side="right") - 1
    chance = found.sound[others] + found.moved[others]
    near = (rows != row) & (number[rows] == number[row]) & (chance >= POSSIBLE)
    return int(rows[near][np.argmax(chance[near])]) if near.any() else None


def _not_there(case, row):
    """(control points, sentence) where a free one is near, but not where the neighbours say."""
    column, _, alike = case.of_pairs(row)
    near = [c for c in column[alike] if case.free(row, [c])[0] and case.off(row, c) <= NEAR]
    if not near:
        return None
    one = min(near, key=lambda c: case.off(row, c))
    return [one], (
        f"{case.name(one)} lies {case.off(row, one):.2f} m from where the observation at "
        f"{case.when(row)} says once corrected; {case.corrected(row)}. This is another object "
        f"(misclosure {np.linalg.norm(case.misclosure(row, one)):.2f} m, "
        f"{case.limit(row)})."
    )


def _alone(case, row, tree):
    """The sentence for an observation that no free surveyed point is near to."""
    seen = case.observations
    what = f"{seen.kind[row]} of {seen.size[row]:.2f} m at {case.when(row)}"
    if tree is None:
        return f"There is no surveyed point for the {what}."
    distance, nearest = tree.query(seen.position[row])
    taken = "" if case.free(row, [nearest])[0] else ", another observation of this pass,"
    return (
        f"No surveyed point is left for the {what} ({case.limit(row)}); the nearest, "
        f"{case.name(nearest)}{taken} a {case.control.kind[nearest]} of "
        f"{case.control.size[nearest]:.2f} m, lies {distance:.2f} m away."
    )


def _unseen(case, refused):
    """Refusals for the control points that no pass observed."""
    column = case.decision.column
    seen = {case.name(one) for one in column[column >= 0]} | {refusal.name for refusal in refused}
    missing = [i for i, name in enumerate(case.control.name) if name not in seen]
    if len(case.observations) == 0:
        return [Refusal(case.name(i), None, "No target was found in the cloud.") for i in missing]
    distance, near = cKDTree(case.observations.position).query(case.control.position[missing])
    refusals = []
    for one, away, row in zip(missing, distance, near, strict=True):
        found = f"the nearest one found, at {case.when(row)}, lies {away:.2f} m away"
        if column[row] >= 0:
            found += f" and is {case.name(column[row])}"
        reason = f"No target is left for it; {found} ({case.limit(row)})."
        refusals.append(Refusal(case.name(one), None, reason))
    return refusals
