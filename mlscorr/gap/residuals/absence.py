"""Surveyed targets that should have been observed but were not, and thus have no row."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from mlscorr.matching import Matches
from mlscorr.survey import Survey

LEAST_RUN = 2  # consecutive in time: a single target may be hidden by a parked car


@dataclass(frozen=True)
class AbsentRun:
    """Consecutive targets in sight that were not found, or were found and refused.

    Parameters
    ----------
    name : tuple of k str
    gps_time : tuple of k float
        Time at which each was refused, or would have been nearest. Units: s.
    reason : tuple of k str
    """

    name: tuple[str, ...]
    gps_time: tuple[float, ...]
    reason: tuple[str, ...]

    @property
    def distinct(self) -> list[str]:
        """Names, each once, because an obstacle in one pass also hides a target in the next."""
        return list(dict.fromkeys(self.name))

    @property
    def hint(self) -> str:
        """Description of the run in words."""
        return (
            f"interval from {self.gps_time[0]:.1f} to {self.gps_time[-1]:.1f} s in which the "
            f"{len(self.distinct)} surveyed targets {', '.join(self.distinct)} were in range and "
            "none could be matched"
        )

    def document(self) -> dict:
        """Return the run as in gap.json."""
        return {
            "names": list(self.name),
            "gps_time": list(self.gps_time),
            "reasons": list(self.reason),
        }


@dataclass(frozen=True)
class Absence:
    """Missing targets of a survey.

    Parameters
    ----------
    runs : tuple of AbsentRun
        Longest run first.
    sightings : int
        Number of targets and passes that were, or should have been, observed.
    missing : int
        Number of those that were not.
    moved : tuple of str
        Control points whose targets were found away from their surveyed positions.
    """

    runs: tuple[AbsentRun, ...] = ()
    sightings: int = 0
    missing: int = 0
    moved: tuple[str, ...] = ()

    @property
    def chance(self) -> float:
        """Bound on the probability of such runs if targets are missed independently.

        There are fewer than n positions for a run of r, each with probability q^r; q is the share
        missing outside the runs, by Laplace's rule of succession.
        """
        lengths = np.array([len(run.distinct) for run in self.runs], dtype=int)
        inside = sum(len(run.name) for run in self.runs)
        share = (self.missing - inside + 1) / (self.sightings - inside + 2)
        return float(np.prod(np.minimum(self.sightings * share**lengths, 1.0)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return a sentence on each run, with all reasons."""
        return tuple(
            f"No residual describes the {run.hint}: "
            + " ".join(
                f"{name} ({time:.1f} s): {reason}"
                for name, time, reason in zip(run.name, run.gps_time, run.reason, strict=True)
            )
            for run in self.runs
        )


def find_absence(survey: Survey, matches: Matches) -> Absence:
    """Find runs of surveyed targets in sight without a residual.

    A target is in sight if it is as close to the POS as the farthest matched target. A target
    observed in one pass counts in another only if it was found there and refused.

    Parameters
    ----------
    survey : Survey
    matches : Matches
        Of its control and check points.
    """
    matched = matches.matched
    if len(matched) == 0:
        return Absence()
    moved = () if matches.moved is None else matches.moved.name
    place = survey.trajectory.at(matched.gps_time).position
    sight = np.linalg.norm(matched.position - place, axis=1).max()
    sightings: list[tuple[float, str, str | None]] = [
        (t, name, None) for t, name in zip(matched.gps_time, matched.name, strict=True)
    ]
    sightings += [
        (refusal.gps_time, refusal.name, refusal.reason)
        for refusal in matches.refusals
        if refusal.gps_time is not None and refusal.name not in moved
    ]
    named = {name for _, name, _ in sightings} | set(moved)
    reasons = {refusal.name: refusal.reason for refusal in matches.refusals}
    for name, point in zip(survey.surveyed.name, survey.surveyed.position, strict=True):
        distance = np.linalg.norm(survey.trajectory.position - point, axis=1)
        nearest = int(np.argmin(distance))
        if name not in named and distance[nearest] <= sight:
            time = survey.trajectory.gps_time[nearest]
            sightings.append((time, name, reasons.get(name, "It was not found.")))
    moved = tuple(name for name in moved if name in survey.control.name)
    return _absence(sorted(sightings, key=lambda sighting: sighting[0]), moved)


def _absence(sightings: Sequence[tuple[float, str, str | None]], moved: tuple[str, ...]) -> Absence:
    """Absence of sightings (time, name, reason or None) in order of time."""
    runs = []
    for is_missing, group in groupby(sightings, key=lambda sighting: sighting[2] is not None):
        part = list(group)
        if is_missing and len({name for _, name, _ in part}) >= LEAST_RUN:
            time, name, reason = zip(*part, strict=True)
            runs.append(AbsentRun(name, tuple(map(float, time)), reason))
    missing = sum(reason is not None for _, _, reason in sightings)
    runs.sort(key=lambda run: -len(run.name))
    return Absence(tuple(runs), len(sightings), missing, moved)
