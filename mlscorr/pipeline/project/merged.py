"""Drive through several areas: their results merged.

Corrections are averaged with position-dependent weights, so that two visits of a place move alike.
Results for a moment, a control point or a tie come from the area that contains it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction
from mlscorr.estimate import (
    CONSTRAINED,
    REASONS,
    Support,
    TieResiduals,
    filled_sigmas,
    guards_of,
    position_adjustment,
    position_prior,
    weak_intervals,
)
from mlscorr.evaluate import tie_residual_section
from mlscorr.pipeline.project.areas import Area, Piece
from mlscorr.pipeline.project.corrected import STATES, DriveState, drive_fields, tied_sentence
from mlscorr.pipeline.project.drive_estimate import CorrectedDrive, DriveEstimate
from mlscorr.pipeline.project.joint import FoundDrive
from mlscorr.survey import Ties, Trajectory


@dataclass(frozen=True)
class AreaResult:
    """Result of an area for a drive.

    Parameters
    ----------
    area : Area
    rows, control : bool array
        Selected epochs and observations of control points of the drive; see Piece.
    corrected : CorrectedDrive
        Corrected epochs.
    estimate : DriveEstimate
        Estimate of these, without covariances.
    state : DriveState
    """

    area: Area
    rows: np.ndarray
    control: np.ndarray
    corrected: CorrectedDrive
    estimate: DriveEstimate
    state: DriveState

    @classmethod
    def of(
        cls, area: Area, piece: Piece, corrected: CorrectedDrive, state: DriveState
    ) -> AreaResult:
        """Make the result of a piece of a drive."""
        estimate = corrected.estimate
        assert isinstance(estimate, DriveEstimate)
        bare = replace(estimate, correction=replace(estimate.correction, covariance=None))
        corrected = replace(corrected, estimate=bare)
        return cls(area, piece.rows, piece.control, corrected, bare, state)


def merged_drive(
    drive: FoundDrive, parts: Sequence[AreaResult]
) -> tuple[CorrectedDrive, DriveState]:
    """Merge a drive, and its state.

    Parameters
    ----------
    drive : FoundDrive
    parts : sequence of AreaResult
        Results of all areas that it crosses.
    """
    position = drive.survey.trajectory.position
    home = np.array([part.area.contains(position) for part in parts])
    main = parts[int(np.argmax(home.sum(axis=1)))]
    estimate = _estimate(drive, parts, home, main)
    state = _state(parts, home, estimate.used)
    estimate = replace(estimate, untied=tied_sentence(state) or main.estimate.untied)
    notes = _distinct([part.corrected.survey.notes for part in parts])
    statistics = tie_residual_section(estimate.ties) or {
        "n": 0,
        "used": 0,
        "reason": estimate.untied,
    }
    whole = replace(drive, survey=replace(drive.survey, notes=notes))
    fields = drive_fields(whole, estimate) | {"next_control": _places(drive, parts, home)}
    return CorrectedDrive(**fields, tie_section=statistics), state


def _estimate(drive, parts, home, main):
    """DriveEstimate of a drive; time-independent parts come from its main area."""
    survey = drive.survey
    correction = _averaged(survey.trajectory, parts)
    used, left_out = _control(drive, parts, home)
    of_parts = [part.estimate.screening for part in parts]
    at = _epochs(drive, drive.control.gps_time)
    names = np.array(drive.control.name, dtype=object)
    at_home = list(zip(of_parts, [set(names[is_home[at]]) for is_home in home], strict=True))
    outliers = {out.name: out for part, own in at_home for out in part.outliers if out.name in own}
    tests = {test.name: test for part, own in at_home for test in part.tests if test.name in own}
    order = main.estimate.order
    filled = filled_sigmas(survey.trajectory)[0]
    adjustment = position_adjustment(filled, drive.control[used], survey.pos, order, position_prior)
    return replace(
        main.estimate,
        correction=correction,
        adjustment=adjustment,
        screening=replace(
            main.estimate.screening,
            outliers=tuple(outliers.values()),
            tests=tuple(tests.values()),
            warnings=_distinct([part.warnings for part in of_parts]),
        ),
        used=used,
        left_out=left_out,
        guards=guards_of(
            survey.trajectory.scanned_passes, adjustment.observed, main.estimate.guards
        ),
        notes=_distinct([part.estimate.notes for part in parts]),
        ties=_ties(parts, correction),
        support=_support(parts, home, correction.corrected),
    )


def _averaged(trajectory: Trajectory, parts: Sequence[AreaResult]) -> Correction:
    """Correction averaged over all areas; sigmas are averaged as for fully correlated errors."""
    n = len(trajectory)
    total = np.zeros(len(trajectory))
    mean = np.zeros((n, 12))  # change, rotation, sigmas of position and attitude
    for part in parts:
        old = part.estimate.correction.recorded
        new = part.estimate.correction.corrected
        weight = part.area.weight(old.position)
        turn = (new.attitude * old.attitude.inv()).as_rotvec()
        columns = new.position - old.position, turn, new.position_sigma, new.attitude_sigma
        mean[part.rows] += weight[:, None] * np.hstack(columns)
        total[part.rows] += weight
    change, turn, *sigmas = np.split(mean / total[:, None], 4, axis=1)
    corrected = replace(
        trajectory,
        position=trajectory.position + change,
        attitude=Rotation.from_rotvec(turn) * trajectory.attitude,
        position_sigma=sigmas[0],
        attitude_sigma=sigmas[1],
    )
    return Correction(trajectory, corrected)


def _epochs(drive, gps_time):
    """Indices of the epochs at or after times."""
    known = drive.survey.trajectory.gps_time
    return np.clip(np.searchsorted(known, gps_time), 0, len(known) - 1)


def _control(drive, parts, home):
    """Flag (m,) of used observations of control points, and leave-one-out residuals (m, 3)."""
    at = _epochs(drive, drive.control.gps_time)
    used = np.zeros(len(at), bool)
    left_out = np.full((len(at), 3), np.nan)
    for part, is_home in zip(parts, home, strict=True):
        own = is_home[at[part.control]]
        rows = np.flatnonzero(part.control)[own]
        used[rows] = part.estimate.used[own]
        left_out[rows] = part.estimate.left_out[own]
    return used, left_out


def _ties(parts, correction):
    """TieResiduals of a drive's own passes; None without any."""
    ties = []
    used = []
    for part in parts:
        if (residuals := part.estimate.ties) is not None:
            own = part.area.contains(residuals.ties.place[:, 0])
            ties.append(residuals.ties[own])
            used.append(residuals.used[own])
    if sum(map(len, ties)) == 0:
        return None
    return TieResiduals.of(Ties.concatenate(ties), np.concatenate(used), correction)


def _support(parts, home, corrected):
    """Support of a drive."""
    time = corrected.gps_time
    codes = np.full(len(corrected), CONSTRAINED)
    for part, is_home in zip(parts, home, strict=True):
        for interval in part.estimate.support.weak:
            inside = is_home & (time >= interval.start) & (time <= interval.end)
            codes[inside] = REASONS.index(interval.why)
    outages: list[tuple[float, float]] = []
    for each in sorted(span for part in parts for span in part.estimate.support.outages):
        first, last = outages.pop() if outages and each[0] <= outages[-1][1] else each
        outages.append((first, max(last, each[1])))
    steps = {step for part in parts for step in part.estimate.support.steps}
    return Support(tuple(weak_intervals(codes, corrected)), tuple(outages), tuple(sorted(steps)))


def _places(drive, parts, home):
    """Best positions for one more control point each, as many as for an area."""
    places = [
        place
        for part, is_home in zip(parts, home, strict=True)
        for place in part.corrected.next_control
        if is_home[_epochs(drive, place.gps_time)]
    ]
    number = max(len(part.corrected.next_control) for part in parts)
    return tuple(sorted(places, key=lambda place: place.sigma_after - place.sigma_before)[:number])


def _state(parts, home, used):
    """DriveState of a drive; without its own control that of the least constrained area."""
    order = list(STATES)
    least = max(
        order.index(part.state.state)
        for part, is_home in zip(parts, home, strict=True)
        if is_home.any()
    )
    state = order[0] if used.any() else order[max(least, 1)]
    ties = [part.state.tied_with for part in parts]
    names = dict.fromkeys(name for own in ties for name in own)
    tied_with = {name: _joined([own[name] for own in ties if name in own]) for name in names}
    return DriveState(parts[0].state.name, state, tied_with)


def _joined(rows):
    """Numbers of ties and their RMS before and after, from those of several areas."""
    number = np.array([row["n"] for row in rows])

    def rms(key):
        return float(np.sqrt(number @ [row[key] ** 2 for row in rows] / number.sum()))

    return {"n": int(number.sum()), "before": rms("before"), "after": rms("after")}


def _distinct(parts):
    """Sentences of several parts, each once."""
    return tuple(dict.fromkeys(text for part in parts for text in part))
