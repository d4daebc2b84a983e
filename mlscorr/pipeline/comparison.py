"""``compare``: every method on the same control and check points."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from mlscorr.baselines import Undetermined
from mlscorr.evaluate import Statistics, TargetRow, misclosures, surveyed_rows, unseen_rows
from mlscorr.io.store import document
from mlscorr.pipeline._result import Reported, ResultFiles
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.control_checks import reuse_warnings
from mlscorr.pipeline.correction import observe_survey, tie_use
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.methods import METHODS, Observed, load_open3d, method_named
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import Matched, Summary, Survey, check_survey, rows_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

ROW_LISTS = ("warnings", "details")  # of a method's row: not numeric


@dataclass(frozen=True, repr=False)
class ComparedSurvey(Summary):
    """Rows of compare.json for all methods, their corrections by name, and ``write``.

    Parameters
    ----------
    survey : Survey
    matched_control, matched_check : Matched
    rows : tuple of dict
        Rows of ``methods`` in compare.json.
    corrections : dict
        Objects with ``apply(cloud)``, by name of the method.
    groups : int
        Number of cross-validation groups, zero without cross-validation.
    missing : list of TargetRow
        Surveyed points without an observation.
    """

    survey: Survey
    matched_control: Matched
    matched_check: Matched
    rows: tuple[dict, ...]
    corrections: dict
    groups: int
    missing: list[TargetRow] = field(default_factory=list)

    def row(self, name: str) -> dict:
        """Return the row of one method."""
        return next(row for row in self.rows if row["name"] == name)

    @property
    def scored_by(self) -> str:
        """Role by which the methods are ranked, one of check, cross_validated and control."""
        if "cross_validated" in self.rows[0] and self.groups:
            return "cross_validated"
        if len(self.matched_check):
            return "check"
        return "control"

    @cached_property
    def document(self) -> dict:
        """Document of compare.json, without the files."""
        from mlscorr.report import comparison_screen

        content = {
            "name": self.survey.name,
            "crs": self.survey.crs,
            "misclosure": "surveyed - observed, m",
            "control_points": len(set(self.matched_control.name)),
            "check_points": len(set(self.matched_check.name)),
            "scored_by": self.scored_by,
            "cross_validation_groups": self.groups,
            "methods": list(self.rows),
            "unseen": [{"name": row.name, "why": row.reason} for row in self.missing],
        }
        matched = self.matched_control, self.matched_check
        rows = surveyed_rows(*matched, self.corrections["raw"], ()) + self.missing
        return document("compare", comparison_screen(content, rows) | content)

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row of statistics for each method; requires pandas."""
        rows = ({k: v for k, v in row.items() if k not in ROW_LISTS} for row in self.rows)
        return rows_frame(rows)

    def plot(self) -> Figure:
        """Plot the RMSE of every method on each axis, the best at the top."""
        from mlscorr.report import comparison_figure

        return comparison_figure(self.document)

    def _overview(self):
        """Return the rows that a notebook shows."""
        rows = []
        for row in self.rows:
            rmse = row[self.scored_by]["rmse"] or [np.nan] * 3
            rows.append((row["name"], *(f"{value:.3f}" for value in rmse), row["why"] or ""))
        title = f"{self.survey.name}: RMSE in m ({self.scored_by.replace('_', '-')})"
        return [(title,), ("method", "east", "north", "height", ""), *rows]

    def write(
        self,
        out: str | Path,
        clouds: Sequence[str] = (),
        overwrite: bool = False,
        progress: Callable | None = None,
    ) -> dict:
        """Write compare.json and compare.html, and the clouds corrected by some methods.

        Parameters
        ----------
        out : path
            Folder, written atomically.
        clouds : sequence of str
            Names of methods, each with a folder for its clouds.

        Returns
        -------
        dict
            The document. Its ``files`` list the output, with the points outside the trajectory,
            which time-dependent methods do not change.

        Raises
        ------
        ValueError
            If a method is unknown or undetermined, or the folder contains an input, or anything
            without overwrite.
        OSError
            If writing fails.
        """
        from mlscorr.report import write_comparison

        for name in clouds:
            why = self.row(method_named(name).name)["why"]
            if why is not None:
                raise ValueError(f"The method {name} has no cloud to write: {why}")
        pages = {"compare.html": write_comparison}
        files = ResultFiles(
            "compare",
            self.survey.inputs,
            lambda written: Reported(self.document | {"files": written.clouds}, pages),
        )
        return files.write(
            out,
            overwrite,
            lambda folder: self._write_clouds(folder, clouds, progress or silent),
            clouds,
        )

    def _write_clouds(self, folder, names, progress):
        """Write the clouds, and return rows on the files."""
        if names:
            done = progress("Writing the clouds", self.survey.points * len(names))
        else:
            done = None
        files = []
        for name in names:
            (folder / name).mkdir()
            clouds = write_clouds(self.survey, folder / name, self.corrections[name], done)
            files += [
                {"method": name, "name": f"{name}/{path.name}", "points": points}
                | {"points_outside_trajectory": outside}
                for path, points, outside in clouds
            ]
        return files


def compare(
    survey: Survey, rng: np.random.Generator | None = None, progress: Callable | None = None
) -> ComparedSurvey:
    """Correct a survey by every method, each fitted only to the same control points.

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
        The row of a method that the control points do not determine has the reason.

    Raises
    ------
    ValueError
        If no target is found or matched, or no control point among them.

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
    matches, features = observe_survey(survey, tie_use(survey, None), rng, progress)
    survey = matches.as_scanned(survey)
    control = matches.control
    check = matches.check
    for sentence in reuse_warnings(survey):
        warnings.warn(sentence, stacklevel=2)
    observed = Observed(survey, matches.candidates, features)
    stage = progress or silent
    stage("Loading Open3D")
    load_open3d()  # takes seconds, which are not the method's
    is_few = len(set(check.name)) < SETTINGS.sufficient_check_points
    groups = _groups(control) if is_few else []
    done = stage("Fitting all methods", len(METHODS) * (1 + len(groups)))
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
        missing=unseen_rows(survey, matches.matches.refusals, matches.candidates, matches.scanned),
    )


def _row(method, observed, control, check):
    """Row of a method in compare.json, and its correction or None."""
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
    """Correction or None, details, reason for None, and seconds."""
    start = perf_counter()
    try:
        correction, details = method.fit(observed, matched)
    except Undetermined as problem:
        return None, {}, str(problem), None
    return correction, details, None, perf_counter() - start


def _score(matched, correction):
    """Number and statistics of the misclosures; None without a correction."""
    return _statistics(misclosures(matched, correction), correction is not None)


def _statistics(residuals, determined):
    """Number and statistics of residuals, None if meaningless."""
    known = residuals if determined else residuals[:0]
    return {"n": len(residuals), **Statistics.of(known).document()}


def _groups(control):
    """Names of control points to omit together: one by one, or five groups spread in time."""
    names = list(dict.fromkeys(control.name[i] for i in np.argsort(control.gps_time)))
    if len(names) <= SETTINGS.single_points:
        number = len(names)
    else:
        number = SETTINGS.groups
    if len(names) > 1:
        return [set(names[i::number]) for i in range(number)]
    return []


def _cross_validated(method, observed, control, groups, of_check, done):
    """Number and statistics over all points: each control point corrected by the others, each
    check point by all control points. Without groups there is no validation.
    """
    parts = [of_check]
    why = None
    for group in groups:
        left_out = np.array([name in group for name in control.name])
        with warnings.catch_warnings(action="ignore"):  # reported for the fit to all control points
            correction, _, problem, _ = _fitted(method, observed, control[~left_out])
        done(1)
        if correction is None:
            why = f"Without {', '.join(sorted(group))}: {problem}"
        else:
            parts.append(misclosures(control[left_out], correction))
    return {**_statistics(np.vstack(parts), why is None and bool(groups)), "why": why}
