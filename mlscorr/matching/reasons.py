"""Why an observation has no name, and a surveyed point no observation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.matching._pairs import CandidatePairs, same_appearance
from mlscorr.matching.decision import Decision
from mlscorr.matching.settings import SETTINGS
from mlscorr.survey import ControlPoints, TargetObservations


@dataclass(frozen=True)
class Refusal:
    """A control point that stays without observation.

    Parameters
    ----------
    name : str
    pass_number : int or None
        None where it is so in all passes.
    reason : str
        A sentence.
    gps_time : float, optional
        Of the observation that was refused. Units: s.
    """

    name: str
    pass_number: int | None
    reason: str
    gps_time: float | None = None


@dataclass(frozen=True)
class _Case:
    """What the sentences are made of: observations in order of time, and what was decided."""

    observations: TargetObservations
    control: ControlPoints
    pairs: CandidatePairs
    decision: Decision
    search_radius: float

    def free(self, row, columns):
        """Which control points (k,) have no match in the pass of an observation."""
        number = self.observations.pass_number[row]
        return np.array([(number, column) not in self.in_passes for column in columns], bool)

    @cached_property
    def in_passes(self):
        """(pass number, control point) of all matches."""
        matches = self.observations.pass_number[self.matched], self.decision.column[self.matched]
        return frozenset(zip(*matches, strict=True))

    @cached_property
    def matched(self):
        """Rows of the observations with a name."""
        return np.flatnonzero(self.decision.column >= 0)

    @cached_property
    def by_control(self):
        """The pairs in order of their control points."""
        return np.argsort(self.pairs.control, kind="stable")

    def pairs_of(self, column):
        """The pairs (k,) of a control point, and the rows of their observations."""
        span = np.searchsorted(self.pairs.control, [column, column + 1], sorter=self.by_control)
        pairs = self.by_control[slice(*span)]
        return pairs, np.searchsorted(self.pairs.first, pairs, side="right") - 1

    def when(self, row):
        return f"{self.observations.gps_time[row]:.1f} s"

    @property
    def limit(self):
        """How far was searched, in words."""
        return f"search radius {self.search_radius:.2f} m"

    def name(self, column):
        return self.control.name[column]

    def of_pairs(self, row):
        """Control points (k,) of an observation's pairs, most probable first, and probabilities."""
        pairs = self.pairs.of(row)
        marginals = self.decision.marginals
        probability = marginals.sound[pairs] + marginals.moved[pairs]
        order = np.argsort(-probability)
        return self.pairs.control[pairs][order], probability[order], self.pairs.same[pairs][order]

    def misclosure(self, row, column):
        return self.control.position[column] - self.observations.position[row]

    def off(self, row, column):
        """How far a control point lies from where the neighbours say it should (m)."""
        expected = self.decision.marginals.expected[row]
        return float(np.linalg.norm(self.misclosure(row, column) - expected))

    def corrected(self, row):
        """By which neighbours an observation was corrected, and how well, in words."""
        time = self.observations.gps_time
        column = self.decision.column
        matched = self.matched
        at = np.searchsorted(matched, row)
        near = [matched[i] for i in (at - 1, at) if 0 <= i < len(matched)]
        sigma = np.linalg.norm(self.decision.marginals.sigma[row])
        if not near:
            return f"no other target tells the misclosure there (sigma {sigma:.2f} m)"
        words = [f"{self.name(column[i])} ({time[i] - time[row]:+.1f} s)" for i in near]
        return f"its neighbours {' and '.join(words)} tell it to {sigma:.2f} m (one sigma)"


def explain(
    observations: TargetObservations,
    control: ControlPoints,
    pairs: CandidatePairs,
    decision: Decision,
    search_radius: float,
) -> tuple[tuple[Refusal, ...], list[str | None]]:
    """Say why control points have no observation, and observations no name.

    Parameters
    ----------
    observations : TargetObservations
        In order of time.
    control : ControlPoints
    pairs : CandidatePairs
    decision : Decision
    search_radius : float
        Units: m.

    Returns
    -------
    refusals : tuple of Refusal
    reasons : list of n str
        None for an observation with a name.
    """
    case = _Case(observations, control, pairs, decision, search_radius)
    tree = cKDTree(control.position) if len(control) else None
    reasons: list[str | None] = [None] * len(observations)
    claims = []
    unnamed = np.flatnonzero(decision.column < 0)
    kinds = {row: _of_another_kind(case, row) for row in unnamed}
    other_kind = {row: column for row, column in kinds.items() if column is not None}
    for row in unnamed:
        if row in other_kind:
            columns = [other_kind[row]]
            reasons[row] = _exchanged(case, row, other_kind)
        else:
            columns, reasons[row] = (
                _wrong_place(case, row)
                or _doubt(case, row)
                or _not_there(case, row)
                or ([], _without_point(case, row, tree))
            )
        claims += [(column, row) for column in columns if case.free(row, [column])[0]]
    refusals = {}
    for column, row in claims:
        key = control.name[column], int(observations.pass_number[row])
        refusals.setdefault(key, (reasons[row], float(observations.gps_time[row])))
    refused = [Refusal(*key, *refusal) for key, refusal in refusals.items()]
    return (*refused, *_without_observation(case, refused, reasons)), reasons


def _of_another_kind(case, row):
    """The control point of another kind or size that an observation probably is, or None."""
    column, probability, same = case.of_pairs(row)
    if len(column) == 0 or same[0] or probability[0] < 0.5:
        return None
    return int(column[0])


def _exchanged(case, row, other_kind):
    """The sentence for a position that fits and a kind or size that doesn't."""
    observed = case.observations
    surveyed = case.control
    column = other_kind[row]
    kind = observed.kind[row]
    size = observed.size[row]
    sentence = (
        f"The observation at {case.when(row)} is a {kind} of {size:.2f} m and "
        f"{case.name(column)} a {surveyed.kind[column]} of {surveyed.size[column]:.2f} m, but they "
        f"lie {case.off(row, column):.2f} m apart once corrected; {case.corrected(row)}"
    )
    others, columns = np.array(list(other_kind.items())).T
    crossed = same_appearance(observed[[row]], 0, surveyed[columns], ...) & (columns != column)
    crossed &= same_appearance(observed[others], ..., surveyed[[column]], 0)
    partners = {case.name(partner) for partner in columns[crossed]}
    if not partners:
        return sentence + ". Kind or size is wrong in the survey or in the extraction."
    return sentence + f". {case.name(column)} and {' or '.join(sorted(partners))} look exchanged."


def _wrong_place(case, row):
    """(control points, sentence) of an observation whose surveyed point lies elsewhere."""
    column, probability, _ = case.of_pairs(row)
    wrong = case.decision.wrong
    if len(column) == 0 or probability[0] < 0.5 or wrong[column[0]] <= 0.5:
        return None
    point = column[0]
    misclosure = np.linalg.norm(case.misclosure(row, point))
    passes = case.decision.passes[point]
    return [point], (
        f"{case.name(point)} lies {case.off(row, point):.2f} m from where the observation at "
        f"{case.when(row)} says once corrected; {case.corrected(row)}. Its surveyed point is "
        f"wrong, or this is another object (probability {wrong[point]:.3f} by {passes} "
        f"observation{'' if passes == 1 else 's'}; misclosure {misclosure:.2f} m, {case.limit}): "
        "compare its coordinates with the surveyor's record, or leave it out."
    )


def _doubt(case, row):
    """(control points, sentence) where an observation may be one of them, but isn't surely."""
    column, probability, _ = case.of_pairs(row)
    if probability.max(initial=0.0) < 2 * (1.0 - SETTINGS.smallest_probability):
        return None
    point = column[0]
    chance = probability[0]
    end = f"({case.limit}, probability {chance:.3f}"
    if len(column) > 1 and probability[1] >= SETTINGS.smallest_rival:
        apart = np.linalg.norm(case.control.position[point] - case.control.position[column[1]])
        return column[:2], (
            f"{case.name(point)} and {case.name(column[1])} lie {apart:.2f} m apart and both claim "
            f"the observation at {case.when(row)} {end} and {probability[1]:.3f}); "
            f"{case.corrected(row)}."
        )
    rival = _rival(case, row, point)
    if rival is not None:
        apart = np.linalg.norm(np.diff(case.observations.position[[row, rival]], axis=0))
        return [point], (
            f"Two observations {apart:.2f} m apart, at {case.when(row)} and {case.when(rival)}, "
            f"both claim {case.name(point)} {end} of the first); {case.corrected(row)}."
        )
    misclosure = np.linalg.norm(case.misclosure(row, point))
    wrong = case.decision.wrong[point]
    return [point], (
        f"{case.name(point)}, {misclosure:.2f} m from the observation at {case.when(row)}, isn't "
        f"surely its target {end}, and {wrong:.3f} that the surveyed point is wrong); "
        f"{case.corrected(row)}."
    )


def _rival(case, row, column):
    """The other observation of the pass that most probably is this control point, or None."""
    number = case.observations.pass_number
    marginals = case.decision.marginals
    others, rows = case.pairs_of(column)
    chance = marginals.sound[others] + marginals.moved[others]
    near = (rows != row) & (number[rows] == number[row]) & (chance >= SETTINGS.smallest_rival)
    if near.any():
        return int(rows[near][np.argmax(chance[near])])
    return None


def _not_there(case, row):
    """(control points, sentence) where a free one is near, but not where the neighbours say.

    An object as far from it as no target is moved says nothing of it.
    """
    column, _, same = case.of_pairs(row)
    free = column[same & case.free(row, column)]
    if len(free) == 0:
        return None
    point = min(free, key=lambda c: case.off(row, c))
    if case.off(row, point) <= 3 * SETTINGS.moved_sigma:
        claimed = [point]
    else:
        claimed = []
    return claimed, (
        f"{case.name(point)} lies {case.off(row, point):.2f} m from where the observation at "
        f"{case.when(row)} says once corrected; {case.corrected(row)}. This is another object "
        f"(misclosure {np.linalg.norm(case.misclosure(row, point)):.2f} m, "
        f"{case.limit})."
    )


def _without_point(case, row, tree):
    """The sentence for an observation that no free surveyed point is near to."""
    observed = case.observations
    what = f"{observed.kind[row]} of {observed.size[row]:.2f} m at {case.when(row)}"
    if tree is None:
        return f"There is no surveyed point for the {what}."
    distance, nearest = tree.query(observed.position[row])
    if case.free(row, [nearest])[0]:
        role = ""
    else:
        role = ", another observation of this pass,"
    return (
        f"No surveyed point is left for the {what} ({case.limit}); the nearest, "
        f"{case.name(nearest)}{role} a {case.control.kind[nearest]} of "
        f"{case.control.size[nearest]:.2f} m, lies {distance:.2f} m away."
    )


def _without_observation(case, refused, reasons):
    """Refusals for the control points that no pass observed."""
    column = case.decision.column
    known = {case.name(c) for c in column[column >= 0]} | {refusal.name for refusal in refused}
    missing = [i for i, name in enumerate(case.control.name) if name not in known]
    if len(case.observations) == 0:
        return [Refusal(case.name(i), None, "No target was found in the cloud.") for i in missing]
    tree = cKDTree(case.observations.position)
    return [Refusal(case.name(i), None, _why_missing(case, i, reasons, tree)) for i in missing]


def _why_missing(case, point, reasons, tree):
    """The sentences for a control point: of its like, what is near was refused, has another name,
    or isn't there.
    """
    like = f"{case.control.kind[point]} of {case.control.size[point]:.2f} m"
    pairs, rows = case.pairs_of(point)
    rows = rows[case.pairs.same[pairs]]
    away = np.linalg.norm(case.observations.position[rows] - case.control.position[point], axis=1)
    rows = rows[np.argsort(away, kind="stable")]
    refused = [row for row in rows if case.decision.column[row] < 0]
    if refused:
        row = refused[0]
        return f"The nearest {like} without a name {_whereabouts(case, point, row)}. {reasons[row]}"
    if len(rows):
        return (
            f"Each {like} found near it ({case.limit}) is another surveyed point; the nearest "
            f"{_whereabouts(case, point, rows[0])}."
        )
    row = tree.query(case.control.position[point])[1]
    return (
        f"No {like} was found near it ({case.limit}). The nearest target, a "
        f"{case.observations.kind[row]} of {case.observations.size[row]:.2f} m, "
        f"{_whereabouts(case, point, row)}."
    )


def _whereabouts(case, point, row):
    """When an observation was made, how far from a control point, and its name if it has one."""
    away = np.linalg.norm(case.observations.position[row] - case.control.position[point])
    column = case.decision.column[row]
    name = f" and is {case.name(column)}" if column >= 0 else ""
    return f"was found at {case.when(row)}, {away:.2f} m away{name}"
