"""The path of one pass along a way, with a U-turn at its end if asked."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from mlscorr.simulate.drive._pace import smooth_step
from mlscorr.simulate.scenario import PassScenario
from mlscorr.simulate.scene import CentreLine, plan_lengths
from mlscorr.simulate.vehicle import Vehicle


@dataclass(frozen=True)
class Path:
    """A path by its own length (m): position (3,) of what drives, and its cross fall.

    curve: CubicSpline of E, N, H (m, local) and of the fall to the right along the path (rad).
    """

    curve: CubicSpline

    @property
    def length(self) -> float:
        """Units: m."""
        return float(self.curve.x[-1])


def draw(
    line: CentreLine,
    ground: Callable,
    length: float,
    leg: PassScenario,
    speed: float,
    vehicle: Vehicle,
    phase: float,
    u_turn: bool = False,
) -> Path:
    """Path of a PassScenario along a centre line.

    Parameters
    ----------
    line : CentreLine
    ground : function
        Of s and lateral (n,): height above the line (m) and cross fall to the right (rad), (n,).
    length : float
        Of the way. Units: m.
    leg : PassScenario
    speed : float
        Units: m/s.
    vehicle : Vehicle
    phase : float
        Of the weaving. Units: rad.
    u_turn : bool
        Whether it turns at the end of the way and comes back.
    """
    back = leg.direction == "back"
    lateral = -leg.lateral if back else leg.lateral  # to the vehicle's own right
    q = np.linspace(0.0, length, max(6, round(length / 1.5) + 1))
    wave = max(vehicle.weave_length, vehicle.weave_time * speed)
    fade = smooth_step((length - q) / 20.0) if u_turn else 1.0  # m before a turn without weaving
    x = lateral + vehicle.weave * fade * np.sin(q / wave + phase)
    if u_turn:
        turn_q, turn_x = u_turn_path(lateral, vehicle.turning_radius)
        home = -lateral + vehicle.weave * fade * np.sin(q / wave + 1.7 * phase)
        q = np.concatenate([q, length + turn_q[1:-1], q[::-1]])
        x = np.concatenate([x, turn_x[1:-1], home[::-1]])
    s, x = (length - q, -x) if back else (q, x)
    height, fall = ground(s, x)
    place = line.place(s, x, height)
    _, forward, _ = line.frame(s)
    ahead = np.gradient(place[:, :2], axis=0)
    along = np.einsum("ij,ij->i", ahead, forward[:, :2]) / np.hypot(*ahead.T)
    table = np.column_stack([place, fall * along])
    return Path(CubicSpline(plan_lengths(place), table))


def u_turn_path(
    lateral: float, radius: float, steering: float = 1.5
) -> tuple[np.ndarray, np.ndarray]:
    """A turn from a lane to the lane that mirrors it: (n,) along the way and to the right. m.

    A little out of the way first, then round, as a vehicle must whose circle is wider than the
    road; right-hand traffic turns left and left-hand traffic right. The steering goes from one side
    to the other over 1.5 m.

    Parameters
    ----------
    lateral : float
        Of the lane. Units: m.
    radius : float
        Units: m.
    steering : float
        Over which it goes from one side to the other. Units: m.

    Examples
    --------
    >>> along, right = u_turn_path(1.5, 6.0)
    >>> right[[0, -1]].round(2), round(float(along.max()))
    (array([ 1.5, -1.5]), 15)
    """
    lane = abs(lateral)
    radius = max(radius, lane)
    swing = np.arccos((lane + radius) / (2 * radius))
    corners = radius * np.cumsum([0.0, swing, np.pi + 2 * swing, swing])
    length = np.linspace(0.0, corners[-1], 40 * int(np.ceil(corners[-1])) + 1)
    heading = np.interp(length, corners, [0.0, swing, -np.pi - swing, -np.pi])
    step = length[1]
    heading = gaussian_filter1d(heading, steering / 2 / step, mode="nearest")
    right = np.append(0.0, np.cumsum(np.sin(heading[:-1]) * step))
    along = np.append(0.0, np.cumsum(np.cos(heading[:-1]) * step))
    share = length / length[-1]
    right += lane - share * (right[-1] + 2 * lane)  # the smoothing leaves some centimetres
    along -= share * along[-1]
    return along[::40], (1.0 if lateral >= 0 else -1.0) * right[::40]
