"""Targets: as surveyed, as observed, and both together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.survey.columns import Columns

KINDS = ("circle", "square", "hole", "checkerboard", "board")  # see ControlPoints


@dataclass(frozen=True, repr=False)
class ControlPoints(Columns):
    """Surveyed targets: control points, or check points as another instance.

    Parameters
    ----------
    name : tuple of n str
    position : (n, 3) array
        Units: m.
    sigma : (n, 3) array
        One sigma of E, N, H. Units: m.
    kind : tuple of n str
        ``circle`` (bright disc or ring; size is its diameter), ``square`` (bright plate; its edge),
        ``hole`` (circular, in a board; its diameter), ``checkerboard`` (two white and two black
        quadrants; the edge of all four) or ``board`` (plain plate, recognized by its edges; its
        edge).
    size : (n,) array
        Units: m.
    normal : (n, 3) array
        Unit normal of the target's plane; NaN if it was not surveyed.
    """

    name: tuple[str, ...]
    position: np.ndarray
    sigma: np.ndarray
    kind: tuple[str, ...]
    size: np.ndarray
    normal: np.ndarray

    @classmethod
    def from_arrays(
        cls,
        name: Sequence[str],
        position: ArrayLike,
        sigma: ArrayLike,
        kind: str | Sequence[str],
        size: ArrayLike,
        normal: ArrayLike | None = None,
    ) -> ControlPoints:
        """Make surveyed points from arrays; a value that all of them share may be given once.

        Parameters
        ----------
        name : sequence of n str
            Unique names.
        position : (n, 3) array
            E, N, H. Units: m.
        sigma : (n, 3) or (3,) array
            One sigma of E, N, H. Units: m.
        kind : str or sequence of n str
            One of ``circle``, ``square``, ``hole``, ``checkerboard``, ``board``.
        size : (n,) array or float
            Diameter or edge. Units: m.
        normal : (n, 3) array, optional
            Unit normals of the targets' planes, if surveyed.

        Raises
        ------
        ValueError
            If lengths differ, values are not finite, a name is repeated or a kind is unknown.

        >>> from mlscorr.survey import ControlPoints
        >>> place = [[532_000.0, 3_374_000.0, 42.0], [532_040.0, 3_374_003.0, 42.1]]
        >>> ControlPoints.from_arrays(["T01", "T02"], place, [0.003] * 3, "circle", 0.6)
        ControlPoints(2 rows)
        """
        names = tuple(map(str, name))
        count = len(names)
        places = np.asarray(position, float).reshape(-1, 3)
        kinds = (kind,) * count if isinstance(kind, str) else tuple(kind)
        if normal is None:
            normals = np.full((count, 3), np.nan)
        else:
            normals = np.asarray(normal, float)
        sigmas = np.array(np.broadcast_to(np.asarray(sigma, float), (count, 3)))
        sizes = np.array(np.broadcast_to(np.asarray(size, float), count))
        points = cls(names, places, sigmas, kinds, sizes, normals)
        values = np.column_stack([places, sigmas, sizes])
        if bad := [n for n, row in zip(names, values, strict=True) if not np.isfinite(row).all()]:
            raise ValueError(
                f"{len(bad)} of {count} surveyed points have a position, sigma or size that is "
                f"not finite (first: {bad[0]}). Correct or remove them."
            )
        if twice := [n for n, times in Counter(names).items() if times > 1]:
            raise ValueError(
                f"{len(twice)} names occur twice among {count} surveyed points (first: "
                f"{twice[0]}). Give each point its own name."
            )
        if strange := [k for k in kinds if k not in KINDS]:
            raise ValueError(f"kind = {strange[0]!r} is invalid; valid are {', '.join(KINDS)}.")
        return points

    @classmethod
    def none(cls) -> ControlPoints:
        """Empty set of points."""
        vectors = np.empty((0, 3))
        return cls((), vectors, vectors, (), np.empty(0), vectors)

    @cached_property
    def _row_of(self):
        return {name: row for row, name in reversed(list(enumerate(self.name)))}

    def rows(self, names: tuple[str, ...] | list[str]) -> np.ndarray:
        """Row numbers (k,) of the points with these names.

        Raises
        ------
        KeyError
            If there is no point with a name.
        """
        return np.array([self._row_of[name] for name in names], dtype=int)

    def __add__(self, other: ControlPoints) -> ControlPoints:
        return ControlPoints.concatenate([self, other])


@dataclass(frozen=True, repr=False)
class TargetObservations(Columns):
    """Targets found in the cloud, one row per target and pass.

    Parameters
    ----------
    name : tuple of n (str or None)
        Matched control point.
    pass_number : (n,) int array
        Passes are numbered from 1 in order of time.
    gps_time : (n,) array
        Units: s.
    position : (n, 3) array
        Observed center. Units: m.
    covariance : (n, 3, 3) array
        Units: m^2.
    normal : (n, 3) array
    kind : tuple of n str
    size : (n,) array
        Units: m.
    points : (n,) int array
        Number of points on the target.
    """

    name: tuple[str | None, ...]
    pass_number: np.ndarray
    gps_time: np.ndarray
    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    kind: tuple[str, ...]
    size: np.ndarray
    points: np.ndarray


@dataclass(frozen=True, repr=False)
class Matched(Columns):
    """Observations and their surveyed points, both with n rows.

    Parameters
    ----------
    observations : TargetObservations
    surveyed : ControlPoints
        Point of each observation, repeated for each further observation.
    scanner : (n,) int array, optional
        Index of the scanner of each observation, from 0; zero by default.
    """

    observations: TargetObservations
    surveyed: ControlPoints
    scanner: np.ndarray = None

    def __post_init__(self):
        if self.scanner is None:
            object.__setattr__(self, "scanner", np.zeros(len(self.observations), int))
        super().__post_init__()

    @classmethod
    def by_name(cls, observations: TargetObservations, points: ControlPoints) -> Matched:
        """Pair each observation with the point of its name.

        Raises
        ------
        KeyError
            If there is no such point.
        """
        return cls(observations, points[points.rows(observations.name)])

    @classmethod
    def none(cls) -> Matched:
        """Empty set of observations."""
        empty = np.empty(0)
        vectors = np.empty((0, 3))
        points = ControlPoints.none()
        none = empty.astype(int)
        matrices = np.empty((0, 3, 3))
        return cls(
            TargetObservations((), none, empty, vectors, matrices, vectors, (), empty, none), points
        )

    @property
    def name(self) -> tuple[str, ...]:
        """Names of the surveyed points."""
        return self.surveyed.name

    @property
    def gps_time(self) -> np.ndarray:
        """Times (n,) of the observations, in s."""
        return self.observations.gps_time

    @property
    def misclosure(self) -> np.ndarray:
        """Surveyed - observed (n, 3) in m, to be added to the cloud."""
        return self.surveyed.position - self.observations.position

    @property
    def variance(self) -> np.ndarray:
        """Variance of the misclosure (n, 3) in m^2 from survey and extraction  (Eq. 19)."""
        return self.surveyed.sigma**2 + np.einsum("nii->ni", self.observations.covariance)

    @property
    def point_number(self) -> np.ndarray:
        """Index (n,) of each observation's surveyed point, from 0, in order of appearance."""
        number = {name: i for i, name in enumerate(dict.fromkeys(self.name))}
        return np.array([number[name] for name in self.name], dtype=int)
