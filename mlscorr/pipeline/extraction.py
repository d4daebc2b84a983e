"""``extract``: from a survey to a list of all target-like objects in its cloud."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mlscorr.io.clouds import read_chunks
from mlscorr.io.tables import write_extracted_csv
from mlscorr.pipeline._result import KnownResult, ResultFiles
from mlscorr.pipeline.beams import with_beam_origin
from mlscorr.pipeline.finding import (
    MATCHING,
    MatchedTargets,
    fit_while_reading,
    match_fitted,
    silent,
    unmatched,
)
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import Survey, TargetObservations, check_rng, check_survey, rows_frame
from mlscorr.targets import BY_EDGES, as_observations, distinct, search_targets, why_useless

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

BRIGHT_KINDS = ("circle", "square", "checkerboard")  # kinds found without a surveyed position
NO_CONTROL = "No control point is given: objects were classified by their appearance only."


def extract(
    survey: Survey, rng: np.random.Generator | None = None, progress: Callable | None = None
) -> ExtractedSurvey:
    """List all target-like objects in the cloud of a survey, with and without control.

    Objects with the kinds and sizes of control points are found everywhere, near control points
    also by edges without intensity. Without control, circles, squares and checkerboards of 0.1 to
    1.5 m are found, with estimated sizes.

    Parameters
    ----------
    survey : Survey
        Its control may be empty.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.

    Returns
    -------
    ExtractedSurvey
        Warns if the intensity carries no information, or no object was found.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> found = mlscorr.extract(mlscorr.read_survey(folder))
    >>> sum(row["matched"] for row in found.targets)
    5
    """
    check_survey(survey)
    if rng is None:
        rng = np.random.default_rng(SETTINGS.seed)
    check_rng(rng)
    surveyed = survey.surveyed
    kinds = dict.fromkeys(zip(surveyed.kind, surveyed.size.tolist(), strict=True))
    shapes = [shape for shape in kinds if shape[0] not in BY_EDGES]
    if len(surveyed) == 0:
        shapes = [(kind, None) for kind in BRIGHT_KINDS]
    done = (progress or silent)("Searching the cloud", survey.points)
    present = np.zeros(1 << 16, bool)
    objects = {}

    def searched(file):
        """Yield the chunks of a file, each searched while it is read."""
        of_file = objects.setdefault(len(objects), [])
        own = with_beam_origin(survey.of(file), file)
        for chunk, targets in search_targets(read_chunks(file), own, shapes, rng):
            present[chunk.intensity] = True
            of_file += targets
            yield chunk

    near_control = fit_while_reading(survey, searched, rng, done)
    everywhere = [
        (
            near_control.candidates.passes[file, int(survey.trajectory.segment(target.gps_time))],
            target,
        )
        for file, targets in objects.items()
        for target in distinct(targets)
    ]
    (progress or silent)(MATCHING)
    result = _without_doubles(list(near_control.targets), everywhere)
    sentences = _sentences(survey, np.flatnonzero(present), result)
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=2)
    if result and len(surveyed):
        everything = replace(  # a target excluded from an estimate is still a target
            survey, control=survey.control + survey.excluded, excluded=survey.control[[]]
        )
        finding = match_fitted(everything, result, near_control.candidates)
    else:
        finding = unmatched(survey, result, near_control.candidates, NO_CONTROL)
    return ExtractedSurvey(survey, finding, sentences)


def _without_doubles(near, everywhere):
    """Both lists together, sorted by pass and time; near control, the surveyed size is known."""
    others = [
        (number, target)
        for number, target in everywhere
        if not any(number == n and target.overlaps(other) for n, other in near)
    ]
    return sorted(near + others, key=lambda pair: (pair[0], pair[1].gps_time))


def _sentences(survey, intensities, targets):
    """Sentences for a reader of the list."""
    sentences = []
    if why_useless(intensities) is not None:
        values = ", ".join(f"{value}" for value in intensities)
        sentences.append(
            f"The cloud has no useful intensity (values: {values}), so that only free-standing "
            "plates were searched, by their edges. Export the cloud with intensity."
        )
    if len(targets) == 0:
        points = survey.points
        sentences.append(
            f"No target-like object was found among {points} points. Flat circles, squares and "
            "checkerboards with 25 or more points, brighter than their surroundings, can be "
            "found: check intensity, point density and that targets were set up."
        )
    return tuple(sentences)


@dataclass(frozen=True, repr=False)
class ExtractedSurvey(KnownResult):
    """Objects found in a survey's cloud, and ``write``.

    Parameters
    ----------
    survey : Survey
    finding : MatchedTargets
    warnings : tuple of str
    """

    _name = "targets"
    survey: Survey
    finding: MatchedTargets
    warnings: tuple[str, ...]

    @property
    def targets(self) -> list[dict]:
        """Rows of every object and pass, as in targets.json, sorted by pass and time."""
        matches = self.finding.matches
        rows = self._rows(matches.matched, [None] * len(matches.matched))
        rows += self._rows(matches.unmatched, matches.reasons)
        return sorted(rows, key=lambda row: (row["pass"], row["gps_time"]))

    @property
    def missing(self) -> list[dict]:
        """Surveyed points without an observation, with the pass and the reason."""
        return [
            {"name": refusal.name, "pass": refusal.pass_number, "reason": refusal.reason}
            for refusal in self.finding.matches.refusals
        ]

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per object and pass, as in targets.json; requires
        pandas.
        """
        return rows_frame(self.targets)

    def plot(self) -> Figure:
        """Draw the objects one by one, with the points on each and the fitted outline."""
        from mlscorr.report import targets_figure

        return targets_figure(self._fitted)

    def to_open3d(self, origin: np.ndarray | None = None, enlarged: float = 100.0) -> Any:
        """Outlines of the objects, with an ellipsoid of one sigma around each center.

        Parameters
        ----------
        origin, enlarged
            See ``FoundTargets.to_open3d``.

        Returns
        -------
        open3d.t.geometry.LineSet
        """
        from mlscorr.report import target_lines

        return target_lines(as_observations(self._fitted), origin, enlarged)

    @property
    def _fitted(self):
        """Pairs (pass number, FittedTarget) of all objects."""
        return [(number, target) for (number, _), target in self.finding.fitted.items()]

    def _overview(self):
        """Return the rows that a notebook shows."""
        kinds = Counter(row["kind"] for row in self.targets)
        objects = ", ".join(f"{kind}: {number}" for kind, number in kinds.items())
        rows = [("objects", objects or "none"), ("unseen", len(self.missing))]
        return [(self.survey.name,), *rows, *((sentence,) for sentence in self.warnings)]

    def _rows(self, observations: TargetObservations, reasons) -> list[dict]:
        rows = []
        for i, reason in enumerate(reasons):
            number = int(observations.pass_number[i])
            time = float(observations.gps_time[i])
            fitted = self.finding.fitted[number, time]
            rows.append(
                {
                    "name": observations.name[i],
                    "pass": number,
                    "gps_time": time,
                    "kind": observations.kind[i],
                    "size": float(observations.size[i]),
                    "size_sigma": float(fitted.size_sigma),
                    "observed": observations.position[i].tolist(),
                    "covariance": observations.covariance[i].tolist(),
                    "normal": observations.normal[i].tolist(),
                    "points": int(observations.points[i]),
                    "score": float(fitted.score),
                    "matched": observations.name[i] is not None,
                    "reason": reason,
                }
            )
        return rows

    def _content(self):
        return {
            "name": self.survey.name,
            "crs": self.survey.crs,
            "surveyed": len(self.survey.surveyed),
            "targets": self.targets,
            "unseen": self.missing,
            "warnings": list(self.warnings),
        }

    def _files(self):
        """Files targets.csv, targets.json and the contact sheet targets.png."""
        from mlscorr.report import write_contact_sheet

        rows = self.targets
        fitted = self.finding.fitted
        return ResultFiles.of(
            self._name,
            self.survey.inputs,
            self.document,
            tables={"targets.csv": lambda path: write_extracted_csv(path, rows)},
            pages={"targets.png": lambda path, _: write_contact_sheet(path, rows, fitted)},
        )
