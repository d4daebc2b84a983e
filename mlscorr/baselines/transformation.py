"""Corrections that move the whole cloud as one: shift, transformation, rigid, affine.

All are fitted by weighted least squares to the misclosures of control points, about a local origin.
Passes and times are not separated, which is the limit of these methods.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.baselines.pairs import CentredPairs, Undetermined
from mlscorr.survey import Matched, PointCloud


@dataclass(frozen=True)
class Transformation:
    """Transformation x' = x + shift + change (x - origin) with up to 12 parameters.

    Parameters
    ----------
    origin : (3,) array
        Units: m.
    shift : (3,) array
        At the origin. Units: m.
    change : (3, 3) array
        Matrix of the transformation minus the identity, which preserves small digits.

    >>> from mlscorr.survey import PointCloud
    >>> cloud = PointCloud(np.array([[523000.0, 3378000.0, 20.0]]), np.zeros(1), np.zeros(1))
    >>> up = Transformation(cloud.xyz[0], np.array([0.0, 0.0, 0.25]), np.zeros((3, 3)))
    >>> float(up.apply(cloud).xyz[0, 2])
    20.25
    """

    origin: np.ndarray
    shift: np.ndarray
    change: np.ndarray

    def apply(self, cloud: PointCloud) -> PointCloud:
        """Return the transformed PointCloud."""
        increments = self.shift + (cloud.xyz - self.origin) @ self.change.T
        return replace(cloud, xyz=cloud.xyz + increments)


RAW = Transformation(np.zeros(3), np.zeros(3), np.zeros((3, 3)))  # the recorded cloud


def fit_shift(matched: Matched) -> Transformation:
    """Fit a shift by the weighted mean misclosure: 3 parameters.

    Parameters
    ----------
    matched : Matched
        Observed control points.
    """
    pairs = CentredPairs.of(matched)
    return Transformation(pairs.origin, pairs.mean, np.zeros((3, 3)))


def fit_horizontal_and_height(matched: Matched) -> Transformation:
    """Fit plan and height separately (Mao et al. 2015, section 3.1.5).

    The paper states only that the two are solved individually. Here, as usual, the plan has the 4
    parameters of a similarity (shift, rotation, scale), and the height the 3 of an inclined plane,
    or only a mean shift with fewer than 4 targets or with targets on a line.

    Parameters
    ----------
    matched : Matched

    Raises
    ------
    Undetermined
        If all targets have the same position in plan.
    """
    pairs = CentredPairs.of(matched)
    pairs.require(1, 2, "The 4 parameters in plan", axes=2)
    root = np.sqrt(pairs.weight)
    change = np.zeros((3, 3))
    east, north, _ = (root * pairs.observed).T
    misclosure = root * (pairs.misclosure - pairs.mean)
    # scale - 1 = a and turn b: dE = a E - b N, dN = b E + a N
    design = np.vstack([np.column_stack([east, -north]), np.column_stack([north, east])])
    a, b = np.linalg.lstsq(design, misclosure[:, :2].T.ravel(), rcond=None)[0]
    change[:2, :2] = [[a, -b], [b, a]]
    try:
        pairs.require(2, 4, "The inclination of the height", axes=2)
    except Undetermined:
        return Transformation(pairs.origin, pairs.mean, change)
    plan = root * pairs.observed[:, :2]
    change[2, :2] = np.linalg.lstsq(plan, misclosure[:, 2], rcond=None)[0]
    return Transformation(pairs.origin, pairs.mean, change)


def fit_rigid(matched: Matched) -> Transformation:
    """Fit a rigid motion: 6 parameters (Helmert without scale), rotation by Kabsch's algorithm.

    Parameters
    ----------
    matched : Matched

    Raises
    ------
    Undetermined
        For fewer than 3 targets, or targets on one line.
    """
    pairs = CentredPairs.of(matched)
    pairs.require(2, 3, "The 6 parameters of a rigid motion")
    surveyed = pairs.observed + pairs.misclosure - pairs.mean
    turn, _ = Rotation.align_vectors(surveyed, pairs.observed, pairs.weight[:, 0])
    return Transformation(pairs.origin, pairs.mean, turn.as_matrix() - np.eye(3))


def fit_affine(matched: Matched) -> Transformation:
    """Fit an affine transformation: 12 parameters.

    Parameters
    ----------
    matched : Matched

    Raises
    ------
    Undetermined
        For fewer than 4 targets, or targets on one plane.
    """
    pairs = CentredPairs.of(matched)
    pairs.require(3, 4, "The 12 parameters of an affine transformation")
    root = np.sqrt(pairs.weight)
    misclosure = root * (pairs.misclosure - pairs.mean)
    change = np.linalg.lstsq(root * pairs.observed, misclosure, rcond=None)[0].T
    return Transformation(pairs.origin, pairs.mean, change)
