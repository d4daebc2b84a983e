"""``compare``: every method on the same control and check points."""

import warnings
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from mlscorr.baselines import Undetermined
from mlscorr.evaluation import misclosures, statistics, unseen_rows
from mlscorr.io.las import write_corrected
from mlscorr.io.output import check_output, document, output_folder, write_json
from mlscorr.io.survey_file import input_files
from mlscorr.pipeline.finding import find_control, silent
from mlscorr.pipeline.methods import METHODS, load_open3d, method_named
from mlscorr.survey import Survey, TargetObservations

FEW = 5  # observed check points below which all points are cross-validated as well
SINGLY = 10  # control points up to which each is left out by itself; else in five groups
GROUPS = 5


def compare(survey, rng=None, progress=None):
    """Correct a survey by every method, each fitted to the same control points alone.

    Parameters
    ----------
    survey : Survey
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of how much was just done.

    Returns a ComparedSurvey. Raises ValueError when no target is found or matched, or no control
    point among them. A method that the control points don't determine says why in its row.

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
    control, check, finding = find_control(survey, rng, progress)
    candidates = finding.candidates
    load_open3d()  # takes seconds, which are not the method's
    is_few = len(set(check.name)) < FEW
    groups = _groups(control) if is_few else []
    done = (progress or silent)("Fitting", len(METHODS) * (1 + len(groups)))
    rows, corrections = [], {}
    for method in METHODS:
        row, correction = _row(method, survey, control, check, candidates)
        done(1)
        if is_few:
            left = misclosures(check, survey.check, correction)
            row["cross_validated"] = _cross_validated(
                method, survey, control, candidates, groups, left, done
            )
        rows.append(row)
        if correction is not None:
            corrections[method.name] = correction
    return ComparedSurvey(
        survey=survey,
        control_observations=control,
        check_observations=check,
        rows=tuple(rows),
        corrections=corrections,
        groups=len(groups),
        unseen=unseen_rows(survey, finding.matches.refusals, candidates),
    )


def _row(method, survey, control, check, candidates):
    """A method's row of compare.json, and its correction or None."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        correction, details, why, seconds = _fitted(method, survey, control, candidates)
    doubts = [str(warning.message) for warning in caught]
    for sentence in doubts:
        warnings.warn(f"{method.name}: {sentence}", stacklevel=3)
    row = {
        "name": method.name,
        "kind": method.kind,
        "about": method.about,
        "status": "not determined" if correction is None else "determined",
        "why": why,
        "check": _score(check, survey.check, correction),
        "control": _score(control, survey.control, correction),
        "seconds": seconds,
        "warnings": doubts,
        "details": details,
    }
    return row, correction


def _fitted(method, survey, observations, candidates):
    """Correction or None, details, why there is none, and seconds."""
    start = perf_counter()
    try:
        correction, details = method.fit(survey, observations, candidates)
    except Undetermined as problem:
        return None, {}, str(problem), None
    return correction, details, None, perf_counter() - start


def _score(observations, points, correction):
    """n and the statistics of the misclosures; None where there is no correction."""
    left = misclosures(observations, points, correction)
    return {"n": len(left), **statistics(left if correction is not None else left[:0])}


def _groups(control):
    """Names of control points to leave out together: one by one, or five groups spread in time."""
    names = list(dict.fromkeys(control.name[i] for i in np.argsort(control.gps_time)))
    number = len(names) if len(names) <= SINGLY else GROUPS
    return [set(names[i::number]) for i in range(number)] if len(names) > 1 else []


def _cross_validated(method, survey, control, candidates, groups, of_check, done):
    """n and the statistics over all points: each control point as the others correct it, each
    check point as all control points do. Without any group there is nothing to validate."""
    parts, why = [of_check], None
    for group in groups:
        left_out = np.array([name in group for name in control.name])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # told of the fit to all control points
            correction, _, problem, _ = _fitted(method, survey, control[~left_out], candidates)
        done(1)
        if correction is None:
            why = f"Without {', '.join(sorted(group))}: {problem}"
        else:
            parts.append(misclosures(control[left_out], survey.control, correction))
    left = np.vstack(parts)
    is_whole = why is None and bool(groups)
    return {"n": len(left), **statistics(left if is_whole else left[:0]), "why": why}


@dataclass(frozen=True)
class ComparedSurvey:
    """All methods' rows of compare.json, their corrections by name, and ``write``.

    ``unseen`` are the surveyed points without an observation; ``groups`` is how many times
    control points were left out, zero without cross-validation.
    """

    survey: Survey
    control_observations: TargetObservations
    check_observations: TargetObservations
    rows: tuple[dict, ...]
    corrections: dict
    groups: int
    unseen: list[dict] = field(default_factory=list)

    def row(self, name):
        """The row of one method."""
        return next(row for row in self.rows if row["name"] == name)

    @property
    def scored_by(self):
        """What the methods are ranked by: check, cross_validated, or the mere fit to control."""
        if "cross_validated" in self.rows[0] and self.groups:
            return "cross_validated"
        return "check" if len(self.check_observations) else "control"

    @property
    def document(self):
        """The document of compare.json."""
        seen = (self.control_observations, self.check_observations)
        return document(
            "compare",
            {
                "name": self.survey.name,
                "crs": self.survey.crs,
                "misclosure": "surveyed - observed, m",
                "control_points": len(set(seen[0].name)),
                "check_points": len(set(seen[1].name)),
                "scored_by": self.scored_by,
                "cross_validation_groups": self.groups,
                "methods": list(self.rows),
                "unseen": [{"name": row["name"], "why": row["reason"]} for row in self.unseen],
            },
        )

    def write(self, out, clouds=(), overwrite=False, progress=None):
        """Write compare.json and compare.html, and the clouds as some methods correct them.

        Parameters
        ----------
        out : path
            The folder, which appears whole or not at all.
        clouds : sequence of str
            Names of methods; each one's clouds go into a folder of its name.

        Returns the document. Its ``files`` name what was written, with the points outside the
        trajectory, which time-dependent methods leave as they were. Raises ValueError for a
        method that doesn't exist or wasn't determined, or when the folder holds an input, or
        holds anything without overwrite; OSError when writing fails.
        """
        from mlscorr.report import basis, verdict, write_comparison

        for name in clouds:
            self._check_cloud(name)
        check_output(out, input_files(self.survey.path), overwrite)
        content = self.document
        content |= {"basis": basis(content), "verdict": verdict(content)}
        with output_folder(out) as folder:
            content["files"] = self._write_clouds(folder, clouds, progress or silent)
            write_json(folder / "compare.json", content)
            write_comparison(folder / "compare.html", content)
        return content

    def _check_cloud(self, name):
        why = self.row(method_named(name).name)["why"]
        if why is not None:
            raise ValueError(f"The method {name} has no cloud to write: {why}")

    def _write_clouds(self, folder, names, progress):
        """Rows on the files that were written."""
        points = sum(file.points for file in self.survey.clouds)
        done = progress("Writing the clouds", points * len(names)) if names else None
        files = []
        for name in names:
            (folder / name).mkdir()
            for file in self.survey.clouds:
                outside = write_corrected(
                    file,
                    folder / name / file.path.name,
                    self.corrections[name],
                    lambda times: done(len(times)),
                )
                path = f"{name}/{file.path.name}"
                row = {"method": name, "name": path, "points": file.points}
                files.append({**row, "points_outside_trajectory": outside})
        return files
