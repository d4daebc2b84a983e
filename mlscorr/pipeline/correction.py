"""``correct``: from a survey to corrected clouds, trajectory and report."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from mlscorr.estimate import SETTINGS, Estimate
from mlscorr.evaluate import datum_differences, unseen_rows
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.finding import Finding
from mlscorr.pipeline.near_points import reuse_warnings
from mlscorr.pipeline.tying import TieUse, estimate_survey
from mlscorr.survey import Matched, Survey, check_survey


def correct(
    survey: Survey,
    order: int = SETTINGS.order,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: TieUse | None = None,
) -> CorrectedSurvey:
    """Find the targets of a survey and estimate the POS error from its control points.

    Planes, poles and paint that two passes both saw hold the passes together, where there are any.

    Parameters
    ----------
    survey : Survey
    order : int
        Of the polynomial trend of the position error.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : str, optional
        ``auto`` where passes overlap, ``off``, or ``only``: then no control point takes part, all
        of them are check points, and the passes are brought together where the POS says they are.
        What survey.toml says by default.

    Returns
    -------
    CorrectedSurvey
        The check points take no part.

    Raises
    ------
    ValueError
        When no target is found or matched.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> result = mlscorr.correct(mlscorr.read_survey(folder))
    >>> max(result.check["after"]["rmse"]) < 0.03
    True
    """
    check_survey(survey)
    survey, control, check, finding, estimate = estimate_survey(survey, order, ties, rng, progress)
    result = CorrectedSurvey(**corrected_fields(survey, control, check, finding, estimate))
    datum = (difference.sentence for difference in result.datum)
    # those of the finding were given when it was made
    for sentence in (*control_warnings(survey, finding), *datum, *estimate.warnings):
        warnings.warn(sentence, stacklevel=2)
    return result


def corrected_fields(
    survey: Survey, control: Matched, check: Matched, finding: Finding, estimate: Estimate
) -> dict[str, Any]:
    """Fields of a CorrectedSurvey.

    Parameters
    ----------
    survey : Survey
    control, check : Matched
    finding : Finding
        Of which these are.
    estimate : Estimate
        By the control points.
    """
    used = control[estimate.used]
    return {
        "survey": survey,
        "estimate": estimate,
        "matched_control": control,
        "matched_check": check,
        "missing": unseen_rows(
            survey, finding.matches.refusals, finding.candidates, finding.scanned
        ),
        "fitted": finding.fitted,
        "warnings": (*finding.warnings, *control_warnings(survey, finding)),
        "datum": datum_differences(used, survey.trajectory, survey.pos, survey.crs),
    }


def control_warnings(survey: Survey, finding: Finding) -> tuple[str, ...]:
    """Warnings on control points that no cloud covers, or that corrected the survey before.

    Parameters
    ----------
    survey : Survey
    finding : Finding
    """
    return (*finding.uncovered, *reuse_warnings(survey))
