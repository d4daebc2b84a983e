"""The map of what was seen twice, coloured by how far apart they lie there."""

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report.map_frame import corners, frame, map_panels, track
from mlscorr.report.render import colour_table
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import MARKS, TRACK, legend_above, styled

STATES = ("Before the correction", "After the correction")


@styled
def tie_figure(correction: Correction, residuals: TieResiduals) -> Figure:
    """Plan of the ties, before and after: side by side, or one above the other on a long street.

    Parameters
    ----------
    correction : Correction
    residuals : TieResiduals
        What the correction leaves of the ties.
    """
    way = track(correction.corrected)
    used = residuals.used
    places = residuals.ties.place.mean(axis=1)[:, :2]
    misfits = [1000 * np.abs(v) for v in (residuals.ties.misclosure, residuals.after)]  # mm
    low, high = corners(np.vstack([way, places]), 0.1)
    figure, panels = map_panels(2, (high - low)[1] / (high - low)[0])
    figure.set_dpi(SETTINGS.dots_per_inch)
    largest = max(np.max(misfit[used], initial=10.0) for misfit in misfits)
    scale = {"norm": LogNorm(1.0, largest), "cmap": ListedColormap(colour_table("sigma") / 255)}
    for panel, misfit, title in zip(panels, misfits, STATES, strict=True):
        panel.plot(*way.T, **TRACK, zorder=1)
        panel.plot(*places[~used].T, linestyle="none", zorder=2, rasterized=True, **MARKS["unused"])
        front = np.flatnonzero(used)[np.argsort(misfit[used], kind="stable")]  # the worst on top
        dots = panel.scatter(
            *places[front].T,
            9,
            np.maximum(misfit[front], 1.0),
            linewidths=0,
            zorder=3,
            rasterized=True,
            **scale,
        )
        frame(panel, low, high, 4)
        panel.set_title(title)
        panel.label_outer()
    bar = figure.colorbar(dots, ax=panels, pad=0.01, extend="min", format="%g")
    bar.set_label("How far apart both views lie (mm)")
    legend_above(figure, _legend(used))
    return figure


def _legend(used):
    """Legend entries of what is drawn."""
    handles = [Line2D([], [], label="Trajectory (corrected)", **TRACK)]
    dot = {"linestyle": "none", "marker": "o", "markersize": 3, "color": "#5b2a86"}
    if used.any():
        handles.append(Line2D([], [], label="Seen twice", **dot))
    if not used.all():
        words = "Not used: contradicts the others"
        handles.append(Line2D([], [], linestyle="none", label=words, **MARKS["unused"]))
    return handles
