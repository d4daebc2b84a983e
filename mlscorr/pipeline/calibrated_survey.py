"""Result of the calibration of one scanner, and its files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mlscorr.estimate import MOUNTING_COMPONENTS, SCANNER_COMPONENTS, Calibration
from mlscorr.evaluate import TargetRow, score, surveyed_rows, tie_residual_section
from mlscorr.io.clouds import written_name
from mlscorr.io.surveys import FILE_NAME, mounting_values, write_survey_copy
from mlscorr.io.trajectories import write_trajectory_csv
from mlscorr.pipeline._result import Reported, ResultFiles
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.found_effects import cloud_rows
from mlscorr.survey import Matched, Summary, Survey, rows_frame

if TYPE_CHECKING:
    import pandas


class CalibrationResult(Summary):
    """Files of a calibration, of one scanner or of several calibrated together.

    Parameters
    ----------
    survey : Survey
    """

    survey: Survey

    @property
    def parts(self) -> dict[str, CalibratedSurvey]:
        """Calibration of each scanner by its name."""
        raise NotImplementedError

    def report(self, with_drift: bool = False) -> dict[str, object]:
        """Return the contents of calibration.json."""
        raise NotImplementedError

    def write(
        self,
        out: str | Path,
        with_drift: bool = False,
        clouds: bool = False,
        overwrite: bool = False,
        progress: Callable | None = None,
    ) -> dict:
        """Write calibration.json, its page, and survey.toml with the calibrated mountings.

        Parameters
        ----------
        out : path
            Folder, written atomically.
        with_drift : bool
            True to write the POS error estimated together with the mounting as trajectory.csv.
        clouds : bool
            True to write the clouds for the calibrated mounting (and trajectory); survey.toml then
            names these.
        overwrite : bool
        progress : function, optional

        Returns
        -------
        dict
            Document of calibration.json.

        Raises
        ------
        ValueError, OSError
            See ``CorrectedSurvey.write``.
        """
        survey = self.survey

        def write_corrected(folder):
            done = (progress or silent)("Writing the cloud", survey.points)
            moved = {
                name: _correction(part.calibration, with_drift) for name, part in self.parts.items()
            }
            return write_clouds(survey, folder, moved, done)

        files = self._files(out, with_drift, clouds)
        return files.write(out, overwrite, write_corrected if clouds else None)

    def _files(self, out, with_drift, clouds):
        """Write trajectory.csv, survey.toml, calibration.json and its page."""
        from mlscorr.report import calibration_page

        survey = self.survey
        parts = self.parts.values()
        names = []
        if clouds:
            names = [[written_name(file.path) for file in part.survey.clouds] for part in parts]
        tables = {}
        if with_drift:  # common to all
            drift = next(iter(parts)).calibration.drift
            tables["trajectory.csv"] = lambda path: write_trajectory_csv(path, drift.corrected)
        tables[FILE_NAME] = lambda path: write_survey_copy(
            survey.path,
            path,
            out,
            [part.calibration.lsc.mounting for part in parts],
            names,
            "trajectory.csv" if clouds and with_drift else None,
            [*survey.corrected_by, *(name for part in parts for name in part.used.name)],
            [part.calibration.sigma_note for part in parts],
        )

        def report(written):
            files = [
                {"name": path.name, "points": points, "untouched": outside}
                for path, points, outside in written.clouds or ()
            ]
            read = {"clouds": cloud_rows(survey), "files": files}
            pages = {
                "calibration.html": lambda path, content: calibration_page(content).write(path)
            }
            return Reported(self.report(with_drift) | read, pages)

        return ResultFiles("calibration", survey.inputs, report, tables)


@dataclass(frozen=True, repr=False)
class CalibratedSurvey(CalibrationResult):
    """Calibrated survey: the calibration, the targets, and ``write``.

    Parameters
    ----------
    survey : Survey
    calibration : Calibration
    matched_control, matched_check : Matched
    missing : list of TargetRow
        Surveyed points without an observation.
    warnings : tuple of str
        Sentences on this scanner, and on common parts if it is the only one.
    """

    survey: Survey
    calibration: Calibration
    matched_control: Matched
    matched_check: Matched
    missing: list[TargetRow] = field(default_factory=list)
    warnings: tuple[str, ...] = ()

    @property
    def parts(self) -> dict[str, CalibratedSurvey]:
        """The survey itself, under an empty name."""
        return {"": self}

    @property
    def components(self) -> list[dict]:
        """Rows of the corrections of lever arm (m) and boresight (deg), by component."""
        units = ["m"] * 3 + ["deg"] * 3
        scale = np.where(np.array(units) == "m", 1.0, np.degrees(1.0))
        columns = {"component": MOUNTING_COMPONENTS, "unit": units}
        for name in ("lsc", "ls"):
            estimate = getattr(self.calibration, name)
            columns[f"{name}_correction"] = (estimate.correction * scale).tolist()
            columns[f"{name}_sigma"] = (estimate.sigma * scale).tolist()
        columns["determined"] = self.calibration.determined.tolist()
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def to_frame(self) -> pandas.DataFrame:
        """Return the components as a data frame; requires pandas."""
        return rows_frame(self.components)

    def _overview(self):
        """Return the rows that a notebook shows."""
        rows = [("", "correction", "1 sigma", "", "")]
        for row in self.components:
            numbers = (f"{row[f'lsc_{name}']:.4f}" for name in ("correction", "sigma"))
            if row["determined"]:
                doubt = ""
            else:
                doubt = "not determined by this geometry: equals the sigma stated by the POS"
            rows.append((row["component"], *numbers, row["unit"], doubt))
        return [(f"{self.survey.name}: corrections to the recorded mounting",), *rows]

    def report(self, with_drift: bool = False) -> dict[str, object]:
        """Return the contents of calibration.json, for one scanner.

        Parameters
        ----------
        with_drift : bool
            True to include the POS error.
        """
        from mlscorr.report import calibration_screen

        calibration = self.calibration
        rows = self._rows(self.calibration.correction())
        content = {
            "name": self.survey.name,
            "mounting": {
                "recorded": mounting_values(self.survey.mounting),
                "calibrated": mounting_values(calibration.lsc.mounting),
            },
            **{method: self._method(method) for method in ("lsc", "ls")},
            "determined": calibration.determined.tolist(),
            "scanner_errors": _scanner_errors(calibration.scanner),
            "parameters": _parameters(calibration.parameters),
            "outliers": [outlier.document() for outlier in calibration.outliers],
            "targets": [row.document() for row in rows],
            "ties": tie_residual_section(calibration.ties),
            "warnings": list(self.warnings),
            "notes": list(self.survey.notes),
        }
        if with_drift:
            drift = calibration.correction_with_drift
            change = drift.corrected.position - drift.recorded.position
            content["with_drift"] = {
                "control": self._statistics("control", drift),
                "check": self._statistics("check", drift),
                "ties": tie_residual_section(calibration.ties_with_drift),
                "position_rms": np.sqrt(np.mean(change**2, axis=0)).tolist(),
                "position_largest": np.abs(change).max(axis=0).tolist(),
            }
        return calibration_screen(content, rows) | content

    def _method(self, method):
        estimate = getattr(self.calibration, method)
        correction = self.calibration.correction(method)
        return {
            **estimate_section(estimate.correction, estimate.sigma),
            "correlation": estimate.correlation.tolist(),
            "sigma0": estimate.sigma0,
            "control": self._statistics("control", correction),
            "check": self._statistics("check", correction),
        }

    @property
    def used(self) -> Matched:
        """Control points used in the calibration."""
        return self.matched_control[self.calibration.used]

    def _statistics(self, role, correction):
        return score(self.matched_check if role == "check" else self.used, correction).document()

    def _rows(self, correction):
        """Rows of every surveyed point and pass."""
        points = self.matched_control, self.matched_check
        return surveyed_rows(*points, correction, self.calibration.outliers) + self.missing


def _correction(calibration, with_drift):
    """Correction of the mounting, and of the trajectory if the drift is included."""
    if with_drift:
        return calibration.correction_with_drift
    return calibration.correction()


def estimate_section(correction: np.ndarray, sigma: np.ndarray) -> dict[str, object]:
    """``lever_arm`` (m) and ``boresight`` (deg) of calibration.json, each with its sigma.

    Parameters
    ----------
    correction, sigma : (6,) array
        Units: m and rad.
    """
    values = {"correction": correction, "sigma": sigma}
    return {
        "lever_arm": {name: value[:3].tolist() for name, value in values.items()},
        "boresight": {name: np.degrees(value[3:]).tolist() for name, value in values.items()},
    }


def _scanner_errors(errors):
    """Corrections of ranges (m) and encoder (ratio); None if they were not estimated."""
    if errors is None:
        return None
    columns = {name: values.tolist() for name, values in vars(errors).items()}
    rows = zip(*columns.values(), strict=True)
    names = (component.replace(" ", "_") for component in SCANNER_COMPONENTS)
    return {
        name: dict(zip(columns, row, strict=True)) for name, row in zip(names, rows, strict=True)
    }


def _parameters(weighed):
    """Averaged parameters of the POS error, and the probability of each covariance family."""
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
