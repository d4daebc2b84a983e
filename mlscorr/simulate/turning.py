"""The path of one pass along a way, with a U-turn at its end if asked."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from mlscorr.simulate.pace import smooth_step

WEAVE = 0.25  # m to each side: nobody drives a straight line
WEAVE_LENGTH, WEAVE_TIME = 9.0, 1.2  # m and s a radian of it at least: 0.2 m/s^2 at any speed
FADE = 20.0  # m before a U-turn in which the weaving ends
LATERAL_LIMIT = 100.0  # m beside the centre line, beyond which there is no scene
STEP = 1.5  # m between the samples that a path is drawn through
STEERING = 1.5  # m over which the steering goes from one side to the other


@dataclass(frozen=True)
class Path:
    """A path by its own length (m): position (3,) of what drives, and its cross fall.

    curve: CubicSpline of E, N, H (m, local) and of the fall to the right along the path (rad).
    """

    curve: CubicSpline

    @property
    def length(self):
        """Units: m."""
        return float(self.curve.x[-1])


def draw(line, ground, length, one_pass, speed, radius, phase):
    """Path of a PassScenario along a centre line.

    Parameters
    ----------
    line : CentreLine
    ground : function
        Of s and lateral (n,): height above the line (m) and cross fall to the right (rad), (n,).
    length : float
        Of the way. Units: m.
    one_pass : PassScenario
    speed : float
        Units: m/s.
    radius : float
        Of the U-turn at the end of the way; None for no U-turn. Units: m.
    phase : float
        Of the weaving. Units: rad.
    """
    back = one_pass.direction == "back"
    lateral = -one_pass.lateral if back else one_pass.lateral  # to the vehicle's own right
    q = np.linspace(0.0, length, max(6, round(length / STEP) + 1))
    wave = max(WEAVE_LENGTH, WEAVE_TIME * speed)
    fade = 1.0 if radius is None else smooth_step((length - q) / FADE)
    x = lateral + WEAVE * fade * np.sin(q / wave + phase)
    if radius is not None:
        turn_q, turn_x = u_turn_path(lateral, radius)
        home = -lateral + WEAVE * fade * np.sin(q / wave + 1.7 * phase)
        q = np.concatenate([q, length + turn_q[1:-1], q[::-1]])
        x = np.concatenate([x, turn_x[1:-1], home[::-1]])
    s, x = (length - q, -x) if back else (q, x)
    height, fall = ground(s, x)
    place = line.place(s, x, height)
    _, forward, _ = line.frame(s)
    ahead = np.gradient(place[:, :2], axis=0)
    along = np.einsum("ij,ij->i", ahead, forward[:, :2]) / np.hypot(*ahead.T)
    steps = np.hypot(*np.diff(place[:, :2], axis=0).T)
    table = np.column_stack([place, fall * along])
    return Path(CubicSpline(np.append(0.0, np.cumsum(steps)), table))


def u_turn_path(lateral, radius):
    """A turn from a lane to the lane that mirrors it: (n,) along the way and to the right. m.

    A little out of the way first, then round, as a vehicle must whose circle is wider than the
    road; right-hand traffic turns left and left-hand traffic right.

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
    heading = gaussian_filter1d(heading, STEERING / 2 / step, mode="nearest")
    right = np.append(0.0, np.cumsum(np.sin(heading[:-1]) * step))
    along = np.append(0.0, np.cumsum(np.cos(heading[:-1]) * step))
    share = length / length[-1]
    right += lane - share * (right[-1] + 2 * lane)  # the smoothing leaves some centimetres
    along -= share * along[-1]
    side = 1.0 if lateral >= 0 else -1.0
    return along[::40], side * right[::40]
