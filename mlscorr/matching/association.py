"""Matching of observations and surveyed points: the joint decision on all matches."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.matching._beliefs import build_chain
from mlscorr.matching._marginals import marginals
from mlscorr.matching._pairs import find_pairs
from mlscorr.matching._wording import sentence_of
from mlscorr.matching.decision import decide, moved_share_by_others
from mlscorr.matching.reasons import Refusal, explain
from mlscorr.pos import PosErrors
from mlscorr.survey import (
    SEARCH_RADIUS,
    ControlPoints,
    Matched,
    Pos,
    Statement,
    Survey,
    TargetObservations,
    Trajectory,
)


@dataclass(frozen=True)
class Matches:
    """Matched observations, unmatched observations, and refusals.

    Parameters
    ----------
    matched : TargetObservations
        Observations with names.
    unmatched : TargetObservations
        Observations without names.
    refusals : tuple of Refusal
        Refusals of surveyed points without an observation.
    probability : (n,) array
        Probability of each match, given all others.
    why : tuple of m Statement
        Reason why each unmatched observation has no name; ``reasons`` has the sentences.
    moved : TargetObservations, optional
        Unmatched observations that show the true position of a displaced surveyed point, with its
        name.
    """

    matched: TargetObservations
    unmatched: TargetObservations
    refusals: tuple[Refusal, ...]
    probability: np.ndarray
    why: tuple[Statement, ...]
    moved: TargetObservations | None = None

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reason, as a sentence, why each unmatched observation has no name."""
        return tuple(sentence_of(statement) for statement in self.why)

    def by_role(self, survey: Survey) -> tuple[Matched, Matched]:
        """Return the matched control points and the matched check points.

        Parameters
        ----------
        survey : Survey
        """
        matched = Matched.by_name(self.matched, survey.surveyed)
        is_control = np.isin(matched.name, survey.control.name)
        return matched[is_control], matched[~is_control]


def match(
    observations: TargetObservations,
    control: ControlPoints,
    trajectory: Trajectory,
    pos: Pos | None = None,
    search_radius: float = SEARCH_RADIUS,
) -> Matches:
    """Assign observations to control points, at most one per control point and visit.

    Kind and size must agree, and the distance must be within the search radius. Misclosures change
    smoothly along the drive, by an unknown amount whatever the POS states. A match is used if its
    probability, given all other observations and averaged over all possible drifts, is at least
    0.99; otherwise it is refused with a reason. A match is also refused if the surveyed point
    differs from its target by more than the drift between neighbors can explain; all passes decide
    this together.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
        Control and check points together.
    trajectory : Trajectory
        Recorded trajectory.
    pos : Pos, optional
        Assumed accuracy, used if the trajectory has no sigmas.
    search_radius : float
        Largest distance of an observation from its surveyed point. Units: m.

    Raises
    ------
    ValueError
        If an observation is outside the trajectory.
    """
    order = np.argsort(observations.gps_time, kind="stable")
    ordered = observations[order]
    pose = trajectory.at(ordered.gps_time)
    errors = PosErrors.stated(trajectory, pos)
    pairs = find_pairs(ordered, control, search_radius)
    decision = _decide(build_chain(ordered, control, pose, errors, pairs), len(control))
    refusals, reasons = explain(ordered, control, pairs, decision, search_radius)
    rank = np.argsort(order)
    column = decision.column[rank]
    known = (*control.name, None)  # the last one, -1, for observations without a name
    named = replace(observations, name=tuple(known[c] for c in column))
    elsewhere = decision.moved(pairs)[rank]
    names = tuple(control.name[c] for c in elsewhere[elsewhere >= 0])
    moved = replace(observations[elsewhere >= 0], name=names)
    is_matched = column >= 0
    probability = decision.probability[rank][is_matched]
    why = tuple(reasons[i] for i in rank[~is_matched])
    return Matches(named[is_matched], named[~is_matched], refusals, probability, why, moved)


def _decide(chain, count):
    """Make the Decision; for points with repeated observations, all passes count together.

    A surveyed point that other passes confirm cannot explain a jump in this one.
    """
    first = marginals(chain)
    decision = decide(chain.pairs, first, count, chain.moved_share)
    if decision.passes.max(initial=0) < 2 or (decision.column >= 0).all():
        return decision
    share = moved_share_by_others(chain.pairs, first, count, chain.moved_share)
    return decide(chain.pairs, marginals(chain._replace(moved_share=share)), count, share)
