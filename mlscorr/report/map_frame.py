"""What all maps share: panels, the track of a drive, equal scales, whole metres as tick labels."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import break_at_gaps, new_figure, thin
from mlscorr.survey import Trajectory
from mlscorr.wording import thousands


def map_panels(count: int, share: float) -> tuple[Figure, np.ndarray]:
    """A figure and its panels (count,): side by side, or one above the other for a long street.

    Parameters
    ----------
    count : int
        Maps of the same place: one or two.
    share : float
        Of its height in its width.
    """
    columns = 2 if share > 0.7 and count > 1 else 1
    # inch: labels and colours
    lines = count // columns
    beside = 1.8
    width = SETTINGS.figure_width / columns - beside
    figure = new_figure(0.8 + lines * (0.35 + width * share))
    return figure, figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()


def track(trajectory: Trajectory) -> np.ndarray:
    """Thinned plan positions (m, 2) of a trajectory, with NaN at its gaps. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    """
    plan = trajectory.position[:, :2]
    rows = thin(plan, trajectory.gps_time, trajectory.gaps)
    return break_at_gaps(trajectory.gps_time[rows], trajectory.gaps, plan[rows])[1]


def corners(points: np.ndarray, thinnest: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner (2,) of a map of points, with a margin. Units: m.

    Parameters
    ----------
    points : (n, 2) array
        NaN where none is known. Units: m.
    thinnest : float
        Least half width of the map over its length: none is a thin line.
    """
    low = np.nanmin(points, axis=0)
    high = np.nanmax(points, axis=0)
    extent = max(float((high - low).max()), 1.0)
    middle = (low + high) / 2
    half = np.maximum((high - low) / 2, thinnest * extent) + 0.04 * extent
    return middle - half, middle + half


def frame(axes: Axes, low: np.ndarray, high: np.ndarray, ticks: int = 5) -> None:
    """Limits, equal scale on both axes, and whole metres as tick labels.

    Parameters
    ----------
    axes : Axes
    low, high : (2,) array
        Corners. Units: m.
    ticks : int
        Intervals of an axis, at most.
    """
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    for axis, name in ((axes.xaxis, "Easting (m)"), (axes.yaxis, "Northing (m)")):
        axis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10], min_n_ticks=2))
        decimals = 0 if np.ptp(axis.get_view_interval()) > 5 else 1
        metres = FuncFormatter(lambda v, _, d=decimals: thousands(v, d))
        axis.set_major_formatter(metres)
        axis.set_label_text(name)
