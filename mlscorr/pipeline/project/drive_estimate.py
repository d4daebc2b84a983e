"""Part of one drive in a common estimate of several drives."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import Alternative, Estimate, NextControl, Support, TieResiduals, guards_of
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.project.joint import JointDrives
from mlscorr.pos import PosErrors


@dataclass(frozen=True, repr=False)
class DriveEstimate(Estimate):
    """Result of a common estimate for one of several drives, in its own times."""

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Empty, because there are no other orders of the common shift of drives."""
        return ()

    def _guard_warnings(self):
        if len(self.adjustment.names):
            return super()._guard_warnings()
        return ()


@dataclass(frozen=True, repr=False)
class CorrectedDrive(CorrectedSurvey):
    """One of several drives that were corrected together.

    Parameters
    ----------
    next_control : tuple of NextControl
        Best positions for further control for all drives, limited to this drive.
    tie_section : dict
        Effect of ties, as in report.json.
    """

    next_control: tuple[NextControl, ...] = ()
    tie_section: dict | None = None


def drive_estimate(joint: JointDrives, estimate: Estimate, number: int, note: str) -> DriveEstimate:
    """Make the part of one drive in an estimate of all.

    Parameters
    ----------
    joint : JointDrives
    estimate : Estimate
    number : int
        Index of the drive.
    note : str
        Sentence on its ties with others.
    """
    trajectory = joint.drives[number].survey.trajectory
    shift = joint.shifts[number]
    owner = np.repeat(np.arange(len(joint.drives)), [len(d.control) for d in joint.drives])
    rows = owner == number
    correction, chainage = _cut(estimate.correction, trajectory, shift)
    names = set(joint.drives[number].control.name)
    screening = replace(
        estimate.screening,
        outliers=tuple(out for out in estimate.screening.outliers if out.name in names),
        tests=tuple(test for test in estimate.screening.tests if test.name in names),
    )
    adjustment = _adjustment(estimate.adjustment, rows[estimate.used], trajectory, shift)
    guards = guards_of(trajectory.scanned_passes, adjustment.observed, estimate.guards)
    return DriveEstimate(
        correction=correction,
        adjustment=adjustment,
        screening=screening,
        used=estimate.used[rows],
        left_out=estimate.left_out[rows],
        log_likelihood=estimate.log_likelihood,
        sigma0=estimate.sigma0,
        guards=guards,
        support=_support(estimate.support, trajectory, shift, chainage),
        notes=estimate.notes,
        ties=_ties(joint, estimate.ties, number),
        untied=note or estimate.untied,
    )


def _cut(correction, trajectory, shift):
    """Correction of a drive's epochs, and distance along the path before these (m)."""
    whole = correction.corrected
    first, last = np.searchsorted(whole.gps_time, trajectory.gps_time[[0, -1]] + shift)
    rows = slice(first, last + 1)
    increments = np.diff(whole.position[: first + 1], axis=0)
    chainage = float(np.linalg.norm(increments, axis=1).sum())
    times = {"gps_time": trajectory.gps_time, "session": trajectory.session}
    corrected = replace(whole.select(rows), **times)
    return Correction(trajectory, corrected, covariance=correction.covariance[rows]), chainage


def _adjustment(adjustment, rows, trajectory, shift):
    """Adjustment of a drive's own control points, in its own times."""
    targets = adjustment.targets
    if len(rows):
        targets = targets.select(rows)
    targets = replace(targets, gps_time=targets.gps_time - shift)
    errors = PosErrors.stated(trajectory, adjustment.errors.pos)
    return replace(adjustment, errors=errors, factors=(targets,))


def _ties(joint, residuals, number):
    """TieResiduals of a drive's own passes, in its own times; None without any."""
    if residuals is None:
        return None
    ties = residuals.ties
    rows = (joint.drive_numbers(ties.pass_number) == number).all(axis=1)
    if not rows.any():
        return None
    own = ties[rows]
    own = replace(
        own,
        gps_time=own.gps_time - joint.shifts[number],
        pass_number=own.pass_number - joint.bases[number],
    )
    return TieResiduals(own, residuals.used[rows], residuals.after[rows])


def _support(support, trajectory, shift, chainage):
    """Support of a drive, in its own times and along its own path."""
    first, last = trajectory.gps_time[[0, -1]]

    def inside(start, end):
        return end - shift >= first and start - shift <= last

    return Support(
        tuple(
            replace(
                interval,
                start=interval.start - shift,
                end=interval.end - shift,
                chainage=interval.chainage - chainage,
            )
            for interval in support.weak
            if inside(interval.start, interval.end)
        ),
        tuple((start - shift, end - shift) for start, end in support.outages if inside(start, end)),
        tuple(step - shift for step in support.steps if inside(step, step)),
    )
