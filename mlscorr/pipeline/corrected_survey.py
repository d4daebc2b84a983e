"""Result of a survey's correction, and its files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mlscorr.correction import PointSigma
from mlscorr.estimate import Estimate, NextControl, Support, find_jumps, place_control
from mlscorr.evaluate import (
    DatumDifference,
    PointCounts,
    Score,
    TargetRow,
    accuracy,
    largest_sigma,
    model_section,
    surveyed_rows,
    tie_section,
)
from mlscorr.io.clouds import Additions, sha256
from mlscorr.io.tables import write_targets_csv
from mlscorr.io.trajectories import (
    check_distinct,
    check_exports,
    check_target_exports,
    export_targets,
    export_trajectory,
    write_trajectory_csv,
    write_weak,
)
from mlscorr.pipeline._result import Reported, ResultFiles
from mlscorr.pipeline.clouds import MovedClouds, WrittenClouds, write_counted
from mlscorr.pipeline.estimation import check_score, check_sigmas, control_score
from mlscorr.pipeline.exclusion import Exclusion, excluded_rows
from mlscorr.pipeline.finding import silent
from mlscorr.survey import Matched, Summary, Survey, Trajectory, chosen_origin, rows_frame
from mlscorr.targets import FittedTarget

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from mlscorr.report import CorrectionReport

VERSION = version("mlscorr")


@dataclass(frozen=True, repr=False)
class CorrectedSurvey(Summary):
    """Corrected survey: the estimate, the targets, the statistics, and ``write``.

    Parameters
    ----------
    survey : Survey
    estimate : Estimate
    matched_control, matched_check : Matched
    missing : list of TargetRow
        Surveyed points without an observation.
    fitted : dict
        Targets by (pass number, gps_time), for their figures.
    warnings : tuple of str
        On clouds and control, in addition to those of the estimate and of ``datum``.
    datum : tuple of DatumDifference
        Overall differences of the used control from the cloud.
    excluded : Matched
        Control points that the user excluded.
    exclusions : tuple of Exclusion
        Effect of each of them on the result.
    pdf : bool
        True if ``write`` makes certificate.pdf by default.
    """

    survey: Survey
    estimate: Estimate
    matched_control: Matched
    matched_check: Matched
    missing: list[TargetRow] = field(default_factory=list)
    fitted: dict[tuple[int, float], FittedTarget] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    datum: tuple[DatumDifference, ...] = ()
    excluded: Matched = field(default_factory=Matched.none)
    exclusions: tuple[Exclusion, ...] = ()
    pdf: bool = False

    @property
    def trajectory(self) -> Trajectory:
        """Corrected trajectory, with the sigmas after the estimate."""
        return self.estimate.correction.corrected

    @property
    def control(self) -> dict:
        """Scores of the control points, as in report.json."""
        return self._control.document() | PointCounts.of(self.targets, "control").document()

    @property
    def check(self) -> dict:
        """Scores of the check points, as in report.json."""
        return self._check.document() | PointCounts.of(self.targets, "check").document()

    @property
    def _control(self) -> Score:
        return control_score(self.estimate, self.matched_control)

    @property
    def _check(self) -> Score:
        return check_score(self.estimate, self.matched_check)

    @property
    def targets(self) -> list[TargetRow]:
        """Rows of every surveyed point and pass."""
        estimate = self.estimate
        points = self.matched_control, self.matched_check
        rows = surveyed_rows(*points, estimate.correction, estimate.outliers, estimate.left_out)
        return rows + excluded_rows(self.excluded, estimate.correction) + self.missing

    @property
    def accuracy(self) -> dict[str, object]:
        """Accuracy by ASPRS 2023, as in report.json."""
        return accuracy(
            self.matched_check,
            self.matched_control,
            self.estimate.correction,
            self.estimate.left_out,
        )

    def to_frame(self) -> pandas.DataFrame:
        """Return the rows of targets.csv as a data frame; requires pandas."""
        return rows_frame(row.document() for row in self.targets)

    def plot(self, name: str = "correction") -> Figure:
        """Draw a figure of the report.

        Parameters
        ----------
        name : str
            ``correction`` over time, ``attitude``, ``map``, ``residuals``, or ``ties`` if there are
            ties.

        Returns
        -------
        matplotlib.figure.Figure
            ``savefig`` writes it; a notebook shows it.

        Raises
        ------
        ValueError
            If there is no such figure.
        """
        from mlscorr.report import correction_figures, draw

        estimate = self.estimate
        return draw(correction_figures(estimate.correction, self._draft, estimate.ties), name)

    def to_open3d(
        self, origin: np.ndarray | None = None, color: str = "correction"
    ) -> dict[str, Any]:
        """Convert trajectory, misclosures and ties to lines about one origin.

        Parameters
        ----------
        origin : (3,) array, optional
            A whole meter near the middle of the trajectory by default. Units: m.
        color : str
            Color of the trajectory: ``correction`` or ``sigma``; see
            ``PosErrorEstimate.to_open3d``.

        Returns
        -------
        dict
            ``trajectory``, ``misclosures`` and, if there are any, ``ties``: each an
            open3d.t.geometry.LineSet.

        Raises
        ------
        ValueError
            If the color is unknown.
        """
        from mlscorr.report import correction_lines, misclosure_lines, tie_lines

        place = chosen_origin(self.trajectory.position, origin)
        lines = {
            "trajectory": correction_lines(self.estimate.correction, place, color),
            "misclosures": misclosure_lines(self.matched_control, self.matched_check, place),
        }
        ties = self.estimate.ties
        if ties is not None:
            lines["ties"] = tie_lines(ties.ties[ties.used], place, 1.0)
        return lines

    def _overview(self):
        """Return the rows that a notebook shows."""
        rows = [("m", "", "n", "east", "north", "height", "3D")]
        for name, part in (("check points", self._check), ("control points", self._control)):
            states = {"before": part.before, "after": part.after, "left out": part.left_out}
            for state, statistics in states.items():
                if statistics is not None and statistics.n:
                    rmse = (f"{value:.3f}" for value in statistics.rmse[[0, 1, 2, 4]])
                    rows.append((name, state, statistics.n, *rmse))
        return [(self.survey.name,), ("RMSE of the misclosures",), *rows]

    def write(
        self,
        out: str | Path,
        overwrite: bool = False,
        progress: Callable | None = None,
        sigma: bool = False,
        page: bool = True,
        trajectories: Sequence[str] = (),
        targets: Sequence[str] = (),
        displacement: bool = False,
        provenance: bool = False,
        survey_toml: str | None = None,
        pdf: bool | None = None,
    ) -> dict:
        """Write corrected clouds, trajectory, targets and report into a folder.

        Parameters
        ----------
        out : path
            Folder, written atomically.
        overwrite : bool
            True to replace files of the same name.
        progress : function, optional
        sigma : bool
            True to add the fields sigma_easting, sigma_northing and sigma_height to each point.
        page : bool
            True to make report.html and the pictures, which takes longest for a short survey.
        trajectories : sequence of str
            Further files for the corrected trajectory: NAME.sbet or NAME.out with its smrmsg,
            NAME.tum, NAME.gpkg or NAME.geojson.
        targets : sequence of str
            Further files for the surveyed points: NAME.gpkg or NAME.geojson.
        displacement : bool
            True to add the fields displacement_easting, displacement_northing and
            displacement_height, corrected - recorded.
        provenance : bool
            True to name mlscorr as the generating software of each cloud, and to add a VLR (user ID
            mlscorr, record ID 1) with version, settings, and the hash of the inputs. By default
            everything except the coordinates is copied byte for byte.
        survey_toml : str, optional
            Contents of an inferred survey.toml to write with the results.
        pdf : bool, optional
            True to write certificate.pdf, two A4 pages to sign; by default as chosen in
            ``correct``.

        Returns
        -------
        dict
            Document of report.json.

        Raises
        ------
        ValueError
            If the folder contains an input, or anything without overwrite.
        OSError
            If writing fails.
        """
        check_exports(trajectories, self.survey.crs, is_read=True)
        check_target_exports(targets, self.survey.crs, is_read=True)
        check_distinct([*trajectories, *targets])
        text = self._provenance() if provenance else None
        added = Additions(sigma, displacement, text, VERSION)

        sampler = None
        if page:
            from mlscorr.report import cloud_sampler

            sampler = cloud_sampler(self.targets, self.estimate.ties)

        def clouds(folder):
            done = (progress or silent)("Writing the cloud", self.survey.points)
            add = None if sampler is None else sampler.add
            moved = MovedClouds(self.survey, self.estimate.correction, self.held, add)
            (written,) = write_counted([moved], folder, done, added)
            return written

        certified = self.pdf if pdf is None else pdf
        files = self._files(progress, page, trajectories, targets, sampler, certified)
        if survey_toml is not None:
            inferred = {"survey.toml": lambda path: path.write_text(survey_toml, encoding="utf-8")}
            files = replace(files, tables={**files.tables, **inferred})
        return files.write(out, overwrite, clouds)

    def _provenance(self):
        """Text of the VLR that names the correcting program."""
        settings = {
            "order": self.estimate.order,
            "ties_used": (self.tie_section or {}).get("used", 0),
        }
        inputs = sorted((file.path.name, sha256(file.path)) for file in self.survey.inputs)
        content = {
            "version": VERSION,
            "settings": settings,
            "settings_sha256": _digest(json.dumps(settings, sort_keys=True)),
            "inputs_sha256": _digest("".join(f"{content}  {name}\n" for name, content in inputs)),
        }
        return json.dumps({"schema": "mlscorr.provenance/1", **content})

    @property
    def held(self) -> tuple[tuple[float, float], Support]:
        """First and last control epoch (s), and constraints of the correction along the drive."""
        if self.estimate.used.any():
            span = self.estimate.span
        else:
            span = (np.inf, -np.inf)
        return span, self.estimate.support

    def write_beside(
        self,
        folder: Path,
        written: WrittenClouds,
        progress: Callable | None = None,
        page: bool = True,
        trajectories: Sequence[str] = (),
        targets: Sequence[str] = (),
    ) -> dict:
        """Write everything except the clouds into an existing folder; see ``write``."""
        return self._files(progress, page, trajectories, targets).write_beside(folder, written)

    def _files(self, progress, page, trajectories, targets, sampler=None, certified=False):
        """Write trajectory, targets, weak intervals and report.json; report.html and pictures."""
        from mlscorr.report import first_screen

        survey = self.survey
        rows = [row.document() for row in self.targets]
        weak = [interval.document() for interval in self.estimate.support.weak]
        exports = {
            name: lambda path: export_trajectory(
                path, self.trajectory, survey.crs, self.estimate.correction.recorded
            )
            for name in trajectories
        }
        surveyed = (survey.control, survey.check)
        kinds = {n: k for points in surveyed for n, k in zip(points.name, points.kind, strict=True)}
        exports |= {
            name: lambda path: export_targets(path, rows, kinds, survey.crs) for name in targets
        }
        tables = {
            "trajectory.csv": lambda path: write_trajectory_csv(path, self.trajectory),
            **exports,
            "targets.csv": lambda path: write_targets_csv(path, rows),
            "weak.csv": lambda path: write_weak(path.parent, weak, self.trajectory, survey.crs),
        }

        stage = progress or silent

        def report(written):
            stage("Hashing inputs and results")
            paths = [name for export in trajectories for name in written.tables[export]]
            report = self._report(
                written.folder, written.clouds, paths, targets, written.tables["weak.csv"]
            )
            pages = self._pages(report, stage, sampler) if page else {}
            if certified:
                from mlscorr.report import write_certificate

                pages["certificate.pdf"] = write_certificate
            content = first_screen(report) | report.document()
            if self.exclusions:
                content["exclusions"] = [row.document() for row in self.exclusions]
            return Reported(content, pages)

        return ResultFiles("report", survey.inputs, report, tables)

    def _pages(self, report, progress, sampler):
        """Functions for report.html and the folder of pictures."""
        from mlscorr.report import correction_figures, view_cloud, write_pictures, write_report

        correction = self.estimate.correction
        ties = self.estimate.ties
        figures = correction_figures(correction, report, ties)

        def write_page(path, _):
            sample = None if sampler is None else sampler.sample
            views = view_cloud(self.survey, correction, report.targets, progress, ties, sample)
            progress("Drawing report.html")
            write_report(path, self.survey, correction, report, views, self.fitted, ties, figures)

        def draw(path, _):
            progress("Drawing pictures")
            path.mkdir()
            write_pictures(path, correction, report, ties, figures)

        return {"report.html": write_page, "pictures": draw}

    @cached_property
    def next_control(self) -> tuple[NextControl, ...]:
        """Best positions for one more control point each, sorted by benefit."""
        return place_control(self.estimate)

    @cached_property
    def tie_section(self) -> dict | None:
        """Effect of ties, as in report.json."""
        return tie_section(self.estimate)

    def point_sigma(self, survey: Survey | None = None) -> PointSigma:
        """Return the PointSigma of the corrected cloud: ``.at(xyz, gps_time)`` is (n, 3) in m.

        Parameters
        ----------
        survey : Survey, optional
            One of ``survey.by_scanner``, if there are several scanners.
        """
        survey = survey or self.survey
        return PointSigma.of(self.estimate.correction, survey.scanner, survey.mounting)

    def _report(self, folder, written, exports, targets, weak_names):
        """CorrectionReport, after all files it names are in the folder."""
        from mlscorr.report import FileRow

        def described(what, path):
            return FileRow(path.name, sha256(path), what, bytes=path.stat().st_size)

        names = ["trajectory.csv", *exports]
        outputs = [("corrected trajectory", name) for name in names]
        outputs += [("targets", name) for name in ("targets.csv", *targets)]
        outputs += [("extrapolated stretches", name) for name in weak_names]
        return replace(
            self._draft,
            coverage=replace(
                self._draft.coverage,
                points_outside_trajectory=written.outside,
                points_outside_control=written.uncontrolled,
                points_extrapolated=written.extrapolated,
                points_noise=written.noise,
                points_corrected=sum(n for _, _, n in written.files) - written.outside,
            ),
            files=tuple(FileRow(name, digest, points=n) for name, digest, n in written.files),
            inputs=tuple(described(file.what, file.path) for file in self.survey.inputs),
            outputs=tuple(described(what, folder / name) for what, name in outputs),
            next_control=self.next_control,
        )

    @cached_property
    def _draft(self) -> CorrectionReport:
        """Data of the correction for figures: all except files, counts of points, next control."""
        from mlscorr.report import CorrectionReport, Coverage, recorded_time, well_determined

        start, end = self.estimate.guards.longest_gap
        draft = CorrectionReport(
            name=self.survey.name,
            crs=self.survey.crs,
            notes=(
                *self.survey.notes,
                *(row.sentence for row in self.exclusions),
                *filter(None, [self.estimate.untied]),
            ),
            targets=self.targets,
            control=self._control,
            check=self._check,
            accuracy=self.accuracy,
            model=model_section(self.estimate, self.warnings),
            coverage=Coverage(self.estimate.span, end - start),
            support=self.estimate.support,
            jumps=find_jumps(self.estimate.correction),
            ties=self.tie_section,
            position_sigma=largest_sigma(self.trajectory, self.survey),
            datum=self.datum,
            assumed=self.survey.assumed_pos if self.survey.has_assumed_position else (),
            project=self.survey.project,
            recorded=recorded_time(self.survey),
            check_sigmas=check_sigmas(self.estimate, self.matched_check),
        )
        share = well_determined(self.estimate.correction, draft)
        return replace(draft, well_determined=share)


def _digest(text):
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()
