"""Which observation is which surveyed point: the joint decision of all matches."""

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
    """Matched observations, those left over, and the refusals.

    Parameters
    ----------
    matched : TargetObservations
        With names.
    unmatched : TargetObservations
        Without.
    refusals : tuple of Refusal
        Of surveyed points without an observation.
    probability : (n,) array
        Of each match, given all others.
    why : tuple of m Statement
        Why each unmatched observation has no name; ``reasons`` are their sentences.
    moved : TargetObservations, optional
        Those unmatched that show where a surveyed point's target stands instead, with its name.
    """

    matched: TargetObservations
    unmatched: TargetObservations
    refusals: tuple[Refusal, ...]
    probability: np.ndarray
    why: tuple[Statement, ...]
    moved: TargetObservations | None = None

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why each unmatched observation has no name, in a sentence each."""
        return tuple(sentence_of(statement) for statement in self.why)

    def by_role(self, survey: Survey) -> tuple[Matched, Matched]:
        """The matched control points, and the matched check points.

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

    Kind and size must agree and the distance lie within the search radius. Misclosures change
    smoothly along the drive; by how much is not known, whatever the POS states. A match is used
    when its probability, given all other observations before and after it and over all that the
    drift may be, is at least 0.99, and refused with a reason otherwise. So is one to a surveyed
    point that lies elsewhere than its target by more than its neighbours' credible motion; all
    passes decide that together.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
        Control and check points together.
    trajectory : Trajectory
        As recorded.
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.
    search_radius : float
        How far a surveyed point may lie from its observation. Units: m.

    Raises
    ------
    ValueError
        Where an observation lies outside the trajectory.
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
    known = (*control.name, None)  # the last, -1, of what has no name
    named = replace(observations, name=tuple(known[c] for c in column))
    elsewhere = decision.moved(pairs)[rank]
    names = tuple(control.name[c] for c in elsewhere[elsewhere >= 0])
    moved = replace(observations[elsewhere >= 0], name=names)
    is_matched = column >= 0
    probability = decision.probability[rank][is_matched]
    why = tuple(reasons[i] for i in rank[~is_matched])
    return Matches(named[is_matched], named[~is_matched], refusals, probability, why, moved)


def _decide(chain, count):
    """The Decision; where points were seen repeatedly, what each pass tells of them counts in all.

    A surveyed point that other passes found in its place is no explanation of a jump in this one.
    """
    first = marginals(chain)
    decision = decide(chain.pairs, first, count, chain.moved_share)
    if decision.passes.max(initial=0) < 2 or (decision.column >= 0).all():
        return decision
    share = moved_share_by_others(chain.pairs, first, count, chain.moved_share)
    return decide(chain.pairs, marginals(chain._replace(moved_share=share)), count, share)
