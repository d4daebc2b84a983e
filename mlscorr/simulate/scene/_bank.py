"""The cross-section of a river bank."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Bank:
    """The cross-section of a bank.

    Parameters
    ----------
    shore, meander : float
        From the boat's line to the water's edge, and its swing. Units: m.
    top : float
        Height of the promenade above the water. Units: m.
    slope : float
        Width of a bank that rises to the promenade, by 22 deg. Units: m.
    promenade, fronts, beyond : float
        Inland of the shore: edges of the promenade, of the house fronts, of all. Units: m.
    setback : float
        By which the fronts vary. Units: m.
    step, tread : float
        Of steps that end where the slope does. Units: m.
    """

    shore: float = 14.0
    meander: float = 2.0
    top: float = 3.0
    slope: float = 7.5
    promenade: float = 9.0
    fronts: float = 12.0
    beyond: float = 30.0
    setback: float = 6.0
    step: float = 0.15
    tread: float = 0.375

    def profile(self, kind: str) -> list[tuple[float, float, float]]:
        """Columns inland of the shore and above the water (m), with the reflectance to the next.

        Parameters
        ----------
        kind : str
            quay, slope or steps.
        """
        inland = [(self.promenade, self.top, 0.45), (self.beyond, self.top + 0.4, 0.0)]
        if kind == "quay":
            return [(0.0, -1.0, 0.35), (0.0, self.top, 0.3), *inland]
        if kind == "slope":
            return [(-1.5, -0.6, 0.5), (self.slope, self.top, 0.3), *inland]
        steps = range(1 + round(self.top / self.step))
        stairs = [(i * self.tread, z * self.step, 0.4) for i in steps for z in (i - 1, i)]
        return stairs + inland

    def height(self, kind: str, inland: float | np.ndarray) -> np.ndarray:
        """Height (...) of a profile above the water, inland of its steepest parts. Units: m.

        Parameters
        ----------
        kind : str
            quay, slope or steps.
        inland : (...) array
            Of the shore. Units: m.
        """
        x, z, _ = np.array(self.profile(kind)).T
        return np.interp(inland, x, z)
