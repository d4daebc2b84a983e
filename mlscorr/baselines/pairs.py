"""Pairs of observed and surveyed positions, and tests of whether they determine a method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.baselines._settings import SETTINGS
from mlscorr.survey import Matched

SHAPES = ("point", "line", "plane")  # that targets must not all be on, by dimensions minus one


class Undetermined(ValueError):
    """Error: the control points do not determine a method's parameters; the message explains
    why.
    """


@dataclass(frozen=True)
class CentredPairs:
    """Observed and surveyed positions relative to an origin.

    Parameters
    ----------
    origin : (3,) array
        Units: m.
    observed, misclosure : (n, 3) array
        Position relative to the origin, and surveyed - observed. Units: m.
    sigma : (n,) array
        Sigma of each pair. Units: m.
    targets : int
        Number of different targets; repeated passes do not count.
    """

    origin: np.ndarray
    observed: np.ndarray
    misclosure: np.ndarray
    sigma: np.ndarray
    targets: int

    @classmethod
    def of(cls, matched: Matched) -> CentredPairs:
        """Make the pairs of matched observations, about their weighted mean; Undetermined for
        none.
        """
        if len(matched) == 0:
            raise Undetermined(
                "No control point was found in the cloud; a transformation needs some."
            )
        observations = matched.observations
        variance = np.mean(matched.variance, axis=1)
        weight = 1.0 / variance
        start = np.round(observations.position[0])  # keeps the digits of the mean
        origin = start + np.average(observations.position - start, axis=0, weights=weight)
        return cls(
            origin=origin,
            observed=observations.position - origin,
            misclosure=matched.misclosure,
            sigma=np.sqrt(variance),
            targets=len(set(matched.name)),
        )

    @property
    def weight(self) -> np.ndarray:
        """Weights (n, 1) with sum one."""
        weight = 1.0 / self.sigma**2
        return (weight / weight.sum())[:, None]

    @property
    def mean(self) -> np.ndarray:
        """Weighted mean misclosure (3,). Units: m."""
        return np.sum(self.weight * self.misclosure, axis=0)

    def require(self, dimensions: int, smallest: int, parameters: str, axes: int = 3) -> None:
        """Refuse positions that span too few dimensions.

        Parameters
        ----------
        dimensions : int
            1: not at one point; 2: not on one line; 3: not on one plane.
        smallest : int
            Number of targets.
        parameters : str
            Parameters to determine, for the message.
        axes : int
            Number of leading axes to use.

        Raises
        ------
        Undetermined
        """
        shape = SHAPES[dimensions - 1]
        if self.targets < smallest:
            raise Undetermined(
                f"{parameters} need at least {smallest} control points in the cloud that do not "
                f"lie on one {shape}; there {'is' if self.targets == 1 else 'are'} {self.targets}."
            )
        spread = self.spread(axes)[dimensions - 1]
        sigma = float(np.median(self.sigma))
        digits = 1e-9 * float(np.abs(self.origin).max())
        least = max(SETTINGS.clear_spread * sigma, digits)
        if spread < least:
            raise Undetermined(
                f"{parameters} are not determined: the {self.targets} control points deviate "
                f"from one {shape} by only {spread:.4f} m (RMS). At least {least:.4f} m is "
                f"needed, {SETTINGS.clear_spread:.0f} times the sigma of a misclosure."
            )

    def spread(self, axes: int = 3) -> np.ndarray:
        """RMS extents of the positions along their principal axes, longest first. Units: m."""
        extents = np.zeros(axes)
        weighted = np.sqrt(self.weight) * self.observed[:, :axes]
        singular = np.linalg.svd(weighted, compute_uv=False)
        extents[: len(singular)] = singular
        return extents
