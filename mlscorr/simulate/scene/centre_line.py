"""Center line of a way: a smooth curve by its own length."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from mlscorr.simulate.scene.shapes import UP
from mlscorr.simulate.settings import SETTINGS
from mlscorr.simulate.vehicle import VEHICLES

# Winding line
BENDS = ((0.85, 1.0), (0.15, 2.2))  # share of the swing, and waves along the line, of two waves
LEAST_BEND = 24.0  # m along the line for a radian of the longer wave
STEEPEST_WAVE = 1.3  # largest slope of the two waves together: 0.85 + 0.15 * 2.2, and some more
SLOPE = 0.03  # rise over run of a street from its start to its end, at most
HILL = 1.2  # m, from the mean height of a street to a top
LEAST_HILL, HILL_TIME = 40.0, 5.0  # m and s, for a radian of the hills: at most 3 %


@dataclass(frozen=True)
class CentreLine:
    """Smooth curve by its length s (m): position (3,) at ground level, and heading."""

    curve: CubicSpline

    def frame(self, s: float | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, unit forward and horizontal unit right vector, (..., 3), at s (...).

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        """
        forward = self.curve(s, 1)
        forward = forward / np.linalg.norm(forward, axis=-1, keepdims=True)
        right = np.cross(forward, UP)
        return self.curve(s), forward, right / np.linalg.norm(right, axis=-1, keepdims=True)

    def place(
        self, s: float | np.ndarray, lateral: float | np.ndarray, height: float | np.ndarray
    ) -> np.ndarray:
        """Return points (..., 3) at a distance to the right of the line and a height above it. m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        lateral : (...) array
            To the right of the line. Units: m.
        height : (...) array
            Above it. Units: m.
        """
        position, _, right = self.frame(np.asarray(s, dtype=float))
        lateral = np.asarray(lateral, dtype=float)[..., None]
        return position + lateral * right + np.asarray(height, dtype=float)[..., None] * UP

    @cached_property
    def _samples(self):
        """Lengths (k,) of samples every meter, and a tree of their plan positions."""
        s = np.arange(self.curve.x[0], self.curve.x[-1], 1.0)
        return s, cKDTree(self.curve(s)[:, :2])

    def height(self, points: np.ndarray) -> np.ndarray:
        """Return the height (n,) of the line at its position nearest to points (n, 2+). Units: m.

        Parameters
        ----------
        points : (n, 2+) array
            Units: m.
        """
        lengths, tree = self._samples
        s = lengths[tree.query(points[:, :2])[1]]
        position, forward, _ = self.frame(s)
        along = np.einsum("ij,ij->i", points[:, :2] - position[:, :2], forward[:, :2])
        return self.curve(s + along)[:, 2]

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the horizontal distance (...) of points (..., 3) from the whole line, to 0.1 m. m.

        Parameters
        ----------
        points : (..., 3) array
            Units: m.
        """
        return self._samples[1].query(np.asarray(points)[..., :2])[0]

    def distance_to_other_parts(
        self, points: np.ndarray, s: np.ndarray, earlier: bool = False, separation: float = 30.0
    ) -> np.ndarray:
        """Return the horizontal distance (n,) of points (n, 3) at s (n,) from other parts.

        Infinite beyond about 10 m, and for a line that does not approach itself. With `earlier`,
        only parts before s count.

        Parameters
        ----------
        points : (n, 3) array
            Units: m.
        s : (n,) array
            Length at their own part. Units: m.
        earlier : bool
            True if only parts before s count.
        separation : float
            Distance along the line beyond which a position belongs to another part. Units: m.
        """
        lengths, tree = self._samples
        # three parts within
        near, number = tree.query(points[:, :2], 64, distance_upper_bound=10.0)
        ahead = np.append(lengths, np.inf)[number] - s[:, None]
        other = ahead < -separation if earlier else np.abs(ahead) > separation
        return np.where(other & np.isfinite(near), near, np.inf).min(axis=1)


def winding_line(
    length: float, turns: float, rng: Generator, kind: str = "street", speed: float = 8.0
) -> CentreLine:
    """Draw a winding line of a length (m), starting at the local origin.

    Its heading swings to each side up to `turns` (deg), in bends wide enough for the speed (m/s).
    A street goes up and down by up to 6 %; a river is level.

    Parameters
    ----------
    length : float
        Units: m.
    turns : float
        Largest change of heading to each side. Units: deg.
    rng : Generator
    kind : str
        Of scene.
    speed : float
        Units: m/s.
    """
    phase = rng.uniform(0.0, 2 * np.pi, 4)
    slope = rng.uniform(-SLOPE, SLOPE)
    swing = np.radians(turns)
    tightest = max(VEHICLES[kind].tightest_bend, speed**2 / SETTINGS.comfort)
    bend = max(LEAST_BEND, STEEPEST_WAVE * swing * tightest)
    s = np.arange(-SETTINGS.margin, length + SETTINGS.margin + 1.0)
    (long, first), (short, second) = BENDS
    wave = long * np.sin(first * s / bend + phase[0]) + short * np.sin(second * s / bend + phase[1])
    heading = phase[3] + swing * wave
    hill = max(LEAST_HILL, HILL_TIME * speed)
    if kind == "river":
        height = np.zeros_like(s)
    else:
        height = HILL * np.sin(s / hill + phase[2]) + slope * s
    plan = cumulative_trapezoid(np.column_stack([np.sin(heading), np.cos(heading)]), s, axis=0)
    curve = CubicSpline(s, np.column_stack([np.vstack([np.zeros(2), plan]), height]))
    return CentreLine(CubicSpline(s, curve(s) - curve(0.0)))


def line_along(position: np.ndarray, smoothing: float = 3.0) -> tuple[CentreLine, float]:
    """Make the CentreLine along positions (n, 3), and its length (m) from the first to the last.

    Standstill adds no length, because positions less than a meter from the previous one are
    dropped. The ends are extended straight, with their slope.

    Parameters
    ----------
    position : (n, 3) array
        Units: m.
    smoothing : float
        Of the line. Units: m.

    Raises
    ------
    ValueError
        If the path is too short for a scene.
    """
    kept = [0]
    for i, place in enumerate(position[:, :2]):
        last = position[kept[-1], :2]
        if abs(place[0] - last[0]) + abs(place[1] - last[1]) >= 1.0:
            kept.append(i)
    path = position[kept]
    s = plan_lengths(path)
    if s[-1] < 2 * smoothing:
        raise ValueError(
            f"The path is {s[-1]:.1f} m long; a scene needs a drive of at least "
            f"{2 * smoothing:.0f} m."
        )
    lengths = np.linspace(0.0, s[-1], round(s[-1]) + 1)
    path = np.column_stack([np.interp(lengths, s, column) for column in path.T])
    path = _extend(gaussian_filter1d(_extend(path), smoothing, axis=0, mode="nearest"))
    # of two extensions; the outer one keeps the filter's end effects away
    ends = 2 * round(SETTINGS.margin)
    s = plan_lengths(path)
    return CentreLine(CubicSpline(s - s[ends], path)), s[-1 - ends] - s[ends]


def plan_lengths(path: np.ndarray) -> np.ndarray:
    """Length (n,) along a polyline in plan, from its first point. Units: m.

    Parameters
    ----------
    path : (n, 2+) array
        Units: m.
    """
    return np.append(0.0, np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T)))


def _extend(path):
    """Path with steps of a meter, extended by the margin at both ends."""
    steps = np.arange(1.0, SETTINGS.margin + 1.0)[:, None]
    before = path[0] - steps[::-1] * (path[5] - path[0]) / 5
    return np.vstack([before, path, path[-1] + steps * (path[-1] - path[-6]) / 5])
