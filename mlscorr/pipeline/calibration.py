"""``calibrate``: from a survey to its lever arm and boresight."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mlscorr.estimate import (
    Calibration,
    control_fault,
    estimate_mounting,
    prior_mounting,
    with_scanner_errors,
)
from mlscorr.evaluate import SEEN_BY_OTHERS, tie_residual_section, unseen_rows
from mlscorr.io.clouds import sample_gps_times
from mlscorr.matching import Refusal
from mlscorr.pipeline.calibrated_survey import CalibratedSurvey, CalibrationResult, estimate_section
from mlscorr.pipeline.control_checks import remounting_fault, reuse_warnings
from mlscorr.pipeline.finding import (
    COLLECTING,
    MatchedTargets,
    find_control,
    find_or_compare_surfaces,
    read_into,
    silent,
)
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import Matched, Survey, SurveyFileError, TieFeatures, check_survey
from mlscorr.ties import tie_mounting

NOTHING_CALIBRATES = (
    "{} can't be calibrated: {} control points were found (at least 3 at different times are "
    "needed), and no planes were scanned in two passes. Drive the road in both directions, or "
    "survey control points on both sides of it, near and far."
)

LOG = logging.getLogger(__name__)


def calibrate(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    ties: bool | None = None,
) -> CalibratedSurvey | CalibratedScanners:
    """Estimate corrections of a survey's recorded mounting from targets and tie features.

    Parameters
    ----------
    survey : Survey
        With several scanners, all mountings and the common POS error are estimated together, from
        the targets of all and from tie features between any two of them.
    rng : numpy.random.Generator, optional
        For the plane fit's random samples; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    ties : bool, optional
        True to use planes and poles in overlaps of passes or scanners; fewer than 3 control points,
        or none, then suffice. By default as stated in survey.toml.

    Returns
    -------
    CalibratedSurvey, or CalibratedScanners for several
        Check points are not used.

    Raises
    ------
    ValueError
        If there is no mounting, or the clouds do not match it; see also ``calibrate_together``.

    >>> import mlscorr, numpy as np, tempfile, warnings
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
    check_survey(survey)
    if fault := remounting_fault(survey):
        raise ValueError(fault)
    for name, part in survey.by_scanner.items():
        if part.mounting is None:
            raise SurveyFileError(
                f"{_title(name)}{survey.path} has no [mounting]. Add the lever_arm (m) and "
                "boresight (deg) with which the cloud was georeferenced."
            )
        warn_of_scanners(part)
    if ties is None:
        ties = survey.use_ties

    stage = progress or silent
    if ties:
        collector = FeatureCollector(survey)
        read = read_into(collector.add)
        finding, notes = find_or_compare_surfaces(survey, read, None, progress, rng)
        stage(COLLECTING)
        features = collector.features()
    else:
        finding = find_control(survey, rng, progress)
        features = None
        notes = ()
    stage("Calibrating the mounting")
    control, check = _numbered(survey, finding)
    calibration = calibrate_together(survey, control, features, notes)
    LOG.info(
        "mounting calibrated by %d of %d control observations, %d of %d components determined",
        int(calibration.used.sum()),
        len(calibration.used),
        int(calibration.determined.sum()),
        len(calibration.determined),
    )
    for test in calibration.screening.outliers:
        LOG.info("%s not used: contradicted by the others", test.name)

    parts = _parts(survey, control, check, finding, calibration)
    for name, part in parts.items():
        for sentence in part.warnings:
            warnings.warn(f"{_title(name)}{sentence}", stacklevel=2)
    if not survey.scanners:
        return parts[""]
    for sentence in calibration.shared_warnings:
        warnings.warn(sentence, stacklevel=2)
    return CalibratedScanners(survey, calibration, parts)


def _title(name):
    """Prefix of a sentence on a scanner, if there are several."""
    if name:
        return f"Scanner {name}: "
    return ""


def _numbered(survey: Survey, finding: MatchedTargets) -> Iterator[Matched]:
    """Yield the matched control points, then the check points, with the indices of their
    scanners.
    """
    of_pass = finding.scanners
    for matched in finding.matches.by_role(survey):
        scanner = [of_pass[number] for number in matched.observations.pass_number]
        yield replace(matched, scanner=np.array(scanner, int))


def calibrate_together(
    survey: Survey, control: Matched, features: TieFeatures | None, notes: Sequence[str] = ()
) -> Calibration:
    """Calibrate all mountings of a survey from matched control points and tie features.

    Parameters
    ----------
    survey : Survey
        With a mounting of each scanner.
    control : Matched
        With the indices of the scanners.
    features : TieFeatures or None
        None without ties.
    notes : sequence of str
        Sentences on targets that were not found, for the error.

    Raises
    ------
    ValueError
        If a scanner has fewer than 3 control points, or all of them at one time, and there are no
        tie features, or ties are excluded.
    """
    faults = [control_fault(control, number) for number in range(len(survey.mountings))]
    if all(faults):
        estimate = prior_mounting
    else:
        estimate = estimate_mounting
    calibration = estimate(survey.trajectory, survey.mountings, control, survey.pos)
    if features is not None:
        calibration = tie_mounting(survey, calibration, control, features)
    for number, (name, fault) in enumerate(zip(survey.by_scanner, faults, strict=True)):
        own = None
        if calibration.ties is not None:
            own = calibration.ties.of_scanner(number)
        if not fault or (own is not None and own.used.any()):
            continue
        if features is None:
            raise ValueError(f"{_title(name)}{fault}")
        count = len(set(control[control.scanner == number].name))
        nothing = NOTHING_CALIBRATES.format(survey.path, count)
        raise ValueError(_title(name) + " ".join([nothing, *notes]))
    return with_scanner_errors(calibration, control)


def _parts(survey, control, check, finding, calibration):
    """CalibratedSurvey of each scanner by its name, with its own sentences."""
    parts = {}
    of_pass = finding.scanners
    for number, (name, part) in enumerate(survey.by_scanner.items()):
        matched = [points[points.scanner == number] for points in (control, check)]
        refusals = [
            refusal
            for refusal in finding.matches.refusals
            if of_pass.get(refusal.pass_number, number) == number
        ]
        known = {*matched[0].name, *matched[1].name, *(refusal.name for refusal in refusals)}
        others = [point for point in survey.surveyed.name if point not in known]
        refusals += [Refusal(point, None, SEEN_BY_OTHERS) for point in others]
        scanned = finding.scanned.difference(others)
        missing = unseen_rows(part, refusals, finding.candidates, scanned)
        view = calibration.of(number, control.scanner)
        if name:
            sentences = view.own_warnings
        else:
            sentences = view.warnings
        sentences = (*sentences, *reuse_warnings(survey))
        parts[name] = CalibratedSurvey(part, view, *matched, missing, sentences)
    return parts


@dataclass(frozen=True, repr=False)
class CalibratedScanners(CalibrationResult):
    """Survey whose scanners were calibrated together, and ``write``.

    Parameters
    ----------
    survey : Survey
    calibration : Calibration
        Calibration of all mountings, with the common POS error.
    by_scanner : dict
        CalibratedSurvey by name of the scanner.
    """

    survey: Survey
    calibration: Calibration
    by_scanner: dict[str, CalibratedSurvey]

    @property
    def parts(self) -> dict[str, CalibratedSurvey]:
        """Calibrations of ``by_scanner``."""
        return self.by_scanner

    def report(self, with_drift: bool = False) -> dict[str, object]:
        """Return the contents of calibration.json: by scanner, and common parts.

        Parameters
        ----------
        with_drift : bool
            See ``CalibratedSurvey.report``.
        """
        from mlscorr.report import scanners_screen

        first, *others = self.by_scanner
        content = {
            "name": self.survey.name,
            "scanners": {n: part.report(with_drift) for n, part in self.by_scanner.items()},
            "relative": {
                name: {
                    "beside": first,
                    **estimate_section(*self.calibration.lsc.relative_to_first(number)),
                    "fit_sigma": self.calibration.fit_sigma(number),
                }
                for number, name in enumerate(others, start=1)
            },
            "ties": tie_residual_section(self.calibration.ties),
            "warnings": list(self.calibration.shared_warnings),
        }
        return scanners_screen(content) | content


def warn_of_scanners(survey: Survey) -> None:
    """Warn if two cloud files were measured at the same time, as by two scanners.

    Parameters
    ----------
    survey : Survey
    """
    spans = []
    for file in survey.clouds:
        times = file.trajectory_time(sample_gps_times(file.path)[2])
        spans.append((times.min(), times.max(), file.path.name))
    spans.sort()
    for (start, end, name), (first, last, other) in pairwise(spans):
        overlap = min(end, last) - first
        if overlap > SETTINGS.tile_overlap * min(end - start, last - first):
            warnings.warn(
                f"{name} and {other} overlap in time by {overlap:.1f} s. If they come from two "
                "scanners, list these as [[scanner]], each with its files and mounting; one "
                "scanner is assumed.",
                stacklevel=3,
            )
            return
