"""Error of a position and orientation system, from its causes.

Satellites and reflections cause the errors of GNSS fixes; noise, biases, scale factors and
misalignments those of the sensors. Free inertial navigation integrates the latter. A Kalman filter
and smoother, with their own assumptions, combine both to the recorded data. Nothing is drawn from a
covariance function, because the estimator must not be tested on its own model.
"""

import numpy as np
from numpy.random import Generator

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.trajectories import PosErrorSeries, read_pos_error_series
from mlscorr.simulate.pos._inertial import GRADES
from mlscorr.simulate.pos.navigation import PosError, interpolate, navigate
from mlscorr.simulate.scenario import PosScenario
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Trajectory


def pos_error(
    trajectory: Trajectory,
    scenario: PosScenario,
    rng: Generator,
    sky: np.ndarray | None = None,
    start: float | None = None,
) -> PosError:
    """Simulate the PosError at the epochs of one pass.

    Parameters
    ----------
    trajectory : Trajectory
        True trajectory, without gaps.
    scenario : PosScenario
    rng : Generator
    sky : (n, 2) array, optional
        Elevation below which the sky is hidden to the left and right; needed for sky_view.
        Units: rad.
    start : float, optional
        gps_time from which outages and canyons count; by default the first epoch of the pass.

    Raises ValueError for a trajectory with gaps, a missing sky, or a file that is too short.
    """
    if len(trajectory.gaps):
        raise ValueError(
            f"The true trajectory has {len(trajectory.gaps)} gaps (first at "
            f"{trajectory.gaps[0, 0]:.3f} s), but the error of the POS is simulated for one pass "
            "at a time."
        )
    if scenario.error_file is not None:
        return given_error(trajectory, read_pos_error_series(scenario.error_file), rng)
    if scenario.sky_view and sky is None:
        raise ValueError("sky_view needs the elevation of the walls along the road.")
    sky = sky if scenario.sky_view else None
    navigation = navigate(trajectory, scenario, GRADES[scenario.grade], rng, sky, start)
    return navigation.at(trajectory.gps_time, smoothed=scenario.processing == "smoothed")


def given_error(trajectory: Trajectory, series: PosErrorSeries, rng: Generator) -> PosError:
    """Make the PosError from a random section of a PosErrorSeries.

    The sigmas are the RMS of the series within 15 s, of E and N, and of roll and pitch, together.

    Parameters
    ----------
    trajectory : Trajectory
    series : PosErrorSeries
    rng : Generator

    Raises
    ------
    ValueError
        If the series is shorter than the pass.
    """
    duration = trajectory.gps_time[-1] - trajectory.gps_time[0]
    spare = series.gps_time[-1] - series.gps_time[0] - duration
    if spare < 0:
        raise ValueError(
            f"The error series lasts {series.gps_time[-1] - series.gps_time[0]:.1f} s, the pass "
            f"{duration:.1f} s. Use a longer series or a shorter pass."
        )
    begin = series.gps_time[0] + rng.uniform(0.0, spare)
    gps_time = np.minimum(begin + trajectory.gps_time - trajectory.gps_time[0], series.gps_time[-1])
    smallest = SETTINGS.smallest_position_sigma, SETTINGS.smallest_attitude_sigma
    errors = series.position, series.attitude
    sigmas = [
        np.maximum(_local_rms(series.gps_time, values), floor)
        for values, floor in zip(errors, smallest, strict=True)
    ]
    columns = (interpolate(gps_time, series.gps_time, values) for values in (*errors, *sigmas))
    return PosError(*columns)


def record(trajectory: Trajectory, error: PosError) -> Trajectory:
    """Make the trajectory that the POS records from a true one.

    Parameters
    ----------
    trajectory : Trajectory
        True trajectory.
    error : PosError
    """
    angles = np.column_stack(angles_from_attitude(trajectory.attitude)) + error.attitude
    return Trajectory(
        trajectory.gps_time,
        trajectory.position + error.position,
        attitude_from_angles(*angles.T),
        error.position_sigma,
        error.attitude_sigma,
    )


def _local_rms(gps_time, values):
    """RMS (n, 3) of values (n, 3) within a time window, the first two axes together."""
    first = np.searchsorted(gps_time, gps_time - SETTINGS.error_window / 2)
    last = np.searchsorted(gps_time, gps_time + SETTINGS.error_window / 2, side="right")
    total = np.vstack([np.zeros(3), np.cumsum(values**2, axis=0)])
    mean = (total[last] - total[first]) / (last - first)[:, None]
    mean[:, :2] = mean[:, :2].mean(axis=1, keepdims=True)
    return np.sqrt(mean)
