"""Which observation is which surveyed target."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from mlscorr.survey import TargetObservations

SIGMAS = 4.0  # of the stated position sigma
LEAST_GATE = 1.0  # m: datum and mounting errors are not in the POS's sigma
CLEARLY = 2.0  # times farther away must a rival be, for a match to be sure
SIZE_TOLERANCE = 0.01  # m


@dataclass(frozen=True)
class Refusal:
    """A control point that stays without observation in a pass, and why; pass None = in all."""

    name: str
    pass_number: int | None
    reason: str


@dataclass(frozen=True)
class Matches:
    """Matched observations (named), those left over, and the refusals."""

    matched: TargetObservations
    unmatched: TargetObservations
    refusals: tuple[Refusal, ...]


def match(observations, control, trajectory):
    """Assign observations to control points, at most one per control point and pass.

    Kind and size must agree and the distance lie within the gate (four stated sigmas, at least
    one metre). Within a pass the assignment has the least sum of squared normalised distances; it
    is refused where a rival on either side is not clearly farther away.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
        Control and check points together.
    trajectory : Trajectory
        As recorded.

    Returns Matches.
    """
    gate = _gate(observations, trajectory)
    names: list[str | None] = [None] * len(observations)
    refusals = []
    for number in np.unique(observations.pass_number):
        rows = np.flatnonzero(observations.pass_number == number)
        ratio = _normalised_distance(observations[rows], control, gate[rows])
        for row, column in zip(*linear_sum_assignment(np.minimum(ratio, 2.0) ** 2), strict=True):
            if ratio[row, column] > 1.0:
                continue
            rival = _rival(ratio, row, column)
            if rival is None:
                names[rows[row]] = control.name[column]
            else:
                reason = _ambiguity(observations, control, rows, row, column, rival, gate)
                refusals.append(Refusal(control.name[column], int(number), reason))
    named = replace(observations, name=tuple(names))
    matched = np.array([name is not None for name in names], dtype=bool)
    refusals += _unseen(named, control, refusals, gate)
    return Matches(named[matched], named[~matched], tuple(refusals))


def _gate(observations, trajectory):
    """Largest credible misclosure of each observation: (n,). Units: m."""
    sigma = trajectory.at(observations.gps_time).position_sigma
    if sigma is None:
        return np.full(len(observations), LEAST_GATE)
    return np.maximum(LEAST_GATE, SIGMAS * np.linalg.norm(sigma, axis=1))


def _normalised_distance(observations, control, gate):
    """Distance over gate (n, k) of observations and control points; infinite for other kinds."""
    distance = np.linalg.norm(observations.position[:, None] - control.position, axis=2)
    same = np.array(observations.kind)[:, None] == np.array(control.kind)
    same &= np.abs(observations.size[:, None] - control.size) <= SIZE_TOLERANCE
    return np.where(same, distance / gate[:, None], np.inf)


def _rival(ratio, row, column):
    """The rival ("control" or "observation", its index) that is not clearly farther, or None."""
    limit = min(1.0, max(CLEARLY * ratio[row, column], 0.1))
    for what, values, own in (
        ("control", ratio[row], column),
        ("observation", ratio[:, column], row),
    ):
        others = np.flatnonzero((values <= limit) & (np.arange(len(values)) != own))
        if len(others):
            return what, int(others[np.argmin(values[others])])
    return None


def _ambiguity(observations, control, rows, row, column, rival, gate):
    """The sentence that tells why a match was refused."""
    what, other = rival
    time = observations.gps_time[rows[row]]
    if what == "control":
        apart = np.linalg.norm(control.position[column] - control.position[other])
        return (
            f"{control.name[column]} and {control.name[other]} lie {apart:.2f} m apart and both "
            f"claim the observation at {time:.1f} s (gate {gate[rows[row]]:.2f} m)."
        )
    positions = observations.position[rows]
    apart = np.linalg.norm(positions[row] - positions[other])
    return (
        f"Two observations {apart:.2f} m apart, at {time:.1f} s and "
        f"{observations.gps_time[rows[other]]:.1f} s, both claim {control.name[column]} "
        f"(gate {gate[rows[row]]:.2f} m)."
    )


def _unseen(named, control, refusals, gate):
    """Refusals for the control points that no pass observed."""
    seen = set(named.name) | {refusal.name for refusal in refusals}
    for index, name in enumerate(control.name):
        if name in seen:
            continue
        distance = np.linalg.norm(named.position - control.position[index], axis=1)
        if len(distance) == 0:
            yield Refusal(name, None, "No target was found in the cloud.")
            continue
        near = int(np.argmin(distance))
        found = f"the nearest one found lies {distance[near]:.2f} m away"
        if named.name[near] is not None:
            found += f" and is {named.name[near]}"
        yield Refusal(name, None, f"No target is left for it; {found} (gate {gate[near]:.2f} m).")
