"""Checks of required control, and of control and a mounting that were used before."""

from collections.abc import Iterator

from mlscorr.io.surveys import ProjectParts
from mlscorr.survey import Survey, SurveyFileError
from mlscorr.wording import counted


def check_control(survey: Survey | ProjectParts) -> None:
    """Refuse a survey or project without control points.

    Parameters
    ----------
    survey : Survey or ProjectParts

    Raises
    ------
    ValueError
        A SurveyFileError if no list of them is given.
    """
    if len(survey.control) == len(survey.check) == 0:
        is_named = any(file.what == "control" for file in survey.inputs)
        kind: type[ValueError] = SurveyFileError
        if is_named:
            kind = ValueError
        raise kind(
            f"{survey.path} gives no control points: it has no section [control], or the file "
            "named there is empty. A correction needs surveyed points, or passes that overlap with "
            "--ties-only; mlscorr extract lists the targets of a cloud without them."
        )
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} names {counted(len(survey.check), 'check point')} and no control "
            "point: check points never enter an estimate. Give some of them the role control, or "
            "bring passes that overlap together without any: mlscorr correct --ties-only."
        )


def reuse_warnings(survey: Survey) -> Iterator[str]:
    """Yield sentences on control points and a mounting used in an earlier correction.

    Parameters
    ----------
    survey : Survey
    """
    yield from filter(None, [remounting_fault(survey)])
    names = [name for name in survey.control.name if name in survey.corrected_by]
    if names:
        yield (
            f"{len(names)} of {len(survey.control)} control points (first: {names[0]}) have "
            f"corrected the trajectory of {survey.path} before (calibrate --with-drift), and count "
            "twice: sigmas, and what remains at points left out in turn, are too small. Check "
            "points alone can judge the result. Give calibrate --clouds without --with-drift and "
            "correct that survey, or other control points."
        )


def remounting_fault(survey: Survey) -> str:
    """Sentence if the clouds match another mounting than the stated one, otherwise empty.

    Parameters
    ----------
    survey : Survey
    """
    if not survey.is_remounted:
        return ""
    return (
        f"The clouds of {survey.path} are still as the recorded mounting put them, not as its "
        "calibrated one does ([cloud] mounting): a correction takes the difference for drift, and "
        "a further calibration would count it twice. Run mlscorr calibrate --clouds on the survey "
        "before, and take what that writes; where the clouds were georeferenced anew since, remove "
        "that line."
    )
