"""``calibrate``: from a survey to its lever arm and boresight."""

import warnings
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mlscorr.calibration import Calibration, estimate_mounting
from mlscorr.evaluation import CHECK_REASON, before_and_after, target_rows, unseen_rows
from mlscorr.io.las import sample_gps_times, write_corrected
from mlscorr.io.output import check_output, document, output_folder, write_json
from mlscorr.io.survey_copy import mounting_values, write_survey_copy
from mlscorr.io.survey_file import FILE_NAME, input_files
from mlscorr.io.trajectory import write_trajectory_csv
from mlscorr.pipeline.finding import find_control, silent
from mlscorr.survey import Survey, TargetObservations

TOGETHER = 0.1  # of the shorter file's time: more than the overlap of two tiles of one scan


def calibrate(survey, rng=None, progress=None):
    """Find the targets of a survey and estimate what its recorded mounting lacks.

    Parameters
    ----------
    survey : Survey
        Of one scanner: a survey.toml holds one mounting.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.

    Returns a CalibratedSurvey. Raises ValueError without a mounting, when fewer than 3 control
    points are found, or all of them at one time. The check points take no part.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> wrong = {"name": "lever_arm", "magnitude": [0.0, 0.0, 0.2]}
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ...     effects=[wrong],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> with warnings.catch_warnings(action="ignore"):  # one pass tells little
    ...     result = mlscorr.calibrate(mlscorr.read_survey(folder))
    >>> round(float(result.calibration.lsc.correction[2]), 1)  # m, up
    0.2
    """
    if survey.mounting is None:
        raise ValueError(
            f"{survey.path} has no [mounting]: a calibration needs the lever_arm (m) and boresight "
            "(deg) that the cloud was georeferenced with. Add that section."
        )
    warn_of_scanners(survey)
    control, check, finding = find_control(survey, rng, progress)
    calibration = estimate_mounting(
        survey.trajectory, survey.mounting, control, survey.control, survey.pos
    )
    for sentence in calibration.warnings:
        warnings.warn(sentence, stacklevel=2)
    unseen = unseen_rows(survey, finding.matches.refusals, finding.candidates)
    return CalibratedSurvey(survey, calibration, control, check, unseen)


@dataclass(frozen=True)
class CalibratedSurvey:
    """A calibrated survey: the calibration, the targets, and ``write``."""

    survey: Survey
    calibration: Calibration
    control_observations: TargetObservations
    check_observations: TargetObservations
    unseen: list[dict] = field(default_factory=list)

    def write(self, out, with_drift=False, clouds=False, overwrite=False, progress=None):
        """Write calibration.json, and survey.toml with the calibrated mounting, into a folder.

        Parameters
        ----------
        out : path
        with_drift : bool
            Estimate the POS error along with the mounting, and write trajectory.csv.
        clouds : bool
            Write the clouds as the calibrated mounting (and trajectory) puts them; survey.toml
            then names these.
        overwrite : bool
        progress : function, optional

        The folder appears whole or not at all. Returns the document of calibration.json. Raises
        as ``CorrectedSurvey.write`` does.
        """
        check_output(out, input_files(self.survey.path), overwrite)
        calibration = self.calibration
        drift = calibration.correction_with_drift() if with_drift else None
        names = [file.path.name for file in self.survey.clouds]
        with output_folder(out) as folder:
            content = document("calibration", self.report(drift))
            write_json(folder / "calibration.json", content)
            if with_drift:
                write_trajectory_csv(folder / "trajectory.csv", drift.corrected)
            if clouds:
                done = (progress or silent)("Writing the cloud", self._points)
                for file in self.survey.clouds:
                    write_corrected(
                        file,
                        folder / file.path.name,
                        drift or calibration.correction(),
                        lambda times: done(len(times)),
                    )
            write_survey_copy(
                self.survey.path,
                folder / FILE_NAME,
                out,
                calibration.lsc.mounting,
                names if clouds else None,
                "trajectory.csv" if clouds and with_drift else None,
            )
        return content

    @property
    def _points(self):
        return sum(file.points for file in self.survey.clouds)

    def report(self, drift=None):
        """The content of calibration.json; drift is a Correction of mounting and POS error."""
        calibration = self.calibration
        content = {
            "name": self.survey.name,
            "mounting": {
                "recorded": _mounting(self.survey.mounting),
                "calibrated": _mounting(calibration.lsc.mounting),
            },
            **{method: self._method(method) for method in ("lsc", "ls")},
            "determined": calibration.determined.tolist(),
            "parameters": _parameters(calibration.parameters),
            "outliers": [vars(outlier) for outlier in calibration.outliers],
            "targets": self._targets(calibration.correction()),
            "warnings": list(calibration.warnings),
            "notes": list(self.survey.notes),
        }
        if drift is not None:
            change = drift.corrected.position - drift.recorded.position
            content["with_drift"] = {
                "control": self._statistics("control", drift),
                "check": self._statistics("check", drift),
                "position_rms": np.sqrt(np.mean(change**2, axis=0)).tolist(),
                "position_largest": np.abs(change).max(axis=0).tolist(),
            }
        return content

    def _method(self, method):
        estimate = getattr(self.calibration, method)
        correction = self.calibration.correction(method)
        turn, sigma = np.degrees([estimate.correction[3:], estimate.sigma[3:]])
        return {
            "lever_arm": {
                "correction": estimate.correction[:3].tolist(),
                "sigma": estimate.sigma[:3].tolist(),
            },
            "boresight": {"correction": turn.tolist(), "sigma": sigma.tolist()},
            "correlation": estimate.correlation.tolist(),
            "sigma0": estimate.sigma0,
            "control": self._statistics("control", correction),
            "check": self._statistics("check", correction),
        }

    def _statistics(self, role, correction):
        if role == "check":
            return before_and_after(self.check_observations, self.survey.check, correction)
        used = self.control_observations[self.calibration.used]
        return before_and_after(used, self.survey.control, correction)

    def _targets(self, correction):
        """Rows of every surveyed point and pass, as in report.json."""
        outliers = {outlier.name: outlier for outlier in self.calibration.outliers}
        reasons = [
            f"outlier: statistic {outliers[name].statistic:.1f} against "
            f"{outliers[name].critical:.1f}"
            if name in outliers
            else None
            for name in self.control_observations.name
        ]
        rows = target_rows(
            self.control_observations, self.survey.control, correction, "control", reasons
        )
        none = [CHECK_REASON] * len(self.check_observations)
        rows += target_rows(self.check_observations, self.survey.check, correction, "check", none)
        return rows + self.unseen


def _mounting(mounting):
    return dict(zip(("lever_arm", "boresight"), mounting_values(mounting), strict=True))


def _parameters(weighed):
    """The POS error's parameters on average, and the probability of each covariance family."""
    names = ("position_scale", "position_time", "attitude_scale", "attitude_time")
    mean = {name: np.exp(sum(p * np.log(getattr(v, name)) for v, p in weighed)) for name in names}
    families = {}
    for parameters, probability in weighed:
        families[parameters.family] = families.get(parameters.family, 0.0) + probability
    return {**{name: float(value) for name, value in mean.items()}, "families": families}


def warn_of_scanners(survey):
    """Warn where two cloud files were measured at the same time, as by two scanners."""
    spans = []
    for file in survey.clouds:
        times = sample_gps_times(file.path)[2] + file.time_constant
        spans.append((times.min(), times.max(), file.path.name))
    spans.sort()
    for (start, end, name), (first, last, other) in pairwise(spans):
        together = min(end, last) - first
        if together > TOGETHER * min(end - start, last - first):
            warnings.warn(
                f"{name} and {other} were measured at the same time for {together:.1f} s. If two "
                "scanners did so, calibrate each with a survey.toml of its own, which names its "
                "files and its mounting: all files here are taken to be of the one mounting.",
                stacklevel=3,
            )
            return
