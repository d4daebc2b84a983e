"""What lies near surveyed points; sentences where control is lacking, not found, or used before."""

import warnings
from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.evaluate import BeamCheck
from mlscorr.io.surveys import ProjectParts
from mlscorr.pipeline.beam_origin import with_beam_origin
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import CloudFile, PointCloud, Survey, SurveyFileError
from mlscorr.targets import BY_EDGES, Candidates, search_radius, why_useless
from mlscorr.wording import counted


class NearPoints:
    """Points near surveyed points that were looked at: their number and intensities.

    Attributes
    ----------
    beams : BeamCheck
    is_scanned : (b,) bool array
        Which surveyed points have points about them.
    is_present : (65536,) bool array
        Which intensities they have.
    points : int
    of_file : dict
        The survey of each CloudFile about which something was asked, with the place of its scanner.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self.beams = BeamCheck(survey)
        self.points = 0
        self.survey = survey
        self.of_file = {}
        self.is_scanned = np.zeros(len(survey.surveyed), bool)
        self.is_present = np.zeros(1 << 16, bool)

    @property
    def intensity_range(self) -> str:
        """The darkest and the brightest, in words."""
        present = np.flatnonzero(self.is_present)
        return f"intensity {present[0]} to {present[-1]}"

    def survey_of(self, file: CloudFile) -> Survey:
        """The survey of the scanner that wrote a file, with the scanner's place.

        Parameters
        ----------
        file : CloudFile
        """
        if file not in self.of_file:
            self.of_file[file] = with_beam_origin(self.survey.of(file), file)
        return self.of_file[file]

    def warnings(self) -> Iterator[str]:
        """Sentences on files whose beams can't have been measured so, or come from nowhere."""
        yield from self.beams.warnings()
        for file, survey in self.of_file.items():
            if survey.mounting is None and survey.beam_origin is None:
                yield (
                    f"{survey.path} gives no [mounting], and the beams of {file.name} don't show "
                    "where the scanner was: it is taken to be at the navigation centre. Plates "
                    "that stand free may be missed or found centimetres off; give lever_arm and "
                    "boresight under [mounting]."
                )

    def add(self, cloud: PointCloud) -> None:
        """Count more of them.

        Parameters
        ----------
        cloud : PointCloud
        """
        self.points += len(cloud)
        self.is_present[cloud.intensity.astype(np.uint16)] = True

    def add_ball(self, index: int, cloud: PointCloud) -> None:
        """Look whether any of the points of a surveyed point, from there (m), lies about it."""
        some = cloud.xyz[:: SETTINGS.scanned_stride]
        self.is_scanned[index] |= (np.linalg.norm(some, axis=1) < SETTINGS.scanned_radius).any()

    def warn_of_intensity(self, survey: Survey) -> None:
        """Warn where bright targets are surveyed and the intensity can't tell them.

        Parameters
        ----------
        survey : Survey
        """
        if self.points:
            reason = why_useless(np.flatnonzero(self.is_present))
        else:
            reason = None
        if reason is not None and not set(survey.surveyed.kind) <= set(BY_EDGES):
            warnings.warn(
                f"{reason} Bright targets can't be told by it: only plates that stand free are "
                "found, by their edges, and painted ones are not. Export the cloud with its "
                "intensity.",
                stacklevel=3,
            )


def check_control(survey: Survey | ProjectParts) -> None:
    """Refuse a survey or project without control points.

    Parameters
    ----------
    survey : Survey or ProjectParts

    Raises
    ------
    ValueError
        A SurveyFileError where no list of them is named.
    """
    if len(survey.control) == len(survey.check) == 0:
        is_named = any(file.what == "control" for file in survey.inputs)
        raise (ValueError if is_named else SurveyFileError)(
            f"{survey.path} gives no control points: it has no section [control], or the file "
            "named there is empty. A correction needs surveyed points, or passes that overlap with "
            "--ties-only; mlscorr extract lists the targets of a cloud without them."
        )
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} names {counted(len(survey.check), 'check point')} and no control "
            "point: check points never enter an estimate. Give some of them the role control, or "
            "bring passes that overlap together without any: mlscorr correct --ties-only."
        )


def reuse_warnings(survey: Survey) -> Iterator[str]:
    """Sentences on control points and on a mounting that corrected a survey before.

    Parameters
    ----------
    survey : Survey
    """
    yield from filter(None, [remounting_fault(survey)])
    names = [name for name in survey.control.name if name in survey.corrected_by]
    if names:
        yield (
            f"{len(names)} of {len(survey.control)} control points (first: {names[0]}) have "
            f"corrected the trajectory of {survey.path} before (calibrate --with-drift), and count "
            "twice: sigmas, and what remains at points left out in turn, are too small. Check "
            "points alone can judge the result. Give calibrate --clouds without --with-drift and "
            "correct that survey, or other control points."
        )


def remounting_fault(survey: Survey) -> str:
    """A sentence where clouds are as another mounting put them than is stated; else empty.

    Parameters
    ----------
    survey : Survey
    """
    if not survey.is_remounted:
        return ""
    return (
        f"The clouds of {survey.path} are still as the recorded mounting put them, not as its "
        "calibrated one does ([cloud] mounting): a correction takes the difference for drift, and "
        "a further calibration would count it twice. Run mlscorr calibrate --clouds on the survey "
        "before, and take what that writes; where the clouds were georeferenced anew since, remove "
        "that line."
    )


def no_control(survey: Survey, observations: int) -> str:
    """The sentence for clouds in which check points alone were found.

    Parameters
    ----------
    survey : Survey
    observations : int
        Of them.
    """
    return (
        f"None of the {counted(len(survey.control), 'control point')} was found in the cloud, only "
        f"{counted(observations, 'check point')}, which must not take part in the estimate."
    )


def _other_heights(survey, radius):
    """A sentence where surveyed points lie farther above or below the drive than is searched."""
    place = survey.surveyed.position
    path = survey.trajectory.position
    nearest = cKDTree(path[:, :2]).query(place[:, :2])[1]
    above = float(np.median(place[:, 2] - path[nearest, 2]))
    if abs(above) < radius:
        return ""
    return (
        f" In the median the surveyed points lie {abs(above):.1f} m "
        f"{'above' if above > 0 else 'below'} the trajectory: their heights may be of another "
        "geoid or over an ellipsoid, or in feet."
    )


def nothing_found(survey: Survey, candidates: Candidates, near: NearPoints) -> str:
    """The sentence for a cloud in which no surveyed target was found.

    Parameters
    ----------
    survey : Survey
    candidates : Candidates
    near : NearPoints
    """
    surveyed = survey.surveyed
    radius = search_radius(survey, surveyed).max()
    if len(candidates.unplaced) > near.points:
        return (
            f"No target was found: {len(candidates.unplaced)} of the points near surveyed points "
            "were measured in gaps of the trajectory or outside it. Export the whole trajectory."
        )
    if near.points == 0:
        return (
            f"No point of the cloud lies within {radius:.1f} m of any of the {len(surveyed)} "
            "surveyed points. Are control and cloud in the same CRS and of the same street?"
            f"{_other_heights(survey, radius)}"
        )
    return (
        f"None of the {len(surveyed)} surveyed targets was found among {near.points} points "
        f"within {radius:.1f} m of them ({near.intensity_range}). Targets are circles or squares "
        "of the surveyed size, brighter than what surrounds them: check kind and size in the "
        "control file, and the intensity."
    )
