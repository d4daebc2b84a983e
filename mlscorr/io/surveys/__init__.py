"""survey.toml and project.toml, and all files they name, as one Survey or Project.

- survey_file, project_file: reading of all parts, with all faults in one error
- survey_sections: their sections and keys
- survey_paths, point_owners: paths of the files, and assignment of points
- survey_copy, folder_roles, simulated_clouds, crs_checks: survey.toml rewritten, found, checked
"""

from mlscorr.io.surveys.crs_checks import check_area, crs_notes
from mlscorr.io.surveys.folder_roles import SIMULATED, FileRole, sort_files
from mlscorr.io.surveys.point_owners import check_belongings, mounted_scanners
from mlscorr.io.surveys.project_file import (
    SHARED_TILES,
    DriveParts,
    ProjectParts,
    is_project,
    read_project,
    stated_project,
)
from mlscorr.io.surveys.simulated_clouds import simulated_survey
from mlscorr.io.surveys.survey_copy import mounting_values, write_survey_copy
from mlscorr.io.surveys.survey_file import (
    FILE_NAME,
    cloud_file,
    input_files,
    read_survey,
    read_survey_file,
    stated_pos,
    survey_toml,
)
from mlscorr.io.surveys.survey_paths import (
    check_distinct,
    check_sessions,
    files_of,
    given_file,
    matching,
    session_file,
)
from mlscorr.io.surveys.survey_sections import (
    MountingSection,
    PlannedSurveyFile,
    PosSection,
    ScannerSection,
    SurveyFile,
)
