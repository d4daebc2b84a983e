"""``ties``: from a survey to the tie features of its overlapping passes."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mlscorr.evaluate import misclosure_statistics
from mlscorr.io.clouds import read_chunks
from mlscorr.io.tables import write_ties_csv
from mlscorr.pipeline._result import KnownResult, ResultFiles
from mlscorr.pipeline.finding import COLLECTING, silent
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import TIE_KINDS, Survey, TieFeatures, check_survey
from mlscorr.ties import (
    SETTINGS,
    TieSearch,
    group_by_time,
    information,
    search_ties,
    unconstrained_directions,
    unconstrained_sentence,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

AXES = ("across", "along", "up")  # of the path of the earlier view

LOG = logging.getLogger(__name__)


def find_ties(
    survey: Survey, progress: Callable | None = None, features: TieFeatures | None = None
) -> TiedSurvey:
    """Find planes, poles and paint in overlaps of passes, without control.

    Parameters
    ----------
    survey : Survey
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    features : TieFeatures, optional
        From ``find_targets(..., with_ties=True)``; otherwise the clouds are read.

    Returns
    -------
    TiedSurvey
        Warns if passes do not overlap, a direction is unconstrained, or most pairs are refused.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> there_and_back = Scenario(
    ...     drive={"duration": 5.0, "passes": [{}, {"direction": "back"}]},
    ...     targets={"control": 2, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(there_and_back, np.random.default_rng(1)).write(folder)
    >>> tied = mlscorr.find_ties(mlscorr.read_survey(folder))
    >>> tied.pairs[0]["passes"]
    [1, 2]
    """
    check_survey(survey)
    if features is None:
        features = _read_features(survey, progress)
    (progress or silent)("Pairing tie features")
    tied = TiedSurvey(survey, features, search_ties(survey, features))
    LOG.info("%d ties between %d planes, poles and markings", len(tied.search.ties), len(features))
    for sentence in tied.warnings:
        warnings.warn(sentence, stacklevel=2)
    return tied


def _read_features(survey, progress):
    """Read planes, poles and paint of all clouds."""
    stage = progress or silent
    done = stage("Searching the cloud", survey.points)
    collector = FeatureCollector(survey)
    for file in survey.clouds:
        for chunk in read_chunks(file):
            collector.add(file, chunk)
            done(len(chunk))
    stage(COLLECTING)
    return collector.features()


@dataclass(frozen=True, repr=False)
class TiedSurvey(KnownResult):
    """Ties between the passes of a survey, and ``write``.

    Parameters
    ----------
    survey : Survey
    features : TieFeatures
    search : TieSearch
    """

    _name = "ties"
    survey: Survey
    features: TieFeatures
    search: TieSearch

    @property
    def pairs(self) -> list[dict]:
        """Rows of every pair of passes, as in ties.json."""
        ties = self.search.ties
        rows = []
        heading = self.survey.trajectory.at(ties.gps_time[:, 0]).attitude
        axis = np.abs(heading.inv().apply(ties.direction)).argmax(axis=1)
        for passes in np.unique(ties.pass_number, axis=0):
            inside = (ties.pass_number == passes).all(axis=1)
            by_axis = {
                name: _misclosure_statistics(ties.misclosure[inside & (axis == i)])
                for i, name in enumerate(AXES)
            }
            rows.append(
                {
                    "passes": passes.tolist(),
                    "n": int(inside.sum()),
                    "planes": int((ties.kind[inside] == "plane").sum()),
                    "poles": int((ties.kind[inside] == "pole").sum()) // 2,
                    "lines": int((ties.kind[inside] == "line").sum()),
                    "dashes": int((ties.kind[inside] == "dash").sum()),
                    "misfit": by_axis,
                    "weakest": _weakest(ties[inside]),
                }
            )
        return rows

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per tie, with both its views; requires pandas."""
        return self.search.ties.to_frame()

    def plot(self) -> Figure:
        """Plot the ties from above, colored by the distance of both views, and the refused
        pairs.
        """
        from mlscorr.report import search_figure

        return search_figure(self.survey.trajectory, self.search.ties, self.search.refused)

    def to_open3d(self, origin: np.ndarray | None = None, enlarged: float = 1.0) -> Any:
        """Lines between both views of each tie, colored by their misclosure.

        Parameters
        ----------
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``.
        enlarged : float
            Magnification of lines, about their middles.

        Returns
        -------
        open3d.t.geometry.LineSet
            With the attribute ``misclosure`` of the lines, in m.
        """
        from mlscorr.report import tie_lines

        return tie_lines(self.search.ties, origin, enlarged)

    def _overview(self):
        """Return the rows that a notebook shows."""
        kinds = ("planes", "poles", "lines", "dashes")
        rows = [("passes", *kinds, "misclosure across, along, up (m, RMS)")]
        for pair in self.pairs:
            rms_values = (pair["misfit"][axis]["rms"] for axis in AXES)
            numbers = ", ".join("-" if rms is None else f"{rms:.3f}" for rms in rms_values)
            rows.append((pair["passes"], *(pair[kind] for kind in kinds), numbers))
        return [(self.survey.name,), *rows, *((sentence,) for sentence in self.warnings)]

    @property
    def stretches(self) -> list[dict]:
        """Weakest directions of the ties of each pair of passes, by interval of the earlier
        view.
        """
        ties = self.search.ties
        group = group_by_time(ties, 0, SETTINGS.pause)
        rows = []
        for number in range(group.max(initial=-1) + 1):
            part = ties[group == number]
            time = part.gps_time[:, 0]
            rows.append(
                {
                    "passes": part.pass_number[0].tolist(),
                    "from": float(time.min()),
                    "to": float(time.max()),
                    "n": len(part),
                    "weakest": _weakest(part),
                }
            )
        return rows

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for a reader of the ties."""
        ties = self.search.ties
        refused = self.search.refused
        if len(ties) == 0:
            return (
                f"No tie was found: none of {len(self.features)} planes, poles and markings was "
                f"scanned twice within {self.search.radius:.2f} m. Drive the road twice, "
                "preferably in both directions; if you did, increase the sigmas of the POS or "
                "[matching] search_radius.",
            )
        sentences = []
        if len(refused) > len(ties):
            sentences.append(
                f"{len(refused)} of {len(ties) + len(refused)} pairs contradict their neighbors "
                "in time, so most are not ties. The POS may be less accurate than it states, or "
                "the mounting wrong by degrees: run mlscorr calibrate."
            )
        sentences += [unconstrained_sentence(*each) for each in unconstrained_directions(ties)]
        return tuple(sentences)

    def _content(self):
        kinds = self.features.kind
        passes = self.features.pass_number
        return {
            "name": self.survey.name,
            "crs": self.survey.crs,
            "features": {
                **{kind: int((kinds == kind).sum()) for kind in TIE_KINDS},
                "passes": {str(p): int((passes == p).sum()) for p in np.unique(passes)},
            },
            "search_radius": self.search.radius,
            "ties": len(self.search.ties),
            "refused": len(self.search.refused),
            "pairs": self.pairs,
            "stretches": self.stretches,
            "warnings": list(self.warnings),
        }

    def _files(self):
        """Files ties.csv and ties.json."""
        return ResultFiles.of(
            self._name,
            self.survey.inputs,
            self.document,
            tables={"ties.csv": lambda path: write_ties_csv(path, self.search.ties)},
            pages={},
        )


def _misclosure_statistics(misclosure):
    """Number, median and root mean square of misclosures (n,). Units: m."""
    return {"n": len(misclosure), **misclosure_statistics(misclosure)}


def _weakest(ties):
    """Weakest direction of ties, and one sigma of a shift along it. Units: m."""
    values, axes = np.linalg.eigh(information(ties, np.zeros(len(ties), int))[0])
    sigma = float(values[0] ** -0.5) if values[0] > 0 else None
    return {"direction": axes[:, 0].tolist(), "sigma": sigma}
