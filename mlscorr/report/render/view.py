"""Contents of a pair of pictures: camera, marks, and the user's options."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """Camera aimed at a focus, in parallel projection or from a finite distance.

    Parameters
    ----------
    focus : (3,) array
        Point in the middle of the picture. Units: m.
    axes : (3, 3) array
        Unit vectors to the picture's right, up, and away from the eye, as rows.
    scale : float
        Pixels per meter at the focus.
    size : (int, int)
        Width and height in pixels.
    distance : float
        Distance from eye to focus; infinite for parallel projection. Units: m.

    >>> camera = Camera.towards([500000.0, 3e6, 20.0], 0.0, 90.0, 10.0, (800, 600))
    >>> pixel, depth = camera.project(np.array([[500002.0, 3e6 + 1.0, 23.0]]))
    >>> pixel, depth  # 2 m east, 1 m north and 3 m above the focus
    (array([[420., 290.]]), array([-3.]))
    """

    focus: np.ndarray
    axes: np.ndarray
    scale: float
    size: tuple[int, int]
    distance: float = np.inf

    @classmethod
    def towards(
        cls,
        focus: np.ndarray,
        azimuth: float,
        elevation: float,
        scale: float,
        size: tuple[int, int],
        view_angle: float = 0.0,
    ) -> Camera:
        """Make a camera facing an azimuth from an elevation above the horizon.

        Parameters
        ----------
        focus, scale, size
            See Camera.
        azimuth : float
            Clockwise from grid north; from straight above it is the direction up. Units: deg.
        elevation : float
            90 is straight down. Units: deg.
        view_angle : float
            Angle of the picture's whole width, 0 for parallel projection. Units: deg.
        """
        a, e = np.radians([azimuth, elevation])
        right = np.array([np.cos(a), -np.sin(a), 0.0])
        away = np.array([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), -np.sin(e)])
        axes = np.stack([right, np.cross(right, away), away])
        distance = np.inf
        if view_angle:
            distance = size[0] / scale / 2 / np.tan(np.radians(view_angle) / 2)
        return cls(
            np.asarray(focus, float), axes, float(scale), (size[0], size[1]), float(distance)
        )

    def project(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return pixel coordinates (n, 2), column and row, and depth (n,) behind the focus in m.

        Column 0 begins at the left edge, row 0 at the upper one: a point with coordinates in [k, k
        + 1) is on pixel k.
        """
        x, y, depth = self.axes @ (np.asarray(xyz, float) - self.focus).T
        scale = self.scale
        if np.isfinite(self.distance):
            scale = scale * self.distance / (self.distance + depth)
        width, height = self.size
        return np.column_stack([width / 2 + x * scale, height / 2 - y * scale]), depth


@dataclass(frozen=True)
class Mark:
    """Line, arrow, symbol or name over the points.

    Parameters
    ----------
    kind : str
        ``surveyed`` (an outline), ``offset`` and ``residual`` (arrows), ``control``, ``check``
        and ``unused`` (symbols).
    points : (n, 3) array
        Map coordinates. Units: m.
    text : str
    """

    kind: str
    points: np.ndarray
    text: str = ""


@dataclass(frozen=True)
class View:
    """One pair of pictures: camera, color, and marks before and after.

    Parameters
    ----------
    name, title, note : str
    camera : Camera
    colour : str
        One of COLOURS, ``visit`` or ``state``.
    half_depth : float
        Points farther in front of or behind the focus are omitted. Units: m.
    is_cut : bool
        True if that is decided after the correction, so that both sides show the same points.
    splits : tuple of float
        Times between visits. Units: s.
    visits : tuple of str
        Name of each visit.
    marks : pair of tuples of Mark
    """

    name: str
    title: str
    note: str
    camera: Camera
    colour: str
    half_depth: float = np.inf
    is_cut: bool = False
    splits: tuple[float, ...] = ()
    visits: tuple[str, ...] = ("scanned in the first pass", "scanned in the second pass")
    marks: tuple[tuple[Mark, ...], tuple[Mark, ...]] = ((), ())


@dataclass(frozen=True)
class PictureOptions:
    """User's options for pictures; None and 0 leave the choice to the view.

    Parameters
    ----------
    size, wide : (int, int)
        Width and height of each picture, and of the overview of a long street. Units: pixels.
    colour : str, optional
    azimuth, elevation, view_angle : float, optional
        See Camera.towards. Units: deg.
    """

    size: tuple[int, int]
    wide: tuple[int, int] | None = None
    colour: str | None = None
    azimuth: float | None = None
    elevation: float | None = None
    view_angle: float = 0.0

    def camera(
        self,
        focus: np.ndarray,
        azimuth: float,
        elevation: float,
        scale: float,
        size: tuple[int, int] | None = None,
    ) -> Camera:
        """Return the camera of a view with this default direction."""
        size = self.size if size is None else size
        azimuth = azimuth if self.azimuth is None else self.azimuth
        if self.elevation is not None:
            elevation = self.elevation
        return Camera.towards(focus, azimuth, elevation, scale, size, self.view_angle)
