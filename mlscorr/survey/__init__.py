"""Data types of a survey: what was recorded, as frozen values.

float64, SI units, radians inside; map axes E, N, H; body axes X right, Y forward, Z up.
"""

from mlscorr.survey._angles import angles_from_attitude, attitude_from_angles
from mlscorr.survey._interchange import as_cloud, box_distance, copied_las, geometry_pair, is_las
from mlscorr.survey._open3d import (
    chosen_origin,
    geometry_columns,
    is_geometry,
    line_geometry,
    map_places,
)
from mlscorr.survey.clouds import (
    COORDINATE_ROUNDING,
    NOISE_CLASSES,
    WEEK,
    CloudFile,
    CloudInMemory,
    Correcting,
    PointCloud,
    counted_on,
)
from mlscorr.survey.columns import AXES, Columns, columns_frame, rows_frame
from mlscorr.survey.recording import (
    SEARCH_RADIUS,
    Assumption,
    InputFile,
    MountedScanner,
    Pos,
    ProjectNames,
    Scanner,
    Survey,
    SurveyFileError,
    check_rng,
    check_survey,
    choosing,
)
from mlscorr.survey.statement import Severity, Statement, Wording
from mlscorr.survey.summary import Summary
from mlscorr.survey.targets import KINDS, ControlPoints, Matched, TargetObservations
from mlscorr.survey.ties import PAINTED, PAUSE, TIE_KINDS, TieFeatures, Ties, time_spans
from mlscorr.survey.trajectory import GAP_FACTOR, SAME_EPOCH, Mounting, Trajectory, control_epochs
