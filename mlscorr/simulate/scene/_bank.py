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
    step, tread : float
        Of steps that end where the slope does. Units: m.
    meander_length : float
        Of a radian of the shore's swing. Units: m.
    depth : float
        Of quays and walls below the water. Units: m.
    rise : float
        Of the ground beyond the promenade. Units: m.
    foreshore : tuple of float
        Place and height of a slope's lower end, under water. Units: m.
    wall_front, walls, wall_width, parapet : float
        Of the walls between two reaches: how far they reach into the water and beyond a slope's
        upper edge, their width, and their height above the promenade. Units: m.
    quay_wall, quay_top, stones, grass, stairs, paving, wall : float
        Reflectance: of a quay's front, of its top, of a slope's foot, of the slope, of steps, of
        the promenade, of walls between them.
    quays, stairways : tuple of float
        Length of a reach of quay or slope, and of steps between two of them. Units: m.
    """

    shore: float = 14.0
    meander: float = 2.0
    top: float = 3.0
    slope: float = 7.5
    promenade: float = 9.0
    fronts: float = 12.0
    beyond: float = 30.0
    step: float = 0.15
    tread: float = 0.375
    meander_length: float = 45.0
    depth: float = 1.0
    rise: float = 0.4
    foreshore: tuple[float, float] = (-1.5, -0.6)
    wall_front: float = 0.2
    walls: float = 0.5
    wall_width: float = 0.3
    parapet: float = 0.3
    quay_wall: float = 0.35
    quay_top: float = 0.3
    stones: float = 0.5
    grass: float = 0.3
    stairs: float = 0.4
    paving: float = 0.45
    wall: float = 0.35
    quays: tuple[float, float] = (40.0, 70.0)
    stairways: tuple[float, float] = (8.0, 14.0)

    def profile(self, kind: str) -> list[tuple[float, float, float]]:
        """Columns inland of the shore and above the water (m), with the reflectance to the next.

        Parameters
        ----------
        kind : str
            quay, slope or steps.
        """
        inland = [(self.promenade, self.top, self.paving), (self.beyond, self.top + self.rise, 0.0)]
        if kind == "quay":
            quay = [(0.0, -self.depth, self.quay_wall), (0.0, self.top, self.quay_top)]
            return quay + inland
        if kind == "slope":
            return [(*self.foreshore, self.stones), (self.slope, self.top, self.grass), *inland]
        steps = range(1 + round(self.top / self.step))
        stairs = [(i * self.tread, z * self.step, self.stairs) for i in steps for z in (i - 1, i)]
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
