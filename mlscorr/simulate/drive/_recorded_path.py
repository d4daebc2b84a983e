"""A drive along a path that a file gives, moved to where the scenario starts."""

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Slerp

from mlscorr.io.trajectories import read_poses
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import GAP_FACTOR


def read_path(scenario: Scenario) -> list[tuple]:
    """What a scenario's drive file gives, as a list of (elapsed, position, attitude), one a pass.

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
        raise ValueError(
            "drive.file sets path, stops and passes: leave out stops, u_turn and passes."
        )
    poses = read_poses(drive.file)
    steps = np.diff(poses.gps_time)
    ends = np.flatnonzero(steps > GAP_FACTOR * np.median(steps))
    pieces = np.split(np.arange(len(poses)), ends + 1)
    pieces = [piece for piece in pieces if len(piece) >= 5]
    if not pieces:
        raise ValueError(f"{drive.file} has {len(poses)} epochs: too few for a path.")
    start = poses.gps_time[pieces[0][0]], poses.position[pieces[0][0]]
    return [_piece(poses, piece, *start, drive.pose_rate) for piece in pieces]


def _piece(poses, piece, start_time, start, pose_rate):
    time = poses.gps_time[piece] - start_time
    count = int(np.floor((time[-1] - time[0]) * pose_rate + 1e-9)) + 1
    elapsed = time[0] + np.arange(count) / pose_rate
    elapsed[-1] = min(elapsed[-1], time[-1])
    position = smooth(time, poses.position[piece] - start, elapsed)
    attitude = None
    if poses.attitude is not None:
        attitude = Slerp(time, poses.attitude[piece])(elapsed)
    return elapsed, position, attitude


def smooth(time: np.ndarray, position: np.ndarray, elapsed: np.ndarray) -> np.ndarray:
    """Positions (m, 3) at times (m,) by smoothing splines through positions (n, 3).

    Parameters
    ----------
    time, elapsed : (n,), (m,) array
        Units: s.
    position : (n, 3) array
        Units: m.
    """
    share = 0.38  # of the step between sparse positions: smooths 1 cm of a car's path at 1 Hz
    height = 3.0  # times slower in height, in which roads change less and GNSS is worse
    rate = 20.0  # Hz, beyond which positions tell nothing more of a vehicle's path
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
    """Heading and pitch (n,) along a path (n, 3), kept through standstill. Units: rad.

    Parameters
    ----------
    elapsed : (n,) array
        Since the start of the pass. Units: s.
    position : (n, 3) array
        Units: m.

    Raises
    ------
    ValueError
        A path that stands still.
    """
    step = elapsed[1] - elapsed[0]
    east, north, up = np.gradient(position, elapsed, axis=0).T
    speed = np.hypot(east, north)
    moving = speed > SETTINGS.course_speed
    if not moving.any():
        raise ValueError("The path of drive.file stands still: it has no course to look along.")
    heading = np.unwrap(np.arctan2(east[moving], north[moving]))
    pitch = np.arctan2(up[moving], speed[moving])
    columns = [np.interp(elapsed, elapsed[moving], column) for column in (heading, pitch)]
    return [
        gaussian_filter1d(column, SETTINGS.course_time / step, mode="nearest") for column in columns
    ]
