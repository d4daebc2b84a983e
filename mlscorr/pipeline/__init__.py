"""The story from files to files, one module a command."""

from mlscorr.pipeline.applying import AppliedSurvey, apply
from mlscorr.pipeline.calibration import CalibratedScanners, CalibratedSurvey, calibrate
from mlscorr.pipeline.checking import CheckedSurvey, check
from mlscorr.pipeline.compared_survey import ComparedSurvey
from mlscorr.pipeline.comparison import compare
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.correction import correct
from mlscorr.pipeline.diagnosis import DiagnosedSurvey, diagnose
from mlscorr.pipeline.extraction import ExtractedSurvey, extract
from mlscorr.pipeline.installation import Installation, doctor
from mlscorr.pipeline.planning import PlannedSurvey, plan
from mlscorr.pipeline.rendering import render
from mlscorr.pipeline.simulation import demo, simulate_survey
from mlscorr.pipeline.starting import StartedSurvey, init
from mlscorr.pipeline.ties import TiedSurvey, find_ties
