"""What lies near surveyed points, and sentences where no control is given or none found there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.evaluate.beams import BeamCheck
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import Candidates, Neighbourhoods, search_radius


@dataclass
class NearPoints:
    """Points near surveyed points that were looked at: their number and range of intensity.

    Parameters
    ----------
    balls : Neighbourhoods
        About the surveyed points.
    beams : BeamCheck
    is_scanned : (b,) bool array
        Which balls hold points.
    points : int
    darkest, brightest : float
    """

    balls: Neighbourhoods
    beams: BeamCheck
    is_scanned: np.ndarray
    points: int = 0
    darkest: float = np.inf
    brightest: float = -np.inf

    @classmethod
    def of(cls, survey: Survey) -> NearPoints:
        """None yet of a survey."""
        places = survey.surveyed.position
        balls = Neighbourhoods(places, np.full(len(places), SETTINGS.scanned_radius))
        return cls(balls, BeamCheck(survey), np.zeros(len(places), bool))

    def add(self, cloud: PointCloud) -> None:
        """Count more of them.

        Parameters
        ----------
        cloud : PointCloud
            At least one point.
        """
        if not self.is_scanned.all():
            some = cloud.xyz[:: SETTINGS.scanned_stride]
            self.is_scanned |= [len(rows) > 0 for rows in self.balls.each(some)]
        self.points += len(cloud)
        self.darkest = min(self.darkest, float(cloud.intensity.min()))
        self.brightest = max(self.brightest, float(cloud.intensity.max()))


def check_control(survey: Survey) -> None:
    """Refuse a survey without control points.

    Parameters
    ----------
    survey : Survey

    Raises
    ------
    ValueError
    """
    if len(survey.surveyed) == 0:
        raise ValueError(
            f"{survey.path} gives no control points: it has no section [control], or the file "
            "named there is empty. A correction needs surveyed points; mlscorr extract lists the "
            "targets of a cloud without them."
        )
    if len(survey.control) == 0:
        raise ValueError(
            f"{survey.path} names {len(survey.check)} check points and no control point: check "
            "points never enter an estimate. Give some of them the role control."
        )


def _other_heights(survey, radius):
    """A sentence where surveyed points lie farther above or below the drive than is searched."""
    place, path = survey.surveyed.position, survey.trajectory.position
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
        f"within {radius:.1f} m of them (intensity {near.darkest:.0f} to "
        f"{near.brightest:.0f}). Targets are circles or squares of the surveyed size, brighter "
        "than what surrounds them: check kind and size in the control file, and the intensity."
    )
