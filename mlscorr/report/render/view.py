"""What a pair of pictures shows, from where, with which marks; what the user asked of it."""

from dataclasses import dataclass

import numpy as np

from mlscorr.report.render._camera import Camera


@dataclass(frozen=True)
class Mark:
    """A line, an arrow, a symbol or a name over the points.

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
    """One pair of pictures: what it shows, from where, and its marks before and after.

    Parameters
    ----------
    name, title, note : str
    camera : Camera
    colour : str
        One of COLOURS, ``visit`` or ``state``.
    half_depth : float
        Points farther before or behind the focus are left out. Units: m.
    is_cut : bool
        Whether that is decided after the correction, so that both sides show the same points.
    splits : tuple of float
        Times between visits. Units: s.
    visits : tuple of str
        What each visit is called.
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
    visits: tuple[str, ...] = ("scanned at the first visit", "scanned at the second visit")
    marks: tuple[tuple[Mark, ...], tuple[Mark, ...]] = ((), ())


@dataclass(frozen=True)
class PictureOptions:
    """What the user asked of pictures; None and 0 leave it to the view.

    Parameters
    ----------
    size, wide : (int, int)
        Width and height of each picture, and of the overview of a long street. Units: pixels.
    colour : str, optional
    azimuth, elevation, view_angle : float, optional
        As in Camera.towards. Units: deg.
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
        """The camera of a view that would look this way by itself."""
        size = self.size if size is None else size
        azimuth = azimuth if self.azimuth is None else self.azimuth
        if self.elevation is not None:
            elevation = self.elevation
        return Camera.towards(focus, azimuth, elevation, scale, size, self.view_angle)
