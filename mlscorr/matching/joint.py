"""The joint decision of all matches."""

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.matching.beliefs import build_chain
from mlscorr.matching.decision import decide
from mlscorr.matching.marginals import marginals
from mlscorr.matching.pairs import find_pairs, gates
from mlscorr.matching.reasons import Refusal, explain
from mlscorr.survey import Pos, TargetObservations


@dataclass(frozen=True)
class Matches:
    """Matched observations (named), those left over, and the refusals.

    ``probability`` (n,) is that of each match, given all others; ``reasons`` (m,) say of each
    unmatched observation why it has no name.
    """

    matched: TargetObservations
    unmatched: TargetObservations
    refusals: tuple[Refusal, ...]
    probability: np.ndarray
    reasons: tuple[str, ...]


@threadpool_limits.wrap(limits=1, user_api="blas")
def match(observations, control, trajectory, pos=None):
    """Assign observations to control points, at most one per control point and visit.

    Kind and size must agree and the distance lie within the gate (four stated sigmas, at least
    one metre). Among these, misclosures change smoothly along the drive, by as much as the POS's
    sigmas allow: a match is used when its probability, given all other observations before and
    after it, is at least 0.99, and refused with a reason otherwise. So is one to a surveyed point
    that lies elsewhere than its target by more than its neighbours' credible motion; all passes
    decide that together.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
        Control and check points together.
    trajectory : Trajectory
        As recorded.
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.

    Returns Matches. Raises ValueError where an observation lies outside the trajectory.
    """
    order = np.argsort(observations.gps_time, kind="stable")
    ordered = observations[order]
    pose = trajectory.at(ordered.gps_time)
    gate = gates(pose.position_sigma, len(ordered))
    pairs = find_pairs(ordered, control, gate)
    chain = build_chain(ordered, control, pose, pairs, Pos() if pos is None else pos)
    decision = decide(pairs, marginals(chain), len(control))
    refusals, reasons = explain(ordered, control, pairs, decision, gate)
    back = np.argsort(order)
    column = decision.column[back]
    named = replace(observations, name=tuple(control.name[c] if c >= 0 else None for c in column))
    return Matches(
        named[column >= 0],
        named[column < 0],
        refusals,
        decision.probability[back][column >= 0],
        tuple(reasons[i] for i in back[column < 0]),
    )
