"""Several drives as one survey: one trajectory, distinct times, passes numbered over all.

Nearby drives are estimated together; those without ties keep their own estimate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mlscorr.estimate import Estimate
from mlscorr.io.store import digest
from mlscorr.io.trajectories import join_sessions, with_sigmas
from mlscorr.pipeline.estimation import estimate_together
from mlscorr.pipeline.finding import MatchedTargets
from mlscorr.surfaces import join_features
from mlscorr.survey import (
    WEEK,
    ControlPoints,
    Matched,
    MountedScanner,
    Survey,
    TargetObservations,
    TieFeatures,
    Trajectory,
)
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class FoundDrive:
    """Drive and the findings in its files.

    Parameters
    ----------
    survey : Survey
        With the surveyed points near its clouds.
    finding : MatchedTargets
    features : TieFeatures
        With its pass numbers.
    control, check : Matched
    """

    survey: Survey
    finding: MatchedTargets
    features: TieFeatures
    control: Matched
    check: Matched

    @property
    def passes(self) -> int:
        """Number of its passes."""
        return len(self.finding.candidates.passes)


@dataclass(frozen=True)
class JointDrives:
    """Several drives as one survey.

    Parameters
    ----------
    drives : tuple of FoundDrive
        In the order of their times in the joint survey.
    shifts : (k,) array
        Whole weeks added to make times distinct: joint = recorded + shift. Units: s.
    survey : Survey
        With the common trajectory, without clouds.
    """

    drives: tuple[FoundDrive, ...]
    shifts: np.ndarray
    survey: Survey

    @property
    def is_single(self) -> bool:
        """True if it is one unchanged drive."""
        return self.survey is self.drives[0].survey

    @property
    def bases(self) -> np.ndarray:
        """Number (k,) of passes before those of each drive."""
        return np.cumsum([0, *(drive.passes for drive in self.drives[:-1])])

    def drive_numbers(self, pass_number: np.ndarray) -> np.ndarray:
        """Index of the drive of each pass, from 0.

        Parameters
        ----------
        pass_number : int array
            Passes of the joint survey.
        """
        return np.searchsorted(self.bases, pass_number - 1, side="right") - 1

    def control(self) -> Matched:
        """Matched control points of all drives."""
        observed = [
            replace(
                drive.control.observations,
                gps_time=drive.control.gps_time + shift,
                pass_number=drive.control.observations.pass_number + base,
            )
            for drive, shift, base in zip(self.drives, self.shifts, self.bases, strict=True)
        ]
        surveyed = [drive.control.surveyed for drive in self.drives]
        return Matched(
            TargetObservations.concatenate(observed), ControlPoints.concatenate(surveyed)
        )

    def features(self, origin: np.ndarray) -> TieFeatures:
        """Planes and poles of all drives.

        Parameters
        ----------
        origin : (3,) array
            Origin used when they were found. Units: m.
        """
        names = list(self.survey.by_scanner)
        parts = []
        for drive, shift, base in zip(self.drives, self.shifts, self.bases, strict=True):
            part = drive.features
            own = list(drive.survey.by_scanner)
            number = np.array([names.index(n) if n in names else 0 for n in own])
            parts.append(
                replace(
                    part,
                    gps_time=part.gps_time + shift,
                    pass_number=part.pass_number + base,
                    scanner=number[part.scanner],
                )
            )
        return join_features(parts, origin)


def join_drives(drives: Sequence[FoundDrive]) -> JointDrives:
    """Join drives to one survey.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    if len(drives) == 1:
        return JointDrives(tuple(drives), np.zeros(1), drives[0].survey)
    shifts = distinct_times([drive.survey.trajectory for drive in drives])
    starts = np.array([drive.survey.trajectory.gps_time[0] for drive in drives])
    order = np.argsort(starts + shifts)
    drives = [drives[i] for i in order]
    shifts = shifts[order]
    surveys = [drive.survey for drive in drives]
    names = [survey.name for survey in surveys]
    parts = [
        replace(survey.trajectory, gps_time=survey.trajectory.gps_time + shift)
        for survey, shift in zip(surveys, shifts, strict=True)
    ]
    parts, notes = with_sigmas(names, parts, surveys[0].pos)
    trajectory = join_sessions(names, parts, surveys[0].pos)[0]
    scanners = _scanners(surveys)
    mountings = {digest(survey.mounting) for survey in surveys}
    joint = replace(
        surveys[0],
        name=", ".join(names),
        clouds=(),
        trajectory=trajectory,
        mounting=surveys[0].mounting if len(mountings) == 1 else None,
        notes=tuple(notes),
        inputs=(),
        scanners=scanners,
    )
    return JointDrives(tuple(drives), shifts, joint)


def _scanners(surveys):
    """Scanners of all drives by name; empty if each drive has one."""
    if not any(survey.scanners for survey in surveys):
        return ()
    parts = {n: part for survey in surveys[::-1] for n, part in survey.by_scanner.items()}
    return tuple(MountedScanner(n, p.scanner, p.mounting, ()) for n, p in parts.items())


def distinct_times(trajectories: Sequence[Trajectory]) -> np.ndarray:
    """Whole weeks (k,) to add to times, so that no two drives share any. Units: s.

    Two vehicles may drive at the same time, and seconds of week repeat.

    Parameters
    ----------
    trajectories : sequence of Trajectory
    """
    spans = np.array([trajectory.gps_time[[0, -1]] for trajectory in trajectories])
    shifts = np.zeros(len(spans))
    placed = np.empty((0, 2))
    for number in np.argsort(spans[:, 0], kind="stable"):
        span = spans[number] + [-TIES.pause, TIES.pause]
        while ((span[0] < placed[:, 1]) & (span[1] > placed[:, 0])).any():
            shifts[number] += WEEK
            span = span + WEEK
        placed = np.vstack([placed, spans[number] + shifts[number]])
    return shifts


@dataclass(frozen=True)
class JointEstimate:
    """Drives connected by ties, and their common estimate.

    Parameters
    ----------
    joint : JointDrives
        Also includes drives without ties to them.
    estimate : Estimate
        Estimate of all joint drives.
    names : set of str
        Names of the connected drives.
    """

    joint: JointDrives
    estimate: Estimate
    names: set[str]


def estimate_group(
    group: Sequence[FoundDrive], order: int, origin: np.ndarray, with_ties: bool
) -> list[JointEstimate]:
    """Estimate the POS errors of nearby drives, together if ties connect them.

    If ties form separate groups, the group with all of the control keeps the estimate, which the
    others did not affect. The others are estimated again, without a common shift from foreign
    control.

    Parameters
    ----------
    group : sequence of FoundDrive
    order : int
        Order of the trend of a single drive; several drives have a common shift.
    origin : (3,) array
        Origin of planes and poles. Units: m.
    with_ties : bool
    """
    joint = join_drives(group)
    features = joint.features(origin) if with_ties else None
    least = order if len(group) == 1 else min(order, 0)
    estimate = estimate_together(joint.survey, joint.control(), features, least)
    parts = _tied(joint, estimate)
    results = []
    owner = np.repeat([d.survey.name for d in joint.drives], [len(d.control) for d in joint.drives])
    controlled = set(owner[estimate.used].tolist())
    for part in parts:
        names = {drive.survey.name for drive in part}
        if len(parts) == 1 or (len(part) > 1 and controlled and controlled <= names):
            results.append(JointEstimate(joint, estimate, names))
        else:
            results += estimate_group(part, order, origin, with_ties)
    return results


def _tied(joint, estimate):
    """Lists of drives connected by used ties."""
    number = len(joint.drives)
    pairs = np.empty((2, 0), int)
    if estimate.ties is not None:
        pairs = joint.drive_numbers(estimate.ties.ties.pass_number[estimate.ties.used]).T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(number, number))
    return _grouped(joint.drives, connected_components(graph, directed=False)[1])


def near_drives(drives: Sequence[FoundDrive]) -> list[list[FoundDrive]]:
    """Lists of drives whose planes and poles are approximately within the search radius.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    radius = max(drive.survey.search_radius for drive in drives)
    rows = [np.empty(0, int)]
    cells = [np.empty((0, 2), int)]
    for number, drive in enumerate(drives):
        own = np.unique(np.floor(drive.features.centre[:, :2] / radius).astype(int), axis=0)
        wide = np.concatenate([own + np.array([i, j]) for i in (0, 1) for j in (0, 1)])
        rows.append(np.full(len(wide), number))
        cells.append(wide)
    cell = np.unique(np.concatenate(cells), axis=0, return_inverse=True)[1].ravel()
    size = len(drives) + cell.max(initial=-1) + 1
    edges = np.concatenate(rows), len(drives) + cell
    graph = coo_array((np.ones(len(cell), bool), edges), shape=(size, size))
    return _grouped(drives, connected_components(graph, directed=False)[1][: len(drives)])


def _grouped(drives, labels):
    """Lists of drives with the same label, in order of their first."""
    groups = [np.flatnonzero(labels == label) for label in dict.fromkeys(labels.tolist())]
    return [[drives[number] for number in group] for group in groups]
