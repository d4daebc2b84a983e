"""``calibrate``: from a survey to its lever arm and boresight."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import Calibration
from mlscorr.evaluate.rows import TargetRow
from mlscorr.evaluate.scores import score
from mlscorr.evaluate.target_rows import surveyed_rows, unseen_rows
from mlscorr.evaluate.ties import misfit_section
from mlscorr.io.las import sample_gps_times
from mlscorr.io.output import document, output_folder, write_json
from mlscorr.io.survey_copy import mounting_values, write_survey_copy
from mlscorr.io.survey_file import FILE_NAME
from mlscorr.io.trajectory import write_trajectory_csv
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.pipeline.tied_calibration import estimate_site
from mlscorr.survey import Matched, Survey


def calibrate(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: bool | None = None,
) -> CalibratedSurvey:
    """Estimate what a survey's recorded mounting lacks by its targets, and what passes both saw.

    Parameters
    ----------
    survey : Survey
        Of one scanner: a survey.toml holds one mounting.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : bool, optional
        Whether planes and poles that two passes both saw take part; where they do, less than 3
        control points, or none, are enough. What survey.toml says by default.

    Returns
    -------
    CalibratedSurvey
        The check points take no part.

    Raises
    ------
    ValueError
        Without a mounting, and as ``estimate_site``.

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
    ties = survey.use_ties if ties is None else ties
    control, check, finding, calibration = estimate_site(survey, ties, rng, progress)
    for sentence in calibration.warnings:
        warnings.warn(sentence, stacklevel=2)
    missing = unseen_rows(survey, finding.matches.refusals, finding.candidates, finding.scanned)
    return CalibratedSurvey(survey, calibration, control, check, missing)


@dataclass(frozen=True)
class CalibratedSurvey:
    """A calibrated survey: the calibration, the targets, and ``write``.

    Parameters
    ----------
    survey : Survey
    calibration : Calibration
    matched_control, matched_check : Matched
    missing : list of TargetRow
        Surveyed points without an observation.
    """

    survey: Survey
    calibration: Calibration
    matched_control: Matched
    matched_check: Matched
    missing: list[TargetRow] = field(default_factory=list)

    def write(
        self,
        out: str | Path,
        with_drift: bool = False,
        clouds: bool = False,
        overwrite: bool = False,
        progress: Callable | None = None,
    ) -> dict:
        """Write calibration.json, and survey.toml with the calibrated mounting, into a folder.

        Parameters
        ----------
        out : path
            The folder, which appears whole or not at all.
        with_drift : bool
            Estimate the POS error along with the mounting, and write trajectory.csv.
        clouds : bool
            Write the clouds as the calibrated mounting (and trajectory) puts them; survey.toml
            then names these.
        overwrite : bool
        progress : function, optional

        Returns
        -------
        dict
            The document of calibration.json.

        Raises
        ------
        ValueError, OSError
            As ``CorrectedSurvey.write`` does.
        """
        calibration = self.calibration
        drift = calibration.correction_with_drift if with_drift else None
        names = [file.path.name for file in self.survey.clouds]
        with output_folder(out, self.survey.inputs, overwrite) as folder:
            content = document("calibration", self.report(drift))
            write_json(folder / "calibration.json", content)
            if with_drift:
                write_trajectory_csv(folder / "trajectory.csv", drift.corrected)
            if clouds:
                done = (progress or silent)("Writing the cloud", self.survey.points)
                correction = drift or calibration.correction()
                write_clouds(self.survey, folder, correction, lambda times: done(len(times)))
            write_survey_copy(
                self.survey.path,
                folder / FILE_NAME,
                out,
                calibration.lsc.mounting,
                names if clouds else None,
                "trajectory.csv" if clouds and with_drift else None,
            )
        return content

    def report(self, drift: Correction | None = None) -> dict[str, object]:
        """The content of calibration.json.

        Parameters
        ----------
        drift : Correction, optional
            Of mounting and POS error.
        """
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
            "ties": misfit_section(calibration.ties),
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
            return score(self.matched_check, correction).document()
        used = self.matched_control[self.calibration.used]
        return score(used, correction).document()

    def _targets(self, correction):
        """Rows of every surveyed point and pass, as in report.json."""
        points = self.matched_control, self.matched_check
        rows = surveyed_rows(*points, correction, self.calibration.outliers)
        return [row.document() for row in rows + self.missing]


def _mounting(mounting):
    return dict(zip(("lever_arm", "boresight"), mounting_values(mounting), strict=True))


def _parameters(weighed):
    """The POS error's parameters on average, and the probability of each covariance family."""
    names = {"position_scale": "drift_scale", "position_time": "drift_time"}
    names |= {name: name for name in ("attitude_scale", "attitude_time")}
    mean = {
        title: np.exp(sum(p * np.log(getattr(parameters, name)) for parameters, p in weighed))
        for title, name in names.items()
    }
    families = {}
    for parameters, probability in weighed:
        families[parameters.family] = families.get(parameters.family, 0.0) + probability
    return {**{name: float(value) for name, value in mean.items()}, "families": families}


def warn_of_scanners(survey: Survey) -> None:
    """Warn where two cloud files were measured at the same time, as by two scanners.

    Parameters
    ----------
    survey : Survey
    """
    spans = []
    for file in survey.clouds:
        times = sample_gps_times(file.path)[2] + file.time_constant
        spans.append((times.min(), times.max(), file.path.name))
    spans.sort()
    for (start, end, name), (first, last, other) in pairwise(spans):
        overlap = min(end, last) - first
        if overlap > SETTINGS.tile_overlap * min(end - start, last - first):
            warnings.warn(
                f"{name} and {other} were measured at the same time for {overlap:.1f} s. If two "
                "scanners did so, calibrate each with a survey.toml of its own, which names its "
                "files and its mounting: all files here are taken to be of the one mounting.",
                stacklevel=3,
            )
            return
