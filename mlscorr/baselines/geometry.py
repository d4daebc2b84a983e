"""Pairs of observed and surveyed places, and whether they determine what is asked of them."""

from dataclasses import dataclass

import numpy as np

CLEAR = 10.0  # sigmas of spread; with less, noise turns the cloud by more than 0.1 rad / sqrt(n)
SHAPES = {1: "point", 2: "line", 3: "plane"}  # that the targets must not all lie on


class Undetermined(ValueError):
    """The control points can't determine a method's parameters; the sentence tells why."""


@dataclass(frozen=True)
class Pairs:
    """Observed and surveyed places (n, 3) about an origin, and the sigma (n,) of each pair, in m.

    ``targets`` is how many different targets they are; passes over one add none.
    """

    origin: np.ndarray
    observed: np.ndarray
    misclosure: np.ndarray
    sigma: np.ndarray
    targets: int

    @classmethod
    def of(cls, observations, control):
        """The pairs of matched observations, about their weighted mean."""
        rows = [control.name.index(name) for name in observations.name]
        variance = np.einsum("nii->n", observations.covariance) / 3
        variance += np.mean(control.sigma[rows] ** 2, axis=1)
        weight = 1.0 / variance
        start = np.round(observations.position[0])  # keeps the digits of the mean
        origin = start + np.average(observations.position - start, axis=0, weights=weight)
        return cls(
            origin=origin,
            observed=observations.position - origin,
            misclosure=control.position[rows] - observations.position,
            sigma=np.sqrt(variance),
            targets=len(set(observations.name)),
        )

    @property
    def weight(self):
        """Weights (n, 1) of sum one."""
        weight = 1.0 / self.sigma**2
        return (weight / weight.sum())[:, None]

    @property
    def mean(self):
        """Weighted mean misclosure (3,). Units: m."""
        return np.sum(self.weight * self.misclosure, axis=0)

    def require(self, dimensions, fewest, what, axes=3):
        """Raise Undetermined unless the places fill so many dimensions, of the first axes.

        Parameters
        ----------
        dimensions : int
            1: they are apart; 2: not on one line; 3: not on one plane.
        fewest : int
            Number of targets.
        what : str
            What they shall determine, for the sentence.
        """
        if self.targets < fewest:
            raise Undetermined(
                f"{what} need at least {fewest} control points in the cloud that do not lie on "
                f"one {SHAPES[dimensions]}; there {'is' if self.targets == 1 else 'are'} "
                f"{self.targets}."
            )
        spread = self.spread(axes)[dimensions - 1]
        least = max(CLEAR * float(np.median(self.sigma)), 1e-9 * float(np.abs(self.origin).max()))
        if spread < least:
            raise Undetermined(
                f"{what} are not determined: the {self.targets} control points lie on one "
                f"{SHAPES[dimensions]}, from which they differ by {spread:.4f} m (RMS); "
                f"{least:.4f} m would be needed, {CLEAR:.0f} times the sigma of a misclosure."
            )

    def spread(self, axes=3):
        """RMS extents of the places along their principal axes, longest first. Units: m."""
        values = np.zeros(axes)
        found = np.linalg.svd(np.sqrt(self.weight) * self.observed[:, :axes], compute_uv=False)
        values[: len(found)] = found
        return values
