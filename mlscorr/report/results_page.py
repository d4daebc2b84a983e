"""Page of a comparison of two results: summary, difference over time, and a table by target."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.report import style
from mlscorr.report.pages import Page, data_uri

SECTIONS = {  # in order; empty ones are omitted
    "time": "Trajectories",
    "scores": "RMSE",
    "targets": "Targets",
    "model": "Model and coverage",
    "only": "Warnings",
    "files": "Files",
}
AXES = ("Easting", "Northing", "Height")
Curves = tuple[np.ndarray, np.ndarray, Sequence[np.ndarray | None], np.ndarray]


def write_results(path: str | Path, document: dict, curves: Curves) -> None:
    """Write the self-contained page of two results.

    Parameters
    ----------
    path : path
        HTML file.
    document : dict
        Contents of compare_results.json.
    curves : tuple
        Arguments of results_figure.
    """
    there = {
        "targets": bool(document["targets"]),
        "only": any(document["warnings"].values()),
    }
    Page(
        title=f"{document['name']}: two results compared",
        summary="results-summary.html",
        sections={name: title for name, title in SECTIONS.items() if there.get(name, True)},
        content={
            "document": document,
            "sides": ("first", "second"),
            "figures": {"difference": data_uri(style.svg(results_figure(*curves)))},
        },
        prefix="results-",
        styles=("compare.css",),
    ).write(path)


@style.styled
def results_figure(
    gps_time: np.ndarray,
    difference: np.ndarray,
    sigmas: Sequence[np.ndarray | None],
    gaps: np.ndarray,
) -> Figure:
    """Draw the difference of two corrected trajectories over time, with both sigmas.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    difference : (n, 3) array
        Second - first: E, N, H. Units: m.
    sigmas : pair of (n, 3) array or None
        One sigma of the first and of the second result. Units: m.
    gaps : (k, 2) array
        Gaps, which no line crosses. Units: s.
    """
    start = np.floor(gps_time[0])
    figure = style.new_figure(5.6)
    panels = figure.subplots(3, 1, sharex=True)
    band, dashed = sigmas
    for axis, panel in enumerate(panels):
        columns = [difference[:, axis]]
        columns += [part[:, axis] for part in (band, dashed) if part is not None]
        curves = np.column_stack(columns)
        rows = style.thin(curves, gps_time, gaps)
        at, broken = style.break_at_gaps(gps_time[rows], gaps, 1000 * curves[rows])
        panel.axhline(0.0, color=style.GREY, linewidth=0.8)
        if band is not None:
            panel.fill_between(at - start, -broken[:, 1], broken[:, 1], **style.BAND)
        if dashed is not None:
            for sign in (-1, 1):
                panel.plot(at - start, sign * broken[:, -1], **style.SPAN)
        panel.plot(at - start, broken[:, 0], color=style.BLUE)
        panel.set_ylabel(f"{AXES[axis]} (mm)")
        for gap in gaps - start:
            panel.axvspan(*gap, zorder=0.6, linewidth=0, **style.GAP)
    panels[0].set_title("Difference of the corrected positions: second − first")
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")
    handles: list[Artist] = [Line2D([], [], color=style.BLUE, label="Difference")]
    if band is not None:
        handles.append(Patch(**style.BAND, label="1 sigma of the first"))
    if dashed is not None:
        handles.append(Line2D([], [], **style.SPAN, label="1 sigma of the second"))
    style.legend_above(figure, handles, columns=3)
    return figure
