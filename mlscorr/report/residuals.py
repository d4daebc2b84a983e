"""Residuals of every target before and after, axis by axis."""

import numpy as np
from matplotlib.lines import Line2D

from mlscorr.report.look import GREY, MARKS, label, legend_above, new_figure, styled
from mlscorr.report.tables import array, group, ordered

MOST_NAMES = 60  # more names would touch each other
SMALLEST_REACH = 0.002  # m


@styled
def residual_figure(survey, correction, document):
    """Misclosures of control and check points, before on the left, after on the right."""
    rows = ordered(document["targets"], "control", "check")
    rows = [row for row in rows if row.get("before") and row.get("after")]
    rows.sort(key=lambda row: np.inf if row["gps_time"] is None else row["gps_time"])
    figure = new_figure(5.8)
    panels = figure.subplots(3, 2, sharex=True, sharey="col")
    reach = [_column(panels[:, i], rows, key) for i, key in enumerate(("before", "after"))]
    panels[0, 0].set_title("Before the correction")
    panels[0, 1].set_title(f"After the correction ({_scale(reach[0] / reach[1])})")
    for axis, panel in enumerate(panels[:, 0]):
        panel.set_ylabel(f"{('Easting', 'Northing', 'Height')[axis]} (m)")
    for panel in panels[2]:
        _name_targets(panel, rows)
    words = {
        "control": "Control point, 1 sigma",
        "check": "Check point (no part in the estimate), 1 sigma",
    }
    handles = [
        Line2D([], [], linestyle="none", label=text, **MARKS[role])
        for role, text in words.items()
        if ordered(rows, role)
    ]
    if handles:
        legend_above(figure, handles)
    return figure


def _scale(ratio):
    """How the right scale differs from the left one, in words.

    >>> _scale(18.24), _scale(1.0), _scale(0.5)
    ('scale 18 times finer', 'same scale', 'scale 2.0 times coarser')
    """
    if 0.95 < ratio < 1.05:
        return "same scale"
    times = max(ratio, 1 / ratio)
    return f"scale {times:.{int(times < 10)}f} times {'finer' if ratio > 1 else 'coarser'}"


def _column(panels, rows, key):
    """Draw one state of all axes with one range; returns half of that range. Units: m."""
    roles = np.array([group(row) for row in rows])
    values, sigma = array(rows, key), np.nan_to_num(array(rows, "sigma"))
    for axis, panel in enumerate(panels):
        panel.axhline(0.0, color=GREY, linewidth=0.8)
        for role in ("control", "check"):
            at = np.flatnonzero(roles == role)
            panel.errorbar(
                at,
                values[at, axis],
                sigma[at, axis],
                linestyle="none",
                elinewidth=0.9,
                **MARKS[role],
            )
    reach = max(SMALLEST_REACH, np.nanmax(np.abs(values) + sigma, initial=0.0)) * 1.08
    panels[0].set_ylim(-reach, reach)
    return reach


def _name_targets(panel, rows):
    """Names under the axis, in the order of time."""
    panel.set_xlim(-0.7, max(len(rows), 1) - 0.3)
    if len(rows) > MOST_NAMES:
        panel.set_xlabel("Targets in the order of time")
        return
    passes = {row["pass"] for row in rows}
    names = [label(row["name"]) + (f" · {row['pass']}" if len(passes) > 1 else "") for row in rows]
    panel.set_xticks(range(len(rows)), names, rotation=90, fontsize=7, parse_math=False)
    panel.set_xlabel("Target" + (" · pass" if len(passes) > 1 else "") + ", in the order of time")
