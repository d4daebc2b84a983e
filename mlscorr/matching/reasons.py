"""Reasons why observations have no name, and surveyed points no observation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.matching._pairs import CandidatePairs, same_appearance
from mlscorr.matching._wording import sentence_of
from mlscorr.matching.decision import Decision
from mlscorr.matching.settings import SETTINGS
from mlscorr.survey import ControlPoints, Statement, TargetObservations


@dataclass(frozen=True)
class Refusal:
    """Control point without an observation.

    Parameters
    ----------
    name : str
    pass_number : int or None
        None for all passes.
    why : Statement
        Reason; ``reason`` has its sentence.
    gps_time : float, optional
        Time of the refused observation. Units: s.
    """

    name: str
    pass_number: int | None
    why: Statement
    gps_time: float | None = None

    @property
    def reason(self) -> str:
        """Reason as a sentence."""
        return sentence_of(self.why)


@dataclass(frozen=True)
class _Case:
    """Input of the reasons: observations in order of time, and the decision."""

    observations: TargetObservations
    control: ControlPoints
    pairs: CandidatePairs
    decision: Decision
    search_radius: float

    def free(self, row, columns):
        """Flag (k,) of control points without a match in the pass of an observation."""
        number = self.observations.pass_number[row]
        return np.array([(number, column) not in self.in_passes for column in columns], bool)

    @cached_property
    def in_passes(self):
        """Pairs (pass number, control point) of all matches."""
        matches = self.observations.pass_number[self.matched], self.decision.column[self.matched]
        return frozenset(zip(*matches, strict=True))

    @cached_property
    def matched(self):
        """Rows of the observations with a name."""
        return np.flatnonzero(self.decision.column >= 0)

    @cached_property
    def by_control(self):
        """Pairs in order of their control points."""
        return np.argsort(self.pairs.control, kind="stable")

    def pairs_of(self, column):
        """Pairs (k,) of a control point, and the rows of their observations."""
        span = np.searchsorted(self.pairs.control, [column, column + 1], sorter=self.by_control)
        pairs = self.by_control[slice(*span)]
        return pairs, np.searchsorted(self.pairs.first, pairs, side="right") - 1

    def time(self, row):
        return float(self.observations.gps_time[row])

    def name(self, column):
        return self.control.name[column]

    def of_pairs(self, row):
        """Control points (k,) of an observation's pairs and probabilities, in decreasing order."""
        pairs = self.pairs.of(row)
        marginals = self.decision.marginals
        probability = marginals.sound[pairs] + marginals.moved[pairs]
        order = np.argsort(-probability)
        return self.pairs.control[pairs][order], probability[order], self.pairs.same[pairs][order]

    def misclosure(self, row, column):
        return self.control.position[column] - self.observations.position[row]

    def off(self, row, column):
        """Distance of a control point from its position predicted by the neighbors (m)."""
        expected = self.decision.marginals.expected[row]
        return float(np.linalg.norm(self.misclosure(row, column) - expected))

    def distance(self, row, column):
        """Length of the misclosure (m)."""
        return float(np.linalg.norm(self.misclosure(row, column)))

    def corrected(self, row):
        """Neighbors by which an observation was corrected: names, time differences, and sigma."""
        time = self.observations.gps_time
        column = self.decision.column
        matched = self.matched
        at = np.searchsorted(matched, row)
        near = [matched[i] for i in (at - 1, at) if 0 <= i < len(matched)]
        return {
            "neighbours": tuple((self.name(column[i]), float(time[i] - time[row])) for i in near),
            "sigma": float(np.linalg.norm(self.decision.marginals.sigma[row])),
        }

    def appearance(self, row):
        """Kind and size of an observation."""
        return {
            "kind": self.observations.kind[row],
            "size": float(self.observations.size[row]),
        }

    def whereabouts(self, point, row):
        """Time of an observation, distance from a control point, and its name if any."""
        away = np.linalg.norm(self.observations.position[row] - self.control.position[point])
        column = self.decision.column[row]
        name = None
        if column >= 0:
            name = self.name(column)
        return {"time": self.time(row), "away": float(away), "found_name": name}


def explain(
    observations: TargetObservations,
    control: ControlPoints,
    pairs: CandidatePairs,
    decision: Decision,
    search_radius: float,
) -> tuple[tuple[Refusal, ...], list[Statement | None]]:
    """Explain why control points have no observation, and observations no name.

    Parameters
    ----------
    observations : TargetObservations
        Sorted by time.
    control : ControlPoints
    pairs : CandidatePairs
    decision : Decision
    search_radius : float
        Units: m.

    Returns
    -------
    refusals : tuple of Refusal
    reasons : list of n Statement
        None for an observation with a name.
    """
    case = _Case(observations, control, pairs, decision, search_radius)
    tree = cKDTree(control.position) if len(control) else None
    reasons: list[Statement | None] = [None] * len(observations)
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
    """Return the control point of another kind or size that an observation probably is, or None."""
    column, probability, same = case.of_pairs(row)
    if len(column) == 0 or same[0] or probability[0] < 0.5:
        return None
    return int(column[0])


def _exchanged(case, row, other_kind):
    """Return the reason if the position fits but kind or size does not."""
    observed = case.observations
    surveyed = case.control
    column = other_kind[row]
    others, columns = np.array(list(other_kind.items())).T
    crossed = same_appearance(observed[[row]], 0, surveyed[columns], ...) & (columns != column)
    crossed &= same_appearance(observed[others], ..., surveyed[[column]], 0)
    values = {
        "name": case.name(column),
        "time": case.time(row),
        "surveyed_kind": surveyed.kind[column],
        "surveyed_size": float(surveyed.size[column]),
        "off": case.off(row, column),
        "exchanged": tuple(sorted({case.name(partner) for partner in columns[crossed]})),
    }
    return Statement(
        "other appearance", "warning", values | case.appearance(row) | case.corrected(row)
    )


def _wrong_place(case, row):
    """Return (control points, reason) of an observation whose surveyed point is displaced."""
    column, probability, _ = case.of_pairs(row)
    wrong = case.decision.wrong
    if len(column) == 0 or probability[0] < 0.5 or wrong[column[0]] <= 0.5:
        return None
    point = column[0]
    values = {
        "name": case.name(point),
        "time": case.time(row),
        "off": case.off(row, point),
        "probability": float(wrong[point]),
        "observations": int(case.decision.passes[point]),
        "misclosure": case.distance(row, point),
        "search_radius": case.search_radius,
    }
    return [point], Statement("wrong point", "warning", values | case.corrected(row))


def _doubt(case, row):
    """Return (control points, reason) of an observation that may be one of them, but not surely."""
    column, probability, _ = case.of_pairs(row)
    if probability.max(initial=0.0) < 2 * (1.0 - SETTINGS.smallest_probability):
        return None
    point = column[0]
    values = {"search_radius": case.search_radius} | case.corrected(row)
    if len(column) > 1 and probability[1] >= SETTINGS.smallest_rival:
        apart = np.linalg.norm(case.control.position[point] - case.control.position[column[1]])
        values |= {
            "names": (case.name(point), case.name(column[1])),
            "apart": float(apart),
            "time": case.time(row),
            "probabilities": (float(probability[0]), float(probability[1])),
        }
        return column[:2], Statement("two points", "warning", values)
    values |= {"name": case.name(point), "probability": float(probability[0])}
    rival = _rival(case, row, point)
    if rival is not None:
        apart = np.linalg.norm(np.diff(case.observations.position[[row, rival]], axis=0))
        values |= {"apart": float(apart), "times": (case.time(row), case.time(rival))}
        return [point], Statement("two observations", "warning", values)
    values |= {
        "misclosure": case.distance(row, point),
        "time": case.time(row),
        "wrong": float(case.decision.wrong[point]),
    }
    return [point], Statement("doubtful match", "warning", values)


def _rival(case, row, column):
    """Return the other observation of the pass that most probably is this control point, or
    None.
    """
    number = case.observations.pass_number
    marginals = case.decision.marginals
    others, rows = case.pairs_of(column)
    chance = marginals.sound[others] + marginals.moved[others]
    near = (rows != row) & (number[rows] == number[row]) & (chance >= SETTINGS.smallest_rival)
    if near.any():
        return int(rows[near][np.argmax(chance[near])])
    return None


def _not_there(case, row):
    """Return (control points, reason) if an unmatched one is near, but not where predicted.

    An object farther away than any plausible displacement gives no information on it.
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
    values = {
        "name": case.name(point),
        "time": case.time(row),
        "off": case.off(row, point),
        "misclosure": case.distance(row, point),
        "search_radius": case.search_radius,
    }
    return claimed, Statement("another object", values=values | case.corrected(row))


def _without_point(case, row, tree):
    """Return the reason for an observation without an unmatched surveyed point nearby."""
    values = {"time": case.time(row)} | case.appearance(row)
    if tree is None:
        return Statement("no control", values=values)
    distance, nearest = tree.query(case.observations.position[row])
    values |= {
        "search_radius": case.search_radius,
        "nearest": case.name(nearest),
        "nearest_kind": case.control.kind[nearest],
        "nearest_size": float(case.control.size[nearest]),
        "distance": float(distance),
        "is_taken": not case.free(row, [nearest])[0],
    }
    return Statement("no point left", values=values)


def _without_observation(case, refused, reasons):
    """Make refusals for the control points that no pass observed."""
    column = case.decision.column
    known = {case.name(c) for c in column[column >= 0]} | {refusal.name for refusal in refused}
    missing = [i for i, name in enumerate(case.control.name) if name not in known]
    if len(case.observations) == 0:
        return [Refusal(case.name(i), None, Statement("nothing found")) for i in missing]
    tree = cKDTree(case.observations.position)
    return [Refusal(case.name(i), None, _why_missing(case, i, reasons, tree)) for i in missing]


def _why_missing(case, point, reasons, tree):
    """Return the reason for a missing control point, from nearby objects of its kind."""
    values = {"kind": case.control.kind[point], "size": float(case.control.size[point])}
    pairs, rows = case.pairs_of(point)
    rows = rows[case.pairs.same[pairs]]
    away = np.linalg.norm(case.observations.position[rows] - case.control.position[point], axis=1)
    rows = rows[np.argsort(away, kind="stable")]
    refused = [row for row in rows if case.decision.column[row] < 0]
    if refused:
        row = refused[0]
        values |= case.whereabouts(point, row) | {"why": reasons[row]}
        return Statement("only refused", values=values)
    values["search_radius"] = case.search_radius
    if len(rows):
        return Statement("only others", values=values | case.whereabouts(point, rows[0]))
    row = tree.query(case.control.position[point])[1]
    values |= {
        "nearest_kind": case.observations.kind[row],
        "nearest_size": float(case.observations.size[row]),
    }
    return Statement("none of its kind", values=values | case.whereabouts(point, row))
