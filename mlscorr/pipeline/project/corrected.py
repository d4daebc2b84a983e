"""From findings in files to corrected drives: matched, estimated together, and split again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import Estimate, place_control
from mlscorr.evaluate import misclosure_statistics, tie_residual_section, tie_section
from mlscorr.pipeline.clouds import MovedClouds
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.correction import corrected_fields
from mlscorr.pipeline.file_finding import FileFinding, join_findings
from mlscorr.pipeline.project.areas import Area
from mlscorr.pipeline.project.drive_estimate import CorrectedDrive, drive_estimate
from mlscorr.pipeline.project.joint import FoundDrive, JointEstimate
from mlscorr.survey import Survey

STATES = {
    "controlled": "constrained by its own control points",
    "tied": "constrained by control points of other drives, through ties",
    "relative": "not constrained by control points: ties only align its passes",
    "uncorrected": "not corrected: no control point was found, and no overlap with ties",
}


@dataclass(frozen=True)
class DriveState:
    """State of a drive's control and ties.

    Parameters
    ----------
    name : str
    state : str
        One of STATES.
    tied_with : dict
        Number of used ties with each other drive, and their RMS before and after (m).
    """

    name: str
    state: str
    tied_with: dict[str, dict]


def found_drive(survey: Survey, files: Sequence[FileFinding]) -> FoundDrive:
    """Make a drive with its matched points.

    Parameters
    ----------
    survey : Survey
    files : sequence of FileFinding
        Findings of its clouds.
    """
    finding, features = join_findings(survey, files)
    trajectory = survey.trajectory.scanned_at(finding.candidates.seconds)
    survey = replace(survey, trajectory=trajectory)
    return FoundDrive(survey, finding, features, *finding.matches.by_role(survey))


def corrected_drives(
    part: JointEstimate, area: Area | None = None
) -> list[tuple[CorrectedSurvey, DriveState]]:
    """Results of drives that were estimated together.

    Parameters
    ----------
    part : JointEstimate
    area : Area, optional
        Area of the pieces: ties elsewhere do not count.
    """
    joint = part.joint
    estimate = part.estimate
    states = [_state(part, number, area) for number in range(len(joint.drives))]
    if joint.is_single and area is None:
        return [(CorrectedSurvey(**drive_fields(joint.drives[0], estimate)), states[0])]
    places = place_control(estimate)
    # an area is not a drive
    if area is not None:
        section = {}
    else:
        section = tie_section(estimate) or {}
    results = []
    for number, (drive, shift) in enumerate(zip(joint.drives, joint.shifts, strict=True)):
        own = drive_estimate(joint, estimate, number, tied_sentence(states[number]))
        first, last = drive.survey.trajectory.gps_time[[0, -1]]
        near = [replace(place, gps_time=place.gps_time - shift) for place in places]
        shared = {key: section[key] for key in ("share", "sufficient_control") if key in section}
        statistics = tie_residual_section(own.ties) or {"n": 0, "used": 0, "reason": own.untied}
        ties = statistics | (shared if own.ties else {})
        survey = replace(drive.survey, notes=(*drive.survey.notes, *joint.survey.notes))
        corrected = CorrectedDrive(
            **drive_fields(replace(drive, survey=survey), own),
            next_control=tuple(place for place in near if first <= place.gps_time <= last),
            tie_section=ties,
        )
        results.append(corrected)
    pairs = zip(results, states, strict=True)
    return [(corrected, state) for corrected, state in pairs if state.name in part.names]


def drive_fields(drive: FoundDrive, estimate: Estimate) -> dict[str, Any]:
    """Fields of a CorrectedSurvey.

    Parameters
    ----------
    drive : FoundDrive
    estimate : Estimate
        Estimate for its own control points and epochs.
    """
    return corrected_fields(drive.survey, drive.control, drive.check, drive.finding, estimate)


def _state(part, number, area):
    """DriveState of one of several drives that were estimated together."""
    joint = part.joint
    estimate = part.estimate
    drive = part.joint.drives[number]
    owner = np.repeat(np.arange(len(joint.drives)), [len(d.control) for d in joint.drives])
    if estimate.used[owner == number].any():
        state = "controlled"
    elif estimate.used.any():
        state = "tied"
    else:
        is_tied = estimate.ties is not None and estimate.ties.used.any()
        state = "relative" if is_tied else "uncorrected"
    return DriveState(drive.survey.name, state, _ties(part, number, area))


def _ties(part, number, area):
    """Used ties of a drive with each other one, within an area."""
    residuals = part.estimate.ties
    shared: dict[str, dict] = {}
    if residuals is None:
        return shared
    owner = part.joint.drive_numbers(residuals.ties.pass_number)
    counted = residuals.used & (owner == number).any(axis=1)
    if area is not None:
        counted &= area.contains(residuals.ties.place[:, 0])
    own = np.flatnonzero(counted)
    others = owner[own].sum(axis=1) - number
    for other in np.unique(others[others != number]).tolist():
        rows = own[others == other]
        shared[part.joint.drives[other].survey.name] = {
            "n": len(rows),
            "before": misclosure_statistics(residuals.ties.misclosure[rows])["rms"],
            "after": misclosure_statistics(residuals.after[rows])["rms"],
        }
    return shared


def tied_sentence(state: DriveState) -> str:
    """Sentence on a drive's ties with others; empty without any.

    Parameters
    ----------
    state : DriveState
    """
    if not state.tied_with:
        return ""
    listed = "; ".join(
        f"{ties['n']} with {name}, RMS misclosure {ties['before']:.3f} m before and "
        f"{ties['after']:.3f} m after"
        for name, ties in state.tied_with.items()
    )
    return f"Adjusted together with other drives of the project, by ties: {listed}."


def bare_survey(survey: Survey) -> Survey:
    """Return a survey without data that only a report needs.

    Parameters
    ----------
    survey : Survey
    """
    none = survey.control[[]]
    survey = replace(survey, control=none, check=none, excluded=none, included=())
    return replace(survey, notes=(), layouts=(), inputs=())


def motion_of(corrected: CorrectedSurvey, with_sigma: bool) -> MovedClouds:
    """Motion of a drive's clouds, without data that only a report needs.

    Parameters
    ----------
    corrected : CorrectedSurvey
    with_sigma : bool
        True if points get their sigmas.
    """
    survey = corrected.survey
    correction = corrected.estimate.correction
    if not with_sigma:
        correction = Correction(correction.recorded, correction.corrected)
    bare = replace(bare_survey(survey), trajectory=correction.recorded)
    return MovedClouds(bare, correction, corrected.held)
