"""``apply``: removal of known errors of clock, datum or mounting from the clouds."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.effects import Effect
from mlscorr.estimate import corrected_mounting
from mlscorr.io.clouds import written_name
from mlscorr.io.surveys import FILE_NAME, write_survey_copy
from mlscorr.io.trajectories import write_trajectory_csv
from mlscorr.pipeline._result import Reported, ResultFiles
from mlscorr.pipeline.clouds import write_clouds
from mlscorr.pipeline.control_checks import remounting_fault
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.found_effects import CLOCK, DATUM, MOUNTING, TAKEN_OUT, FoundEffects
from mlscorr.survey import Summary, Survey, SurveyFileError, check_survey
from mlscorr.wording import joined


def apply(
    survey: Survey, effects: Iterable[Effect | FoundEffects] | Effect | FoundEffects
) -> AppliedSurvey:
    """Remove effects of known size from a survey: clock offset, mounting, datum.

    Parameters
    ----------
    survey : Survey
        Recorded survey, with the effects.
    effects : iterable of Effect or FoundEffects, or one
        From ``mlscorr.effects.make_effect``, or from ``read_effects`` for the effects found.

    Returns
    -------
    AppliedSurvey
        A clock offset goes into the trajectory (on the scanner's clock from then on) and moves the
        points; a datum moves trajectory and all points to the control; a mounting moves the points.

    Raises
    ------
    ValueError
        For invalid effects, effects that cannot be removed, effects found in other clouds, and a
        mounting effect if there is no mounting, or several, or if the clouds do not match it.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.effects import make_effect
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> late = {"name": "time_offset", "magnitude": 0.02}
    >>> line = {"lines_per_second": 50, "points_per_line": 200}
    >>> short = Scenario(
    ...     drive={"duration": 4.0},
    ...     targets={"control": 2, "check": 1},
    ...     scanner=[line],
    ...     effects=[late],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> applied = mlscorr.apply(mlscorr.read_survey(folder), [make_effect(**late)])
    >>> shift = applied.correction.corrected.position - applied.correction.recorded.position
    >>> round(float(np.median(np.linalg.norm(shift, axis=1))), 2)  # m, at 4 m/s
    0.08
    """
    check_survey(survey)
    parts = _effects_together(effects)
    effects = tuple(effect for part in parts for effect in part.effects)
    stubborn = [effect for effect in effects if effect.name not in TAKEN_OUT]
    if not effects:
        raise ValueError(f"No effect is given; {joined(TAKEN_OUT)} can be removed.")
    if stubborn:
        names = joined([effect.name for effect in stubborn])
        remedies = " ".join(effect.remedy for effect in stubborn)
        raise ValueError(
            f"{names} can't be removed from clouds and trajectory; {joined(TAKEN_OUT)} can. "
            f"{remedies}"
        )
    for part in parts:
        part.check_clouds(survey)
    mounted = [part for part in parts if part.is_of_mounting]
    if mounted:
        survey.check_one_scanner("a mounting that is applied")
        if fault := remounting_fault(survey):
            raise ValueError(fault)
        if survey.mounting is None:
            raise SurveyFileError(
                f"{survey.path} has no [mounting], which {joined(MOUNTING, 'or')} needs. Add the "
                "lever_arm (m) and boresight (deg) with which the cloud was georeferenced."
            )
    correction = _correction(survey, effects)
    mounting = correction.corrected_mounting
    if mounting is None or len(mounted) > 1:  # the accuracy of several together is unknown
        return AppliedSurvey(survey, effects, correction)
    mounting = replace(mounting, covariance=mounted[0].covariance)
    correction = replace(correction, corrected_mounting=mounting)
    return AppliedSurvey(survey, effects, correction, mounted[0].note)


def _effects_together(given) -> list[FoundEffects]:
    """List effects, each alone or as found; raises ValueError for other values."""
    is_list = isinstance(given, Iterable) and not isinstance(given, str)
    effects = tuple(given) if is_list else (given,)
    for effect in effects:
        if not isinstance(effect, Effect | FoundEffects):
            raise ValueError(
                f"{effect!r} is not an effect. Create one with mlscorr.effects.make_effect(name, "
                f"magnitude=size); {joined(TAKEN_OUT)} can be removed."
            )
    return [e if isinstance(e, FoundEffects) else FoundEffects((e,)) for e in effects]


def _correction(survey, effects):
    """Correction from the survey with the effects to that without."""
    recorded = survey.trajectory
    late = 0.0
    shift = np.zeros(3)
    lacks = np.zeros(6)
    for effect in effects:
        size = np.atleast_1d(effect.magnitude)
        if effect.name == CLOCK:
            late += float(size[0])
        elif effect.name == "lever_arm":
            lacks[:3] += size
        elif effect.name == "boresight":
            lacks[3:] += np.radians(size)
        elif effect.name == "horizontal_datum":
            shift[:2] += size
        else:
            shift[2] += size[0]
    times = recorded.gps_time  # a stamp t of the scanner was t - late in the POS clock
    known = recorded.segment(times - late) == recorded.segment(times)
    here = recorded.at(times[known])
    there = recorded.at(times[known] - late)
    moved = replace(there, gps_time=here.gps_time, position=there.position + shift)
    if not lacks.any():
        return Correction(here, moved, datum=shift)
    mounting = corrected_mounting(survey.mounting, lacks)
    return Correction(here, moved, survey.mounting, mounting, datum=shift)


@dataclass(frozen=True, repr=False)
class AppliedSurvey(Summary):
    """Survey without the removed effects, and ``write``.

    Parameters
    ----------
    survey : Survey
        Recorded survey.
    effects : tuple of Effect
        Removed effects.
    correction : Correction
        Correction of trajectory and mounting.
    note : str
        Origin of the sigmas of the mounting.
    """

    survey: Survey
    effects: tuple[Effect, ...]
    correction: Correction
    note: str = ""

    def write(
        self, out: str | Path, overwrite: bool = False, progress: Callable | None = None
    ) -> dict:
        """Write clouds, survey.toml, applied.json and, if it changes, trajectory.csv into a folder.

        Parameters
        ----------
        out : path
            Folder, written atomically.
        overwrite : bool
        progress : function, optional

        Returns
        -------
        dict
            Document of applied.json.

        Raises
        ------
        ValueError, OSError
            See ``CorrectedSurvey.write``.
        """
        survey = self.survey
        by_time = [effect.name for effect in self.effects if effect.name not in DATUM]

        def clouds(folder):
            done = (progress or silent)("Writing the cloud", survey.points)
            return write_clouds(survey, folder, self.correction, done)

        content = self._files(out, by_time).write(out, overwrite, clouds)
        self._warn(content, by_time)
        return content

    def _files(self, out, by_time):
        """Write trajectory.csv if it changes, survey.toml and applied.json."""
        survey = self.survey
        correction = self.correction
        mounting = correction.corrected_mounting
        tables = {}
        trajectory = None
        if any(effect.name not in MOUNTING for effect in self.effects):
            trajectory = "trajectory.csv"
            tables[trajectory] = lambda path: write_trajectory_csv(path, correction.corrected)
        tables[FILE_NAME] = lambda path: write_survey_copy(
            survey.path,
            path,
            out,
            [] if mounting is None else [mounting],
            [[written_name(file.path) for file in p.clouds] for p in survey.by_scanner.values()],
            trajectory,
            survey.corrected_by,
            [] if mounting is None else [self.note],
        )

        def report(written):
            effects = [effect.document() for effect in self.effects]
            files = [
                {"name": path.name, "points": points, "untouched": outside if by_time else 0}
                for path, points, outside in written.clouds
            ]
            return Reported({"name": survey.name, "effects": effects, "files": files}, {})

        return ResultFiles("applied", survey.inputs, report, tables)

    def _warn(self, content, by_time):
        """Warn of clouds that are now torn, and of an unchanged reference surface."""
        survey = self.survey
        correction = self.correction
        left = sum(row["untouched"] for row in content["files"])
        if left:
            warnings.warn(
                f"{left} of {survey.points} points outside the trajectory or in its gaps keep "
                f"{joined(by_time)}, which depends on time, so the clouds have discontinuities "
                "there. Export the whole trajectory, or clip the clouds to it.",
                stacklevel=3,
            )
        if survey.reference is not None and correction.datum.any():
            components = ", ".join(
                f"{a} {v:+.3f}" for a, v in zip("ENH", correction.datum, strict=True)
            )
            warnings.warn(
                f"The reference surface {survey.reference} was not moved. Move it by {components} "
                "m as well, or remove scene.reference from the new survey.toml.",
                stacklevel=3,
            )
