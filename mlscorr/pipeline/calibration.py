"""``calibrate``: from a survey to its lever arm and boresight."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from mlscorr.evaluate.target_rows import unseen_rows
from mlscorr.io.las import sample_gps_times
from mlscorr.io.output import document, output_folder
from mlscorr.pipeline.calibrated_survey import (
    CalibratedSurvey,
    write_calibrated_survey,
    write_calibration,
)
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.pipeline.tied_calibration import estimate_site
from mlscorr.survey import Survey
from mlscorr.survey.summary import Summary


def calibrate(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: bool | None = None,
) -> CalibratedSurvey | CalibratedScanners:
    """Estimate what a survey's recorded mounting lacks by its targets, and what passes both saw.

    Parameters
    ----------
    survey : Survey
        Where it has several scanners, each is calibrated by its own files in turn.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : bool, optional
        Whether planes and poles that two passes both saw take part; where they do, less than 3
        control points, or none, are enough. What survey.toml says by default.

    Returns
    -------
    CalibratedSurvey, or CalibratedScanners where there are several
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
    if not survey.scanners:
        return _calibrated(survey, "", rng, progress, ties)
    parts = {}
    for name, part in survey.by_scanner.items():
        try:
            parts[name] = _calibrated(part, f"Scanner {name}: ", rng, progress, ties)
        except ValueError as error:
            raise ValueError(f"Scanner {name}: {error}") from error
    return CalibratedScanners(survey, parts)


def _calibrated(survey, title, rng, progress, ties):
    """The CalibratedSurvey of one scanner, with its title before each warning."""
    if survey.mounting is None:
        raise ValueError(
            f"{survey.path} has no [mounting]: a calibration needs the lever_arm (m) and boresight "
            "(deg) that the cloud was georeferenced with. Add that section."
        )
    warn_of_scanners(survey)
    ties = survey.use_ties if ties is None else ties
    control, check, finding, calibration = estimate_site(survey, ties, rng, progress)
    for sentence in calibration.warnings:
        warnings.warn(f"{title}{sentence}", stacklevel=3)
    missing = unseen_rows(survey, finding.matches.refusals, finding.candidates, finding.scanned)
    return CalibratedSurvey(survey, calibration, control, check, missing)


@dataclass(frozen=True, repr=False)
class CalibratedScanners(Summary):
    """A calibrated survey of several scanners, each by what it saw, and ``write``.

    Parameters
    ----------
    survey : Survey
    by_scanner : dict
        CalibratedSurvey by the scanner's name.
    """

    survey: Survey
    by_scanner: dict[str, CalibratedSurvey]

    def write(
        self,
        out: str | Path,
        with_drift: bool = False,
        clouds: bool = False,
        overwrite: bool = False,
        progress: Callable | None = None,
    ) -> dict:
        """Write calibration.json, and survey.toml with all calibrated mountings, into a folder.

        Parameters
        ----------
        out, clouds, overwrite, progress
            As of ``CalibratedSurvey.write``.
        with_drift : bool
            Can't be: each scanner gives a trajectory of its own.

        Returns
        -------
        dict
            The document of calibration.json.

        Raises
        ------
        ValueError, OSError
            As ``CalibratedSurvey.write`` does.
        """
        if with_drift:
            raise ValueError(
                f"Each of the {len(self.by_scanner)} scanners of {self.survey.path} would give a "
                "trajectory of its own. Calibrate without --with-drift, and run mlscorr correct "
                "with the survey.toml that is written: it finds one drift by all of them."
            )
        content = document("calibration", self.report())
        parts = list(self.by_scanner.values())
        with output_folder(out, self.survey.inputs, overwrite) as folder:
            write_calibration(folder, content)
            if clouds:
                done = (progress or silent)("Writing the cloud", self.survey.points)
                moved = {name: p.calibration.correction() for name, p in self.by_scanner.items()}
                write_clouds(self.survey, folder, moved, done)
            write_calibrated_survey(folder, out, parts, clouds)
        return content

    def report(self) -> dict[str, object]:
        """The content of calibration.json: by scanner what it is of one."""
        scanners = {name: part.report() for name, part in self.by_scanner.items()}
        return {"name": self.survey.name, "scanners": scanners}


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
                "scanners did so, name them as [[scanner]], each with its files and its mounting: "
                "these files are taken to be of one.",
                stacklevel=4,
            )
            return
