"""``correct``: from a survey to corrected clouds, trajectory and report.

It consists of its stages: find targets, match them, estimate the POS error.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from mlscorr.estimate import (
    SETTINGS,
    Estimate,
    check_order,
)
from mlscorr.evaluate import datum_differences, unseen_rows
from mlscorr.pipeline.control_checks import check_control, reuse_warnings
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.estimation import estimate_pos_error
from mlscorr.pipeline.exclusion import (
    inclusion_warnings,
    marked_excluded,
    weighed_exclusions,
)
from mlscorr.pipeline.finding import (
    MATCHING,
    MatchedTargets,
    check_found_control,
    find_targets,
    match_if_any,
    match_targets,
    silent,
)
from mlscorr.survey import Matched, Survey, TieFeatures, check_survey

TieUse = Literal["auto", "off", "only"]

NOTHING_TIED = (
    "No two passes of {} overlap, so ties alone can't correct them. Drive the road twice, or "
    "survey control points."
)


def correct(
    survey: Survey,
    order: int = SETTINGS.order,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: TieUse | None = None,
    pdf: bool = False,
) -> CorrectedSurvey:
    """Find the targets of a survey and estimate the POS error from its control points.

    Planes, poles and paint in overlaps of passes are used as ties, if there are any.

    Parameters
    ----------
    survey : Survey
    order : int
        Order of the polynomial trend of the position error.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : str, optional
        ``auto`` to use overlaps, ``off``, or ``only``: control points then become check points, and
        the passes are aligned to the positions of the POS. By default as stated in survey.toml.
    pdf : bool
        True if ``write`` of the result makes certificate.pdf by default.

    Returns
    -------
    CorrectedSurvey
        Check points are not used.

    Raises
    ------
    ValueError
        If no target is found or matched, the use of ties or the order is invalid, or only ties are
        used and there are none.

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

    matches, features = observe_survey(survey, ties, rng, progress)
    estimate = estimate_pos_error(survey, matches, features, order, progress)
    if ties == "only" and estimate.ties is None:
        raise ValueError(f"{NOTHING_TIED.format(survey.path)} {estimate.untied}")

    result = CorrectedSurvey(
        **corrected_fields(
            matches.as_scanned(survey), matches.control, matches.check, matches, estimate
        ),
        exclusions=weighed_exclusions(survey, matches, features, order, estimate, progress),
        pdf=pdf,
    )
    datum = (difference.sentence for difference in result.datum)
    # those of the targets were reported with the matches
    own = (*control_warnings(survey, matches), *inclusion_warnings(survey, estimate))
    for sentence in (*own, *datum, *estimate.warnings):
        warnings.warn(sentence, stacklevel=2)
    return result


def tie_use(survey: Survey, ties: TieUse | None) -> TieUse:
    """Use of ties, by default as stated in survey.toml.

    Parameters
    ----------
    survey : Survey
    ties : str or None
        See ``correct``.

    Raises
    ------
    ValueError
        If the use is unknown.
    """
    if ties is None:
        if survey.use_ties:
            return "auto"
        return "off"
    if ties not in get_args(TieUse):
        known = ", ".join(map(repr, get_args(TieUse)))
        raise ValueError(f"ties = {ties!r} is invalid: give one of {known}, or None.")
    return ties


def without_control(survey: Survey) -> Survey:
    """Return the survey with all its surveyed points as check points.

    Parameters
    ----------
    survey : Survey
    """
    nothing = survey.control[[]]
    return replace(survey, control=nothing, check=survey.surveyed, excluded=nothing, included=())


def observe_survey(
    survey: Survey,
    ties: TieUse,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
) -> tuple[MatchedTargets, TieFeatures | None]:
    """Read a survey's clouds once, for its targets and for possible tie features.

    Parameters
    ----------
    survey : Survey
    ties : str
        ``only``: no control point is needed.
    rng, progress
        See ``find_targets``.

    Returns
    -------
    matches : MatchedTargets
        With at least one control point, unless only ties are used.
    features : TieFeatures or None
        None if ties are off.

    Raises
    ------
    ValueError
        If no target is found or matched, or no control point among them.
    """
    if ties != "only":
        check_control(survey)
    targets = find_targets(survey, rng, progress, with_ties=ties != "off")
    (progress or silent)(MATCHING)
    if ties == "only":
        matches, _ = match_if_any(targets, survey)
    else:
        matches = match_targets(targets, survey)
        check_found_control(matches)
    return matches, targets.features


def corrected_fields(
    survey: Survey, control: Matched, check: Matched, matches: MatchedTargets, estimate: Estimate
) -> dict[str, Any]:
    """Fields of a CorrectedSurvey.

    Parameters
    ----------
    survey : Survey
    control, check : Matched
    matches : MatchedTargets
        Matches of these points.
    estimate : Estimate
        Estimate from the control points.
    """
    used = control[estimate.used]
    return {
        "survey": survey,
        "estimate": estimate,
        "matched_control": control,
        "matched_check": check,
        "missing": marked_excluded(
            unseen_rows(survey, matches.matches.refusals, matches.candidates, matches.scanned),
            survey,
        ),
        "fitted": matches.fitted,
        "warnings": (
            *matches.warnings,
            *control_warnings(survey, matches),
            *inclusion_warnings(survey, estimate),
        ),
        "datum": datum_differences(used, survey.trajectory, survey.pos, survey.crs),
        "excluded": matches.kept_out,
    }


def control_warnings(survey: Survey, matches: MatchedTargets) -> tuple[str, ...]:
    """Warnings on control points without a cloud, or used in an earlier correction.

    Parameters
    ----------
    survey : Survey
    matches : MatchedTargets
    """
    return (*matches.uncovered, *reuse_warnings(survey))
