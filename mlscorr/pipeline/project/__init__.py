"""Many drives as one project: tasks for single files, joined by small data."""

from mlscorr.pipeline.project.checking import check_project
from mlscorr.pipeline.project.correction import Options, check_project_output, correct_project
from mlscorr.pipeline.project.engine import check_engine
from mlscorr.pipeline.project.status import project_status
from mlscorr.pipeline.project.wording import progress_sentence
