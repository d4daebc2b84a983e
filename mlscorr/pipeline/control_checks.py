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
            f"{survey.path} has no control points: it has no [control], or the file given there "
            "is empty. A correction needs surveyed points, or overlapping passes with "
            "--ties-only; mlscorr extract lists targets of a cloud without any."
        )
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} has {counted(len(survey.check), 'check point')} and no control "
            "point, and check points are never used in an estimate. Give some of them the role "
            "control, or align overlapping passes without any: mlscorr correct --ties-only."
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
            f"{len(names)} of {len(survey.control)} control points (first: {names[0]}) were "
            f"already used to correct the trajectory of {survey.path} (calibrate --with-drift), "
            "so that sigmas and leave-one-out residuals are too small. Judge the result by "
            "check points only, or correct the survey that calibrate --clouds writes without "
            "--with-drift."
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
        f"The clouds of {survey.path} use the recorded mounting, not its calibrated one ([cloud] "
        "mounting). A correction would treat the difference as drift: use the survey written by "
        "mlscorr calibrate --clouds, or remove that line if the clouds were georeferenced again "
        "since."
    )
