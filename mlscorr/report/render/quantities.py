"""Quantities shown by color: a number for each point, before and after."""

from dataclasses import dataclass, replace
from functools import cache

import matplotlib
import numpy as np

from mlscorr.correction import Correction, PointSigma
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import AFTER, BEFORE, BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION
from mlscorr.survey import PointCloud, Scanner, Trajectory

COLOURS = ("intensity", "height", "correction", "sigma")
MAPS = {  # all darker than paper at both ends, and readable in gray
    "intensity": "cividis",
    "height": "viridis",
    "correction": "plasma",
    "sigma": "plasma",
}
LABELS = {
    "intensity": ("Intensity, as recorded", ""),
    "height": ("Height", "m"),
    "correction": ("Expected error of each point: its correction before, 1 sigma after", "m"),
    "sigma": ("1 sigma of each point, as stated by the trajectory", "m"),
}
GHOST = "#c9c9c9"  # the other state, in the background
PAIRS = {"visit": (BLUE, VERMILLION, GREEN, ORANGE, SKY, BLACK), "state": (BEFORE, AFTER)}
STATES = ("as recorded", "corrected", "the other of the two")


@dataclass(frozen=True)
class ColourScale:
    """Color scale from a low to a high value, by a power of the share between them.

    Parameters
    ----------
    low, high : float
    exponent : float
        1 is linear; below 1, small values get more of the colors.

    >>> ColourScale(0.0, 0.4, 0.5).middle
    0.1
    """

    low: float
    high: float
    exponent: float = 1.0

    def share(self, value: np.ndarray) -> np.ndarray:
        """Return the position of values on the scale, 0 to 1."""
        return np.clip((value - self.low) / (self.high - self.low), 0, 1) ** self.exponent

    @property
    def middle(self) -> float:
        """Value of the color in the middle."""
        return self.low + (self.high - self.low) * 0.5 ** (1 / self.exponent)


@dataclass(frozen=True)
class CloudPair:
    """Chunk of the cloud before and after its correction.

    For the color correction, the value before is the size of the correction, and after the sigma of
    the corrected trajectory; without one, the size is shown on both sides.

    Parameters
    ----------
    before, after : PointCloud
    sigmas : pair of PointSigma
        None if unknown.
    """

    before: PointCloud
    after: PointCloud
    sigmas: tuple[PointSigma | None, PointSigma | None]

    def values(self, colour: str, splits: tuple[float, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Return values (n,) of a color before and after.

        Besides COLOURS, ``visit`` counts splits before a time, ``state`` separates before and
        after.
        """
        if colour == "state":
            return np.zeros(len(self.before)), np.ones(len(self.after))
        if colour == "visit":
            visit = np.searchsorted(splits, self.before.gps_time).astype(np.float32)
            return visit, visit
        if colour == "intensity":
            return (self.before.intensity,) * 2
        if colour == "height":
            return self.before.xyz[:, 2], self.after.xyz[:, 2]
        if colour == "sigma":
            return self._sigma(0), self._sigma(1)
        x, y, z = (self.after.xyz - self.before.xyz).T
        size = np.sqrt(x * x + y * y + z * z)
        return size, size if self.sigmas[1] is None else self._sigma(1)

    def _sigma(self, side):
        """One sigma in 3D, NaN if unknown."""
        cloud = (self.before, self.after)[side]
        sigma = self.sigmas[side]
        if sigma is None:
            return np.full(len(cloud), np.nan)
        return np.linalg.norm(sigma.at(cloud.xyz, cloud.gps_time), axis=1)


def point_sigma(trajectory: Trajectory | None) -> PointSigma | None:
    """Make the sigma of points from a trajectory's sigmas only; None without any."""
    if trajectory is None or trajectory.position_sigma is None or trajectory.attitude_sigma is None:
        return None
    return PointSigma.of(Correction(trajectory, trajectory), Scanner(range_noise=0, angle_noise=0))


def swatches(colour: str, visits: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs (color, words) of the categories of a picture; empty if it has a scale.

    Parameters
    ----------
    colour : str
    visits : tuple of str
        Name of each visit.
    """
    if colour == "state":
        return tuple(zip((*PAIRS[colour], GHOST), STATES, strict=True))
    palette = PAIRS.get(colour, ())
    return tuple((palette[k % len(palette)], words) for k, words in enumerate(visits) if palette)


def percentiles(values: np.ndarray) -> np.ndarray:
    """Ends of a color scale, so that single bright points do not darken the rest."""
    return np.percentile(values, [1.0, 99.0])


def colour_scale(colour: str, *values: np.ndarray) -> ColourScale:
    """Make one scale for all pictures of a view that shows structure in the darkest one, too.

    Its exponent raises the median of the darkest picture to ``SETTINGS.darkest_median``. Without
    it, a cloud with a few centimeters compared with decimeters, or a road near a bright target,
    would be uniformly dark.

    Parameters
    ----------
    colour : str
    *values : (h, w) arrays
        NaN for empty pixels.
    """
    sides = [side for side in (v[np.isfinite(v)] for v in values) if len(side)]
    if colour in PAIRS or not sides:
        return ColourScale(0.0, 1.0)
    low, high = percentiles(np.concatenate(sides)).tolist()
    if colour == "height":
        return ColourScale(low, max(high, low + 1e-3))
    linear = ColourScale(0.0, max(high, 1e-3))  # with its own low, noise would fill the whole scale
    darkest = min(float(np.median(linear.share(side))) for side in sides)
    darkest = max(darkest, SETTINGS.darkest_median**SETTINGS.strongest_power)
    exponent = min(1.0, np.log(SETTINGS.darkest_median) / np.log(min(darkest, 0.999)))
    return replace(linear, exponent=float(exponent))


def paint(colour: str, value: np.ndarray, scale: ColourScale) -> np.ndarray:
    """RGB (..., 3) uint8 of values, grey where the value is NaN.

    Parameters
    ----------
    colour : str
    value : (...) array
    scale : ColourScale
    """
    if colour in PAIRS:
        return rgb(*PAIRS[colour])[np.nan_to_num(value).astype(int) % len(PAIRS[colour])]
    picture = colour_table(colour)[np.nan_to_num(scale.share(value) * 255).astype(np.uint8)]
    picture[np.isnan(value)] = rgb(GREY)
    return picture


@cache
def colour_table(colour: str) -> np.ndarray:
    """Colors of a scale from its low to its high end: (256, 3) uint8."""
    highest = 1.0 if colour == "intensity" else 0.85  # beyond it is too pale on white
    table = matplotlib.colormaps[MAPS[colour]](np.linspace(0.0, highest, 256))
    return (table[:, :3] * 255).round().astype(np.uint8)


def rgb(*names: str) -> np.ndarray:
    """Colors by name as RGB (n, 3) uint8."""
    return (np.array([matplotlib.colors.to_rgb(name) for name in names]) * 255).round().astype("u1")
