"""``correct``: from a survey to corrected clouds, trajectory and report."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.estimate import SETTINGS, Estimate, NextControl, place_control
from mlscorr.evaluate.datum import datum_warnings
from mlscorr.evaluate.model import model_section
from mlscorr.evaluate.rows import PointCounts, Score, TargetRow
from mlscorr.evaluate.scores import accuracy, score
from mlscorr.evaluate.target_rows import surveyed_rows, unseen_rows
from mlscorr.evaluate.ties import tie_section
from mlscorr.io.las import sha256
from mlscorr.io.output import document, output_folder, write_json
from mlscorr.io.result_tables import write_targets_csv
from mlscorr.io.trajectory import write_trajectory_csv
from mlscorr.io.trajectory_exports import check_exports, export_trajectory
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.tying import TieUse, estimate_survey
from mlscorr.survey import Matched, Survey, Trajectory
from mlscorr.survey.summary import Summary
from mlscorr.targets import FittedTarget


def correct(
    survey: Survey,
    order: int = SETTINGS.order,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: TieUse | None = None,
) -> CorrectedSurvey:
    """Find the targets of a survey and estimate the POS error from its control points.

    Planes and poles that two passes both saw hold the passes together, where there are any.

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
        When no target is found or matched.

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
    survey, control, check, finding, estimate = estimate_survey(survey, order, ties, rng, progress)
    datum = datum_warnings(control[estimate.used], survey.trajectory, survey.pos)
    for sentence in (*datum, *estimate.warnings):
        warnings.warn(sentence, stacklevel=2)
    return CorrectedSurvey(
        survey=survey,
        estimate=estimate,
        matched_control=control,
        matched_check=check,
        missing=unseen_rows(survey, finding.matches.refusals, finding.candidates, finding.scanned),
        fitted=finding.fitted,
        warnings=(*finding.warnings, *datum),
    )


@dataclass(frozen=True, repr=False)
class CorrectedSurvey(Summary):
    """A corrected survey: the estimate, the targets, the statistics, and ``write``.

    Parameters
    ----------
    survey : Survey
    estimate : Estimate
    matched_control, matched_check : Matched
    missing : list of TargetRow
        Surveyed points without an observation.
    fitted : dict
        The targets by (pass number, gps_time), for their figures.
    warnings : tuple of str
        On clouds and control, beside those of the estimate.
    """

    survey: Survey
    estimate: Estimate
    matched_control: Matched
    matched_check: Matched
    missing: list[TargetRow] = field(default_factory=list)
    fitted: dict[tuple[int, float], FittedTarget] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def trajectory(self) -> Trajectory:
        """The corrected trajectory, with the sigmas after the estimate."""
        return self.estimate.correction.corrected

    @property
    def control(self) -> dict:
        """What remains at the control points, as report.json has it."""
        return self._control.document() | PointCounts.of(self.targets, "control").document()

    @property
    def check(self) -> dict:
        """What remains at the check points, as report.json has it."""
        return self._check.document() | PointCounts.of(self.targets, "check").document()

    @property
    def _control(self) -> Score:
        return score(self.matched_control, self.estimate.correction, self.estimate.left_out)

    @property
    def _check(self) -> Score:
        return score(self.matched_check, self.estimate.correction)

    @property
    def targets(self) -> list[TargetRow]:
        """Rows of every surveyed point and pass."""
        estimate = self.estimate
        points = self.matched_control, self.matched_check
        rows = surveyed_rows(*points, estimate.correction, estimate.outliers, estimate.left_out)
        return rows + self.missing

    @property
    def accuracy(self) -> dict[str, object]:
        """Accuracy by ASPRS 2023, as report.json has it: mlscorr.evaluate.accuracy."""
        return accuracy(
            self.matched_check,
            self.matched_control,
            self.estimate.correction,
            self.estimate.left_out,
        )

    def write(
        self,
        out: str | Path,
        overwrite: bool = False,
        progress: Callable | None = None,
        sigma: bool = False,
        page: bool = True,
        trajectories: Sequence[str] = (),
    ) -> dict:
        """Write corrected clouds, trajectory, targets and report into a folder.

        Parameters
        ----------
        out : path
            The folder, which appears whole or not at all.
        overwrite : bool
            Whether files of the same name are replaced.
        progress : function, optional
        sigma : bool
            Give each point the fields sigma_easting, sigma_northing and sigma_height.
        page : bool
            Draw report.html and the pictures too, which takes longer than all else where the
            survey is short.
        trajectories : sequence of str
            Further files for the corrected trajectory: NAME.sbet or NAME.out with its smrmsg, or
            NAME.tum.

        Returns
        -------
        dict
            The document of report.json.

        Raises
        ------
        ValueError
            When the folder holds an input, or holds anything without overwrite.
        OSError
            When writing fails.
        """
        from mlscorr.report import headline

        check_exports(trajectories, self.survey.crs, is_read=True)
        with output_folder(out, self.survey.inputs, overwrite) as folder:
            files, uncontrolled = self._write_clouds(folder, progress or silent, sigma)
            write_trajectory_csv(folder / "trajectory.csv", self.trajectory)
            exports = [
                name
                for export in trajectories
                for name in export_trajectory(folder / export, self.trajectory, self.survey.crs)
            ]
            write_targets_csv(folder / "targets.csv", [row.document() for row in self.targets])
            report = self._report(folder, files, uncontrolled, exports)
            content = document("report", {"headline": headline(report), **report.document()})
            write_json(folder / "report.json", content)
            if page:
                self._draw(folder, report, progress or silent)
        return content

    def _draw(self, folder, report, progress):
        """Write report.html and the pictures."""
        from mlscorr.report import view_cloud, write_pictures, write_report

        correction, ties = self.estimate.correction, self.estimate.ties
        views = view_cloud(self.survey, correction, report.targets, progress, ties)
        page = folder / "report.html"
        write_report(page, self.survey, correction, report, views, self.fitted, ties)
        (folder / "pictures").mkdir()
        write_pictures(folder / "pictures", correction, report, ties)

    @cached_property
    def next_control(self) -> tuple[NextControl, ...]:
        """Where one more control point each would help most, the best first."""
        return place_control(self.estimate)

    def point_sigma(self, survey: Survey | None = None) -> PointSigma:
        """PointSigma of the corrected cloud: ``.at(xyz, gps_time)`` gives (n, 3) in m.

        Parameters
        ----------
        survey : Survey, optional
            One of ``survey.by_scanner``, where there are several scanners.
        """
        survey = survey or self.survey
        return PointSigma.of(self.estimate.correction, survey.scanner, survey.mounting)

    def _write_clouds(self, folder, progress, sigma):
        """Write the clouds: (path, points, outside) of each, and points outside of control and
        extrapolated (2,).
        """
        first, last = self.estimate.span if self.estimate.used.any() else (np.inf, -np.inf)
        uncontrolled = np.zeros(2, int)
        done = progress("Writing the cloud", self.survey.points)

        def watch(times):
            is_outside = (times < first) | (times > last)
            is_weak = self.estimate.support.contains(times)
            uncontrolled[:] += np.count_nonzero([is_outside, is_weak], axis=1)
            done(len(times))

        sigmas = self.point_sigma if sigma else None
        files = write_clouds(self.survey, folder, self.estimate.correction, watch, sigmas)
        return files, uncontrolled.tolist()

    def _report(self, folder, files, uncontrolled, exports):
        """The CorrectionReport, once all that it names stands in the folder."""
        from mlscorr.report.correction_report import CorrectionReport, Coverage, FileRow

        def described(what, path):
            return FileRow(path.name, sha256(path), what, bytes=path.stat().st_size)

        epochs = np.unique(self.matched_control.gps_time[self.estimate.used])
        longest = float(np.diff(epochs if len(epochs) else self.estimate.span).max(initial=0.0))
        outside, total = (sum(file[k] for file in files) for k in (2, 1))
        span, support = self.estimate.span, self.estimate.support
        names = ["trajectory.csv", *exports]
        outputs = [*(("corrected trajectory", name) for name in names), ("targets", "targets.csv")]
        return CorrectionReport(
            name=self.survey.name,
            crs=self.survey.crs,
            notes=(*self.survey.notes, *filter(None, [self.estimate.untied])),
            targets=self.targets,
            control=self._control,
            check=self._check,
            accuracy=self.accuracy,
            model=model_section(self.estimate, self.warnings),
            coverage=Coverage(span, longest, outside, *uncontrolled, total - outside),
            support=support,
            files=tuple(FileRow(path.name, sha256(path), points=n) for path, n, _ in files),
            inputs=tuple(described(file.what, file.path) for file in self.survey.inputs),
            outputs=tuple(described(what, folder / name) for what, name in outputs),
            next_control=self.next_control,
            ties=tie_section(self.estimate),
        )
