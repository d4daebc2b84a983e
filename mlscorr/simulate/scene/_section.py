"""The cross-section of a street."""

from dataclasses import dataclass

import numpy as np

from mlscorr.simulate.scenario import DriveScenario
from mlscorr.simulate.vehicle import CAR


@dataclass(frozen=True)
class StreetSection:
    """The cross-section of a street along its length.

    Parameters
    ----------
    road : float
        Half width of the carriageway. Units: m.
    turns : tuple of float
        Lengths about which it widens to `widened`, for a U-turn. Units: m.
    widened : float
        A van's full lock, and room. Units: m.
    turn_reach, turn_taper : float
        From the middle of a U-turn to where the widening ends, and over which it narrows. Units: m.
    pavement, garden : float
        Width from the kerb to the house fronts, and of the ground behind them. Units: m.
    kerb : float
        Height. Units: m.
    cross_fall : float
        Of the carriageway, usual for drainage. Units: ratio.
    clearance : float
        By which other parts of the way may come nearer than a thing's own. Units: m.
    line, line_from_kerb, paint : float
        Width of a painted line, way from its middle to the kerb beside it, thickness of
        thermoplastic paint. Units: m.
    dash : tuple of float
        Length of a dash of the middle line, and of the gap after it, usual in towns. Units: m.
    asphalt, kerbstone, paving, lawn, white_line : float
        Reflectance of the carriageway, of the kerb, of the pavement, of the gardens, of paint.
    """

    road: float = 3.0
    turns: tuple[float, ...] = ()
    widened: float = CAR.turning_radius + 2.0
    turn_reach: float = 20.0
    turn_taper: float = 8.0
    pavement: float = 1.8
    garden: float = 9.0
    kerb: float = 0.12
    cross_fall: float = 0.025
    clearance: float = 0.7
    line: float = 0.12
    line_from_kerb: float = 0.3
    paint: float = 0.003
    dash: tuple[float, float] = (3.0, 6.0)
    asphalt: float = 0.18
    kerbstone: float = 0.35
    paving: float = 0.25
    lawn: float = 0.3
    white_line: float = 0.6

    def half_width(self, s: float | np.ndarray) -> np.ndarray:
        """Half width (...) at lengths s (...). Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        """
        width = np.full(np.shape(s), self.road)
        for middle in self.turns:
            inside = self.turn_reach - np.abs(s - middle)
            depth = np.clip(inside / self.turn_taper, 0.0, 1.0)
            widened = self.road + max(0.0, self.widened - self.road) * depth**2 * (3 - 2 * depth)
            width = np.maximum(width, widened)
        return width

    def height(self, s: float | np.ndarray, lateral: float | np.ndarray) -> np.ndarray:
        """Height (...) of the carriageway above its edge. Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        lateral : (...) array
            To the right of the line. Units: m.
        """
        return self.cross_fall * self.road * (1.0 - np.abs(lateral) / self.half_width(s))

    def under_wheels(
        self, s: float | np.ndarray, lateral: float | np.ndarray, wheels: float = 0.5
    ) -> tuple[np.ndarray, np.ndarray]:
        """Height of a vehicle's middle over the edge (m) and its fall to the right (rad), (...).

        Its wheels (m) smooth the crown.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        lateral : (...) array
            To the right of the line. Units: m.
        wheels : float
            Over which the crown is smoothed. Units: m.
        """
        fall = self.cross_fall * self.road / self.half_width(s)
        smooth = np.hypot(lateral, wheels)
        return self.cross_fall * self.road - fall * smooth, fall * np.asarray(lateral) / smooth


LANE_EDGE = 2.4  # m, from the middle of a lane to the kerb, as cars are parked half on it
TURN_PLACE = 6.0  # m, from the end of the drive to the middle of a U-turn


def section(scenario: DriveScenario, length: float) -> StreetSection:
    """StreetSection of a street wide enough for the lanes of a DriveScenario's passes.

    Parameters
    ----------
    scenario : DriveScenario
    length : float
        Of the drive along the line. Units: m.
    """
    lateral = max(abs(lane.lateral) for lane in scenario.passes)
    ends = {"forward": length + TURN_PLACE, "back": -TURN_PLACE}
    if scenario.u_turn:
        turns = {ends[lane.direction] for lane in scenario.passes}
    else:
        turns = ()
    return StreetSection(max(StreetSection.road, lateral + LANE_EDGE), tuple(sorted(turns)))
