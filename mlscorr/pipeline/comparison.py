"""``compare``: every method on the same control and check points."""

import warnings
from collections.abc import Callable
from time import perf_counter

import numpy as np

from mlscorr.baselines import Undetermined
from mlscorr.evaluate import Statistics, misclosures, unseen_rows
from mlscorr.pipeline.compared_survey import ComparedSurvey
from mlscorr.pipeline.control_checks import reuse_warnings
from mlscorr.pipeline.correction import observe_survey, tie_use
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.methods import METHODS, Observed, load_open3d
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import Survey, check_survey


def compare(
    survey: Survey, rng: np.random.Generator | None = None, progress: Callable | None = None
) -> ComparedSurvey:
    """Correct a survey by every method, each fitted to the same control points alone.

    Parameters
    ----------
    survey : Survey
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of how much was just done.

    Returns
    -------
    ComparedSurvey
        A method that the control points don't determine says why in its row.

    Raises
    ------
    ValueError
        When no target is found or matched, or no control point among them.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> compared = mlscorr.compare(mlscorr.read_survey(folder))
    >>> compared.row("lsc")["check"]["rmse_3d"] < compared.row("raw")["check"]["rmse_3d"]
    True
    """
    check_survey(survey)
    survey, finding, features = observe_survey(survey, tie_use(survey, None), rng, progress)
    control, check = finding.matches.by_role(survey)
    for sentence in reuse_warnings(survey):
        warnings.warn(sentence, stacklevel=2)
    observed = Observed(survey, finding.candidates, features)
    load_open3d()  # takes seconds, which are not the method's
    is_few = len(set(check.name)) < SETTINGS.sufficient_check_points
    groups = _groups(control) if is_few else []
    done = (progress or silent)("Fitting", len(METHODS) * (1 + len(groups)))
    rows = []
    corrections = {}
    for method in METHODS:
        row, correction = _row(method, observed, control, check)
        done(1)
        if is_few:
            left = misclosures(check, correction)
            row["cross_validated"] = _cross_validated(method, observed, control, groups, left, done)
        rows.append(row)
        if correction is not None:
            corrections[method.name] = correction
    from mlscorr.report import method_warnings

    for sentence in method_warnings(rows):
        warnings.warn(sentence, stacklevel=2)
    return ComparedSurvey(
        survey=survey,
        matched_control=control,
        matched_check=check,
        rows=tuple(rows),
        corrections=corrections,
        groups=len(groups),
        missing=unseen_rows(survey, finding.matches.refusals, finding.candidates, finding.scanned),
    )


def _row(method, observed, control, check):
    """A method's row of compare.json, and its correction or None."""
    with warnings.catch_warnings(record=True, action="always") as caught:
        correction, details, why, seconds = _fitted(method, observed, control)
    row = {
        "name": method.name,
        "kind": method.kind,
        "about": method.about,
        "status": "not determined" if correction is None else "determined",
        "why": why,
        "check": _score(check, correction),
        "control": _score(control, correction),
        "seconds": seconds,
        "warnings": [str(warning.message) for warning in caught],
        "details": details,
    }
    return row, correction


def _fitted(method, observed, matched):
    """Correction or None, details, why there is none, and seconds."""
    start = perf_counter()
    try:
        correction, details = method.fit(observed, matched)
    except Undetermined as problem:
        return None, {}, str(problem), None
    return correction, details, None, perf_counter() - start


def _score(matched, correction):
    """N and the statistics of the misclosures; None where there is no correction."""
    return _statistics(misclosures(matched, correction), correction is not None)


def _statistics(residuals, determined):
    """N and the statistics of residuals, None where they tell nothing."""
    known = residuals if determined else residuals[:0]
    return {"n": len(residuals), **Statistics.of(known).document()}


def _groups(control):
    """Names of control points to leave out together: one by one, or five groups spread in time."""
    names = list(dict.fromkeys(control.name[i] for i in np.argsort(control.gps_time)))
    if len(names) <= SETTINGS.single_points:
        number = len(names)
    else:
        number = SETTINGS.groups
    if len(names) > 1:
        return [set(names[i::number]) for i in range(number)]
    return []


def _cross_validated(method, observed, control, groups, of_check, done):
    """N and the statistics over all points: each control point as the others correct it, each
    check point as all control points do. Without any group there is nothing to validate.
    """
    parts = [of_check]
    why = None
    for group in groups:
        left_out = np.array([name in group for name in control.name])
        with warnings.catch_warnings(action="ignore"):  # told of the fit to all control points
            correction, _, problem, _ = _fitted(method, observed, control[~left_out])
        done(1)
        if correction is None:
            why = f"Without {', '.join(sorted(group))}: {problem}"
        else:
            parts.append(misclosures(control[left_out], correction))
    return {**_statistics(np.vstack(parts), why is None and bool(groups)), "why": why}
