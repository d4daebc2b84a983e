"""``correct``: from a survey to corrected clouds, trajectory and report."""

import warnings
from dataclasses import dataclass, field

import numpy as np

from mlscorr.correction import ORDER, Estimate, estimate_correction
from mlscorr.evaluation import (
    CHECK_REASON,
    accuracy,
    before_and_after,
    model_section,
    statistics,
    target_rows,
    unseen_rows,
)
from mlscorr.io.las import sha256, write_corrected
from mlscorr.io.output import (
    check_output,
    document,
    output_folder,
    write_json,
    write_targets_csv,
)
from mlscorr.io.survey_file import input_files, named_files
from mlscorr.io.trajectory import write_trajectory_csv
from mlscorr.pipeline.finding import find_control, silent
from mlscorr.survey import ControlPoints, Survey, TargetObservations, Trajectory
from mlscorr.targets.fit import FittedTarget
from mlscorr.uncertainty import PointSigma


def correct(survey, order=ORDER, rng=None, progress=None):
    """Find the targets of a survey and estimate the POS error from its control points.

    Parameters
    ----------
    survey : Survey
    order : int
        Of the polynomial trend of the position error.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.

    Returns a CorrectedSurvey. Raises ValueError when no target is found or matched. The check
    points take no part.

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
    control, check, finding = find_control(survey, rng, progress)
    estimate = estimate_correction(survey.trajectory, control, survey.control, survey.pos, order)
    for sentence in estimate.warnings:
        warnings.warn(sentence, stacklevel=2)
    return CorrectedSurvey(
        survey=survey,
        estimate=estimate,
        control_observations=control,
        check_observations=check,
        unseen=unseen_rows(survey, finding.matches.refusals, finding.candidates),
        fitted=finding.fitted,
    )


@dataclass(frozen=True)
class CorrectedSurvey:
    """A corrected survey: the estimate, the targets, the statistics, and ``write``.

    ``control`` and ``check`` hold n and the misclosures' statistics before and after, in m;
    ``unseen`` are the surveyed points without an observation, as rows of report.json; ``fitted``
    the targets by (pass number, gps_time), for their figures.
    """

    survey: Survey
    estimate: Estimate
    control_observations: TargetObservations
    check_observations: TargetObservations
    unseen: list[dict] = field(default_factory=list)
    fitted: dict[tuple[int, float], FittedTarget] = field(default_factory=dict)

    @property
    def trajectory(self) -> Trajectory:
        """The corrected trajectory, with the sigmas after the estimate."""
        return self.estimate.correction.corrected

    @property
    def control(self):
        fit = self._statistics(self.control_observations, self.survey.control)
        left_out = self.estimate.left_out[np.isfinite(self.estimate.left_out).all(axis=1)]
        return {**fit, "leave_one_out": {"n": len(left_out), **statistics(left_out)}}

    @property
    def check(self):
        return self._statistics(self.check_observations, self.survey.check)

    @property
    def targets(self):
        """Rows of every surveyed point and pass, as report.json has them."""
        correction = self.estimate.correction
        outliers = {outlier.name: outlier for outlier in self.estimate.outliers}
        reasons = [
            f"outlier: statistic {outliers[name].statistic:.1f} against "
            f"{outliers[name].critical:.1f}"
            if name in outliers
            else None
            for name in self.control_observations.name
        ]
        rows = target_rows(
            self.control_observations,
            self.survey.control,
            correction,
            "control",
            reasons,
            self.estimate.left_out,
        )
        none = [CHECK_REASON] * len(self.check_observations)
        rows += target_rows(self.check_observations, self.survey.check, correction, "check", none)
        return rows + self.unseen

    @property
    def accuracy(self):
        """Accuracy by ASPRS 2023, as report.json has it: mlscorr.accuracy."""
        return accuracy(
            self.check_observations,
            self.survey.check,
            self.control_observations,
            self.survey.control,
            self.estimate.correction,
            self.estimate.left_out,
        )

    def _statistics(self, observations, points: ControlPoints):
        return before_and_after(observations, points, self.estimate.correction)

    def write(self, out, overwrite=False, progress=None, sigma=False):
        """Write corrected clouds, trajectory, targets and report into a folder.

        With sigma, each point gets the fields sigma_easting, sigma_northing and sigma_height.

        The folder appears whole or not at all. Returns the document of report.json. Raises
        ValueError when the folder holds an input, or holds anything without overwrite; OSError
        when writing fails.
        """
        from mlscorr.report import view_cloud, write_pictures, write_report

        check_output(out, input_files(self.survey.path), overwrite)
        correction = self.estimate.correction
        with output_folder(out) as folder:
            files, outside = self._write_clouds(folder, progress or silent, sigma)
            report = document("report", self._report(files, outside))
            write_trajectory_csv(folder / "trajectory.csv", self.trajectory)
            write_targets_csv(folder / "targets.csv", report["targets"])
            made = ("corrected trajectory", "trajectory.csv"), ("targets", "targets.csv")
            report["outputs"] = [described(what, folder / name) for what, name in made]
            write_json(folder / "report.json", report)
            seen = view_cloud(self.survey, correction, report["targets"], progress or silent)
            page = folder / "report.html"
            write_report(page, self.survey, correction, report, seen, self.fitted)
            (folder / "pictures").mkdir()
            write_pictures(folder / "pictures", self.survey, correction, report)
        return report

    @property
    def point_sigma(self):
        """PointSigma of the corrected cloud: ``.at(xyz, gps_time)`` gives (n, 3) in m."""
        correction = self.estimate.correction
        return PointSigma.of(correction, self.survey.scanner, self.survey.mounting)

    def _write_clouds(self, folder, progress, sigma):
        """The corrected clouds; rows of report.json, and points outside (trajectory, control)."""
        first, last = self.estimate.span
        files, outside_trajectory, outside_control = [], 0, 0
        done = progress("Writing the cloud", sum(file.points for file in self.survey.clouds))

        def watch(times):
            nonlocal outside_control
            outside_control += int(np.count_nonzero((times < first) | (times > last)))
            done(len(times))

        correction, point_sigma = self.estimate.correction, self.point_sigma if sigma else None
        for file in self.survey.clouds:
            target = folder / file.path.name
            outside_trajectory += write_corrected(file, target, correction, watch, point_sigma)
            files.append({"name": file.path.name, "points": file.points, "sha256": sha256(target)})
        return files, (outside_trajectory, outside_control)

    def _report(self, files, outside):
        epochs = np.unique(self.control_observations.gps_time[self.estimate.used])
        return {
            "name": self.survey.name,
            "crs": self.survey.crs,
            "notes": list(self.survey.notes),
            "targets": self.targets,
            "control": self.control,
            "check": self.check,
            "accuracy": self.accuracy,
            "model": model_section(self.estimate),
            "coverage": {
                "control_span": list(self.estimate.span),
                "longest_gap_s": float(np.diff(epochs).max(initial=0.0)),
                "points_outside_trajectory": outside[0],
                "points_outside_control": outside[1],
            },
            "files": files,
            "inputs": [described(what, path) for what, path in named_files(self.survey.path)],
        }


def described(what, path):
    """A file as a row of report.json."""
    return {"what": what, "name": path.name, "bytes": path.stat().st_size, "sha256": sha256(path)}
