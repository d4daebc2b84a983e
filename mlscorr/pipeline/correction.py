"""``correct``: from a survey to corrected clouds, trajectory and report."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.estimate import (
    SETTINGS,
    Estimate,
    believed_correction,
    check_order,
    estimate_correction,
    find_mounting_error,
    mounting_warnings,
    scanner_warnings,
)
from mlscorr.evaluate import datum_differences, unseen_rows
from mlscorr.pipeline.control_checks import reuse_warnings
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.finding import Finding, find_control, find_or_compare_surfaces, read_into
from mlscorr.survey import Matched, Survey, TieFeatures, check_survey
from mlscorr.ties import TieCollector, tie_passes

TieUse = Literal["auto", "off", "only"]

NOTHING_TIED = (
    "No two passes of {} saw the same thing, so ties alone correct nothing. Drive the street "
    "twice, or survey control points."
)
LEFT_OUT = (
    'What two passes both saw was left out, as asked: --no-ties, or use = "off" of [ties] in '
    "survey.toml."
)


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
        When no target is found or matched, for another use of ties, an order that is none, and
        where ties alone are asked for and there is none.

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
    ties = tie_use(survey, ties)
    check_order(order)
    if ties == "only":
        survey = without_control(survey)

    survey, finding, features = observe_survey(survey, ties, rng, progress)
    control, check = finding.matches.by_role(survey)
    estimate = estimate_together(survey, control, features, order)
    if ties == "only" and estimate.ties is None:
        raise ValueError(f"{NOTHING_TIED.format(survey.path)} {estimate.untied}")

    result = CorrectedSurvey(**corrected_fields(survey, control, check, finding, estimate))
    datum = (difference.sentence for difference in result.datum)
    # those of the finding were given when it was made
    for sentence in (*control_warnings(survey, finding), *datum, *estimate.warnings):
        warnings.warn(sentence, stacklevel=2)
    return result


def tie_use(survey: Survey, ties: TieUse | None) -> TieUse:
    """Use of ties that is asked for; what survey.toml states where nothing is.

    Parameters
    ----------
    survey : Survey
    ties : str or None
        As of ``correct``.

    Raises
    ------
    ValueError
        For another use than there is.
    """
    if ties is None:
        if survey.use_ties:
            return "auto"
        return "off"
    if ties not in get_args(TieUse):
        known = ", ".join(map(repr, get_args(TieUse)))
        raise ValueError(f"ties = {ties!r} is no use of ties: give one of {known}, or None.")
    return ties


def without_control(survey: Survey) -> Survey:
    """The survey with all its surveyed points as check points.

    Parameters
    ----------
    survey : Survey
    """
    return replace(survey, control=survey.control[[]], check=survey.surveyed)


def observe_survey(
    survey: Survey,
    ties: TieUse,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
) -> tuple[Survey, Finding, TieFeatures | None]:
    """Read a survey's clouds once, for its targets and for the features that may tie its passes.

    Parameters
    ----------
    survey : Survey
    ties : str
        ``only``: no control point is needed.
    rng, progress
        As of ``find_targets``.

    Returns
    -------
    survey : Survey
        Its trajectory knows the seconds in which points lie.
    finding : Finding
        With a control point at least, but where ties alone are asked for.
    features : TieFeatures or None
        None where ties are off.

    Raises
    ------
    ValueError
        As ``find_control``.
    """
    collector = TieCollector(survey)
    if ties == "off":
        finding = find_control(survey, rng, progress)
        features = None
    elif ties == "auto":
        finding = find_control(survey, rng, progress, read_into(collector.add))
        features = collector.features()
    else:
        read = read_into(collector.add)
        finding, _ = find_or_compare_surfaces(survey, read, None, progress)
        features = collector.features()
    trajectory = survey.trajectory.scanned_at(finding.candidates.seconds)
    return replace(survey, trajectory=trajectory), finding, features


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads, other last digits
def estimate_together(
    survey: Survey, control: Matched, features: TieFeatures | None, order: int
) -> Estimate:
    """The POS error by matched control points, and by what two passes both saw.

    Parameters
    ----------
    survey : Survey
    control : Matched
        Without any, ties alone bring passes together where the POS says that they are.
    features : TieFeatures or None
        None where ties are left out.
    order : int
        Of the trend.
    """
    if len(control):
        estimate = estimate_correction(survey.trajectory, control, survey.pos, order)
    else:
        estimate = believed_correction(survey.trajectory, survey.pos)
    if features is None:
        return replace(estimate, untied=LEFT_OUT)
    estimate = tie_passes(survey, estimate, features)
    wrong = ()  # of mountings, where the ties tell of it
    if estimate.equations.mounting is not None:
        wrong = tuple(scanner_warnings(estimate, list(survey.by_scanner)))
    if not wrong and None not in survey.mountings:  # all of them may be wrong alike
        error = find_mounting_error(estimate, control, survey.mountings)
        wrong = mounting_warnings(error, len(survey.mountings))
    return replace(estimate, notes=(*estimate.notes, *wrong))


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
