"""Trajectories from SBET, TRJ, POF, POQ, CSV and foreign tables, and to CSV, SBET and TUM.

- trajectory, trajectory_sessions: one file, and several joined in time
- sbet, pof, trj, trajectory_tables, poses, trajectory_exports: the formats, read and written
- features: points and lines for a GIS, GeoPackage and GeoJSON
- conventions, course, projection: attitudes and positions converted to the map
- time_systems: the constant between the times of cloud and trajectory
"""

from mlscorr.io.trajectories.conventions import QUATERNION, SessionSection, TrajectorySection
from mlscorr.io.trajectories.pof import POF_SUFFIX, POQ_SUFFIX
from mlscorr.io.trajectories.poses import (
    PosErrorSeries,
    read_pos_error_series,
    read_poses,
    utm_zone,
)
from mlscorr.io.trajectories.projection import (
    MapFactors,
    check_crs,
    crs_code,
    crs_name,
    map_factors,
    map_of,
)
from mlscorr.io.trajectories.sbet import SBET_FIELDS, SMRMSG_FIELDS
from mlscorr.io.trajectories.time_systems import (
    ADJUSTMENT,
    DAY,
    NO_TIMES,
    PLACEHOLDERS,
    WEEK,
    TimeMatch,
    count_on,
    gps_epoch,
    lacks_time,
    listed_times,
    match_times,
    utc_lag,
)
from mlscorr.io.trajectories.trajectory import read_trajectory, write_trajectory_csv
from mlscorr.io.trajectories.trajectory_exports import (
    check_distinct,
    check_exports,
    check_target_exports,
    export_targets,
    export_trajectory,
    write_weak,
)
from mlscorr.io.trajectories.trajectory_sessions import (
    SessionFile,
    Sessions,
    across_week_end,
    check_systems,
    join_sessions,
    read_sessions,
    with_sigmas,
)
from mlscorr.io.trajectories.trajectory_tables import (
    COLUMNS,
    POSITION_SUFFIX,
    position_file,
    tum_columns,
)
