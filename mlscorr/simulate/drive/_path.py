"""Path of a pass: along a way, with an optional U-turn at its end, or from a file."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Slerp

from mlscorr.io.trajectories import read_poses
from mlscorr.simulate.drive._pace import smooth_step
from mlscorr.simulate.scenario import PassScenario, Scenario
from mlscorr.simulate.scene import CentreLine, plan_lengths
from mlscorr.simulate.settings import SETTINGS
from mlscorr.simulate.vehicle import Vehicle
from mlscorr.survey import GAP_FACTOR


@dataclass(frozen=True)
class Path:
    """Path by its own length (m): position (3,) of the vehicle, and its cross fall.

    curve: CubicSpline of E, N, H (m, local) and of the fall to the right along the path (rad).
    """

    curve: CubicSpline

    @property
    def length(self) -> float:
        """Length of the path. Units: m."""
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
    """Make the path of a PassScenario along a center line.

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
        True to turn at the end of the way and come back.
    """
    back = leg.direction == "back"
    lateral = -leg.lateral if back else leg.lateral  # to the vehicle's own right
    q = np.linspace(0.0, length, max(6, round(length / 1.5) + 1))
    wave = max(vehicle.weave_length, vehicle.weave_time * speed)
    fade = smooth_step((length - q) / 20.0) if u_turn else 1.0  # m before a turn, without weaving
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
    """Path (n,) of a U-turn to the opposite lane, along the way and to the right. Units: m.

    It first swings out, as a vehicle with a turning circle wider than the road must. Right-hand
    traffic turns left, left-hand traffic right. The steering goes from one side to the other over
    1.5 m.

    Parameters
    ----------
    lateral : float
        Lateral position of the lane. Units: m.
    radius : float
        Units: m.
    steering : float
        Length over which it changes from one side to the other. Units: m.

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
    right += lane - share * (right[-1] + 2 * lane)  # the smoothing leaves some centimeters
    along -= share * along[-1]
    return along[::40], (1.0 if lateral >= 0 else -1.0) * right[::40]


def read_path(scenario: Scenario) -> list[tuple]:
    """Read a scenario's drive file as a list of (elapsed, position, attitude), one for each pass.

    elapsed (n,) at the pose rate, in s from the file's start; position (n, 3) in m from its first
    position; attitude Rotation, or None where the file has none.

    Parameters
    ----------
    scenario : Scenario
        Its drive names the file: CSV, SBET, GNSS_RTK.pos or poses.

    Raises
    ------
    ValueError
        A file with too few epochs, or a scenario that sets the path too.
    """
    drive = scenario.drive
    if drive.stops or drive.u_turn or drive.passes != type(drive)().passes:
        raise ValueError("drive.file sets path, stops and passes: remove stops, u_turn and passes.")
    poses = read_poses(drive.file)
    steps = np.diff(poses.gps_time)
    ends = np.flatnonzero(steps > GAP_FACTOR * np.median(steps))
    pieces = np.split(np.arange(len(poses)), ends + 1)
    pieces = [piece for piece in pieces if len(piece) >= 5]
    if not pieces:
        raise ValueError(f"{drive.file} has only {len(poses)} epochs, too few for a path.")
    start = poses.gps_time[pieces[0][0]], poses.position[pieces[0][0]]
    return [_piece(poses, piece, *start, drive.pose_rate) for piece in pieces]


def _piece(poses, piece, start_time, start, pose_rate):
    time = poses.gps_time[piece] - start_time
    count = int(np.floor((time[-1] - time[0]) * pose_rate + 1e-9)) + 1
    elapsed = time[0] + np.arange(count) / pose_rate
    elapsed[-1] = min(elapsed[-1], time[-1])
    position = _smooth(time, poses.position[piece] - start, elapsed)
    attitude = None
    if poses.attitude is not None:
        attitude = Slerp(time, poses.attitude[piece])(elapsed)
    return elapsed, position, attitude


def _smooth(time: np.ndarray, position: np.ndarray, elapsed: np.ndarray) -> np.ndarray:
    """Positions (m, 3) at times (m,) from smoothing splines through positions (n, 3).

    Parameters
    ----------
    time, elapsed : (n,), (m,) array
        Units: s.
    position : (n, 3) array
        Units: m.
    """
    share = 0.38  # of the step between sparse positions: smooths 1 cm of a car's path at 1 Hz
    height = 3.0  # times slower in height, where roads change less and GNSS is worse
    rate = 20.0  # Hz, beyond which positions give no more information on the path
    step = np.median(np.diff(time))
    stride = max(1, int(1.0 / (rate * step)))
    rows = np.unique(np.append(np.arange(0, len(time), stride), len(time) - 1))
    if len(rows) > 5 and rows[-1] - rows[-2] < stride / 2:
        rows = np.delete(rows, -2)
    step = np.median(np.diff(time[rows]))
    quiet = max(SETTINGS.path_quiet, share * step)
    columns = []
    for axis, times in enumerate((1.0, 1.0, height)):
        strength = (times * quiet) ** 4 / step
        spline = make_smoothing_spline(time[rows], position[rows, axis], lam=strength)
        columns.append(spline(elapsed))
    return np.column_stack(columns)


def course(elapsed: np.ndarray, position: np.ndarray) -> list[np.ndarray]:
    """Heading and pitch (n,) along a path (n, 3), kept constant at standstill. Units: rad.

    Parameters
    ----------
    elapsed : (n,) array
        Since the start of the pass. Units: s.
    position : (n, 3) array
        Units: m.

    Raises
    ------
    ValueError
        If the path does not move.
    """
    step = elapsed[1] - elapsed[0]
    east, north, up = np.gradient(position, elapsed, axis=0).T
    speed = np.hypot(east, north)
    moving = speed > SETTINGS.course_speed
    if not moving.any():
        raise ValueError("The path of drive.file does not move, so it has no direction.")
    heading = np.unwrap(np.arctan2(east[moving], north[moving]))
    pitch = np.arctan2(up[moving], speed[moving])
    columns = [np.interp(elapsed, elapsed[moving], column) for column in (heading, pitch)]
    return [
        gaussian_filter1d(column, SETTINGS.course_time / step, mode="nearest") for column in columns
    ]
