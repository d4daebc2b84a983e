"""A made-up report on a drive there and back with ties, under the true correction."""

from dataclasses import replace

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import tie_residual_section
from mlscorr.survey import Trajectory
from tests.beds.reports import fabricate
from tests.beds.tied_passes import tied_passes


def tied_report(wrong=0.0, sufficient=3):
    """Survey, true Correction, CorrectionReport and TieResiduals; a share of the ties is wrong by
    up to 0.5 m and not used.
    """
    drive = tied_passes(1, wrong=wrong)
    recorded = drive.trajectory
    place = recorded.position + drive.error
    sigma = np.full((len(recorded), 3), 0.01)
    true = Trajectory(recorded.gps_time, place, recorded.attitude, sigma, sigma / 50)
    correction = Correction(recorded, true)
    every = TieResiduals.of(drive.ties, np.ones(len(drive.ties), bool), correction)
    residuals = replace(every, used=np.abs(every.after) < 0.03)
    survey, _, report = fabricate(recorded)
    return survey, correction, replace(report, ties=section(residuals, sufficient)), residuals


def section(residuals, sufficient=3):
    "The section of report.json on ties; a fifth of what is known comes from control points"
    return {
        **tie_residual_section(residuals),
        "share": {"control": 0.2, "plane": 0.8, "pole": 0.0},
        "sufficient_control": sufficient,
    }
