"""What a comparison of methods gives of a survey, and its files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mlscorr.evaluate import TargetRow, surveyed_rows
from mlscorr.io.store import document
from mlscorr.pipeline._result import Reported, ResultFiles
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.methods import method_named
from mlscorr.survey import Matched, Summary, Survey, rows_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

ROW_LISTS = ("warnings", "details")  # of a method's row: no numbers for a data frame


@dataclass(frozen=True, repr=False)
class ComparedSurvey(Summary):
    """All methods' rows of compare.json, their corrections by name, and ``write``.

    Parameters
    ----------
    survey : Survey
    matched_control, matched_check : Matched
    rows : tuple of dict
        As ``methods`` of compare.json has them.
    corrections : dict
        What has ``apply(cloud)``, by the methods' names.
    groups : int
        How many times control points were left out, zero without cross-validation.
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
        """The row of one method."""
        return next(row for row in self.rows if row["name"] == name)

    @property
    def scored_by(self) -> str:
        """What the methods are ranked by: check, cross_validated, or the mere fit to control."""
        if "cross_validated" in self.rows[0] and self.groups:
            return "cross_validated"
        if len(self.matched_check):
            return "check"
        return "control"

    @cached_property
    def document(self) -> dict:
        """The document of compare.json, without the files."""
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
        """A row each method, with its statistics as a data frame; pandas is needed for it."""
        rows = ({k: v for k, v in row.items() if k not in ROW_LISTS} for row in self.rows)
        return rows_frame(rows)

    def plot(self) -> Figure:
        """The RMSE of every method on each axis, the best at the top."""
        from mlscorr.report import comparison_figure

        return comparison_figure(self.document)

    def _overview(self):
        """What a notebook shows."""
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
        """Write compare.json and compare.html, and the clouds as some methods correct them.

        Parameters
        ----------
        out : path
            The folder, which appears whole or not at all.
        clouds : sequence of str
            Names of methods; each one's clouds go into a folder of its name.

        Returns
        -------
        dict
            The document. Its ``files`` name what was written, with the points outside the
            trajectory, which time-dependent methods leave as they were.

        Raises
        ------
        ValueError
            For a method that doesn't exist or wasn't determined, or when the folder holds an
            input, or holds anything without overwrite.
        OSError
            When writing fails.
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
        """Rows on the files that were written."""
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
