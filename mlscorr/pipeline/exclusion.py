"""Control points that the user excludes from or includes in an estimate, and the effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import Estimate
from mlscorr.evaluate import TargetRow, misclosures, target_rows
from mlscorr.pipeline.estimation import check_score, estimate_together
from mlscorr.pipeline.finding import MatchedTargets, silent
from mlscorr.pipeline.wording import CHOICES
from mlscorr.survey import Matched, Statement, Survey, TieFeatures

EXCLUDED = Statement("not matched", values={"why": "excluded by the user"})


@dataclass(frozen=True)
class Exclusion:
    """Effect of an excluded control point on the result if it were used.

    Parameters
    ----------
    name : str
    residual : float
        Length of its residual after the correction by the other points, the largest of all passes.
        Units: m.
    by : str
        Basis: ``check points``, or ``leave-one-out`` of the control points without any.
    with_point, without_point : float
        3D RMSE at these with and without the point in the estimate. Units: m.
    """

    name: str
    residual: float
    by: str
    with_point: float
    without_point: float

    @property
    def statement(self) -> Statement:
        """Name, residual and both accuracies."""
        return Statement("excluded", values=vars(self))

    @property
    def sentence(self) -> str:
        """The statement in words."""
        return self.statement.sentence(CHOICES)

    def document(self) -> dict[str, str | float]:
        """Return the row of ``exclusions[]`` in report.json."""
        return {**vars(self), "sentence": self.sentence}


def excluded_rows(excluded: Matched, correction: Correction) -> list[TargetRow]:
    """Rows of excluded control points, whose residuals are leave-one-out by nature.

    Parameters
    ----------
    excluded : Matched
    correction : Correction
        Correction from the other control points.
    """
    if len(excluded) == 0:
        return []
    left_out = misclosures(excluded, correction)
    reasons = [EXCLUDED] * len(excluded)
    return target_rows(excluded, correction, "control", reasons, left_out)


def marked_excluded(rows: list[TargetRow], survey: Survey) -> list[TargetRow]:
    """Mark rows without an observation as excluded, so that they do not count as missing.

    Parameters
    ----------
    rows : list of TargetRow
    survey : Survey
    """
    return [
        replace(row, why=EXCLUDED, scanned=False) if row.name in survey.excluded.name else row
        for row in rows
    ]


def weighed_exclusions(
    survey: Survey,
    matches: MatchedTargets,
    features: TieFeatures | None,
    order: int,
    estimate: Estimate,
    progress: Callable | None = None,
) -> tuple[Exclusion, ...]:
    """Compute the effect of each excluded point by repeating the estimate with it.

    Parameters
    ----------
    survey : Survey
    matches : MatchedTargets
    features : TieFeatures or None
        Features used in the estimate.
    order : int
        Order of its trend.
    estimate : Estimate
        Estimate without the points.
    progress : function, optional
        ``progress(title)`` is called at the start of a stage.
    """
    excluded = matches.kept_out
    rows = []
    for name in dict.fromkeys(excluded.name):
        (progress or silent)(f"Estimating with {name}, to see what its exclusion does")
        point = excluded[np.array(excluded.name, dtype=object) == name]
        control = Matched.concatenate([matches.control, point])
        scanned = replace(
            matches.as_scanned(survey),
            control=survey.control + point.surveyed[:1],
            included=(*survey.included, name),
        )
        with_point = estimate_together(scanned, control, features, order)
        by, before = _judged(with_point, control, matches.check, name)
        _, after = _judged(estimate, matches.control, matches.check, name)
        residual = np.linalg.norm(misclosures(point, estimate.correction), axis=1).max()
        rows.append(Exclusion(name, float(residual), by, before, after))
    return tuple(rows)


def _judged(estimate, control, check, name):
    """Basis of an estimate's score, and its 3D RMSE (m), without the point itself."""
    if len(check):
        return "check points", float(check_score(estimate, check).after.rmse[4])
    is_other = np.array(control.name, dtype=object) != name
    left = estimate.left_out[estimate.used & is_other]
    rmse = np.sqrt(np.mean(np.sum(left**2, axis=1)))
    return "leave-one-out of the other control points", float(rmse)


def inclusion_warnings(survey: Survey, estimate: Estimate) -> tuple[str, ...]:
    """Sentences on points used at the user's request but contradicted by the others.

    Parameters
    ----------
    survey : Survey
    estimate : Estimate
    """
    sentences = []
    for test in estimate.tests:
        if test.name in survey.included and test.excess > 1.0:
            values = {"name": test.name, "statistic": test.statistic, "critical": test.critical}
            statement = Statement("included, contradicted", "warning", values)
            sentences.append(statement.sentence(CHOICES))
    return tuple(sentences)
