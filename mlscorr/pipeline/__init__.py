"""The story from files to files, one module a command."""

from mlscorr.pipeline.calibration import CalibratedSurvey, calibrate
from mlscorr.pipeline.checking import CheckedSurvey, check
from mlscorr.pipeline.comparison import ComparedSurvey, compare
from mlscorr.pipeline.correction import CorrectedSurvey, correct
from mlscorr.pipeline.diagnosis import DiagnosedSurvey, diagnose
from mlscorr.pipeline.extraction import ExtractedSurvey, extract
from mlscorr.pipeline.planning import PlannedSurvey, plan
from mlscorr.pipeline.simulation import demo, simulate_survey
from mlscorr.pipeline.starting import StartedSurvey, init
from mlscorr.pipeline.ties import TiedSurvey, find_ties
