"""What a picture shows by colour: a number for each point, before and after."""

from dataclasses import dataclass

import matplotlib
import numpy as np

from mlscorr.report.look import AFTER, BEFORE, BLUE, GREY, VERMILLION

COLOURS = ("intensity", "height", "correction", "sigma")
MAPS = {  # all darker than the paper at both ends, and readable in grey
    "intensity": "cividis",
    "height": "viridis",
    "correction": "plasma",
    "sigma": "plasma",
}
LABELS = {
    "intensity": ("Intensity, as recorded", ""),
    "height": ("Height", "m"),
    "correction": ("How far off each point is: before, by its correction; after, one sigma", "m"),
    "sigma": ("One sigma of each point, as the trajectory states it", "m"),
}
PERCENTILES = (1.0, 99.0)  # of the pixels drawn: single bright points don't darken all others
DARKEST = 0.85  # the upper end of the colour maps is left out: it is too pale on white
NO_VALUE = GREY
FIRST, SECOND = BLUE, VERMILLION  # two visits of one place
GHOST = "#c9c9c9"  # the other state, behind
PAIRS = {"visit": (FIRST, SECOND), "state": (BEFORE, AFTER)}


@dataclass(frozen=True)
class Chunk:
    """A chunk of the cloud before and after its correction.

    By correction, a point is as far off before as it will be moved, and after as the corrected
    trajectory's sigma says; where there is none, its size is shown on both sides.
    """

    before: object
    after: object
    sigmas: tuple  # PointSigma before and after; None where it isn't known

    def values(self, colour, split=None):
        """Values (n,) of a colour before and after.

        Besides COLOURS, ``visit`` tells times after split, ``state`` before from after.
        """
        if colour == "state":
            return np.zeros(len(self.before)), np.ones(len(self.after))
        if colour == "visit":
            late = (self.before.gps_time > split).astype(np.float32)
            return late, late
        if colour == "intensity":
            return (self.before.intensity,) * 2
        if colour == "height":
            return self.before.xyz[:, 2], self.after.xyz[:, 2]
        if colour == "sigma":
            clouds = (self.before, self.after)
            return tuple(
                np.full(len(c), np.nan) if s is None else s.at(c)
                for s, c in zip(self.sigmas, clouds, strict=True)
            )
        x, y, z = (self.after.xyz - self.before.xyz).T
        size = np.sqrt(x * x + y * y + z * z)
        return size, size if self.sigmas[1] is None else self.sigmas[1].at(self.after)


class PointSigma:
    """One sigma of points in 3D, from the sigmas of a trajectory at the nearest epoch.

    The variance of a point at the arm a from the vehicle is tr(P) + |a|^2 tr(C) - a^T C a, with
    the covariances P of the position and C of the small rotation (from Eq. 7-9).
    """

    def __init__(self, trajectory):
        body = trajectory.attitude_sigma[:, [1, 0, 2]]  # pitch turns about X, roll about Y
        turned = trajectory.attitude.as_matrix() * body[:, None, :]
        self.gps_time = trajectory.gps_time
        self.position = trajectory.position
        self.gaps = trajectory.gaps
        self.variance = (trajectory.position_sigma**2).sum(axis=1)
        self.rotation = turned @ turned.swapaxes(1, 2)

    @classmethod
    def of(cls, trajectory):
        """PointSigma of a trajectory that has sigmas; None for another, or for none."""
        known = trajectory is not None and trajectory.position_sigma is not None
        return cls(trajectory) if known and trajectory.attitude_sigma is not None else None

    def at(self, cloud):
        """Sigma (n,) of the points of a cloud in m; NaN outside the trajectory."""
        time = self.gps_time
        middles = (time[1:] + time[:-1]) / 2
        row = np.searchsorted(middles, cloud.gps_time)
        arm = cloud.xyz - self.position[row]
        rotation = self.rotation[row]
        trace = rotation[:, 0, 0] + rotation[:, 1, 1] + rotation[:, 2, 2]
        square = sum(arm[:, i] * arm[:, i] for i in range(3))
        along = sum(arm[:, i] * rotation[:, i, k] * arm[:, k] for i in range(3) for k in range(3))
        variance = self.variance[row] + square * trace - along
        outside = (cloud.gps_time < time[0]) | (cloud.gps_time > time[-1])
        return np.where(outside, np.nan, np.sqrt(variance))


def limits(colour, *values):
    """Ends of the colour scale for pictures (h, w) of values: one scale for all of them."""
    finite = np.concatenate([v[np.isfinite(v)] for v in values])
    if colour in PAIRS or len(finite) == 0:
        return 0.0, 1.0
    low, high = (float(v) for v in np.percentile(finite, PERCENTILES))
    if colour != "height":  # noise of a target alone would fill the whole scale
        low = 0.0
    return low, max(high, low + 1e-3)


def paint(colour, value, ends):
    """RGB (h, w, 3) uint8 of values (h, w), grey where the value is NaN."""
    if colour in PAIRS:
        return rgb(*PAIRS[colour])[np.nan_to_num(value).astype(int)]
    share = np.clip((value - ends[0]) / (ends[1] - ends[0]), 0, 1)
    level = np.nan_to_num(share * 255).astype(np.uint8)
    picture = colour_table(colour)[level]
    picture[np.isnan(value)] = rgb(NO_VALUE)
    return picture


def colour_table(colour):
    """The colours of a scale from its low to its high end: (256, 3) uint8."""
    highest = 1.0 if colour == "intensity" else DARKEST
    table = matplotlib.colormaps[MAPS[colour]](np.linspace(0.0, highest, 256))
    return (table[:, :3] * 255).round().astype(np.uint8)


def rgb(*names):
    """Colours by name as RGB (n, 3) uint8."""
    return (np.array([matplotlib.colors.to_rgb(name) for name in names]) * 255).round().astype("u1")
