"""One figure for each stage of a correction: targets, misclosures, POS error, scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter

from mlscorr.estimate import Estimate
from mlscorr.evaluate import Score
from mlscorr.report import style
from mlscorr.report.settings import SETTINGS
from mlscorr.report.target_figures import draw_grid, scored_picture
from mlscorr.survey import Matched, Trajectory
from mlscorr.targets import PassTarget

AXES = ("Easting", "Northing", "Height")
SHEET = (4, 3)  # targets across and down: a screen
STATES = {"before": style.BEFORE, "after": style.AFTER, "leave-one-out": style.GREEN}


def targets_figure(targets: Sequence[PassTarget]) -> Figure:
    """Draw targets one by one, only the highest scores if they do not fit a screen.

    Parameters
    ----------
    targets : sequence of (pass number, FittedTarget)
    """
    columns = SHEET[0]
    room = SHEET[0] * SHEET[1]
    best = sorted(range(len(targets)), key=lambda row: -targets[row][1].score)[:room]
    lines = max(1, -(-len(best) // columns))
    width, height = SETTINGS.target_figure
    with matplotlib.rc_context(style.STYLE):
        figure = style.NotebookFigure(
            figsize=(columns * width, lines * height + 0.4), layout="constrained"
        )
        title = f"{len(targets)} targets found"
        if len(best) < len(targets):
            title += f" (the {len(best)} with the highest scores)"
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        pictures = []
        for row in sorted(best):
            number, target = targets[row]
            pictures.append(scored_picture(target, f"row {row}", number))
        draw_grid(figure, pictures, columns)
    return figure


@style.styled
def misclosure_figure(control: Matched, check: Matched, trajectory: Trajectory) -> Figure:
    """Draw misclosures (surveyed - observed) over time, axis by axis, with one sigma.

    Parameters
    ----------
    control, check : Matched
    trajectory : Trajectory
        Its start is time zero in the figure.
    """
    figure = style.new_figure(5.2)
    panels = figure.subplots(3, 1, sharex=True)
    start = np.floor(trajectory.gps_time[0])
    groups = {"control": control, "check": check}
    for axis, panel in enumerate(panels):
        panel.axhline(0.0, color=style.GREY, linewidth=0.8)
        panel.set_ylabel(f"{AXES[axis]} (m)")
        for name, matched in groups.items():
            mark = {"linestyle": "none", "elinewidth": 0.9, "capsize": 2.0, **style.MARKS[name]}
            sigma = np.sqrt(matched.variance[:, axis])
            panel.errorbar(matched.gps_time - start, matched.misclosure[:, axis], sigma, **mark)
    panels[0].set_title("Misclosures: surveyed − observed")
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")
    words = {"control": "Control point, 1 sigma", "check": "Check point, 1 sigma"}
    roles = {name for name, matched in groups.items() if len(matched)}
    style.legend_above(figure, style.mark_handles(words, roles))
    return figure


@style.styled
def pos_error_figure(estimate: Estimate) -> Figure:
    """Draw the position correction over time with its sigma, and the observations behind it.

    Parameters
    ----------
    estimate : Estimate
    """
    correction = estimate.correction
    corrected = correction.corrected
    time = corrected.gps_time
    gaps = corrected.gaps
    start = np.floor(time[0])
    shift = corrected.position - correction.recorded.position
    sigma = corrected.position_sigma
    figure = style.new_figure(5.6)
    panels = figure.subplots(3, 1, sharex=True)
    for axis, panel in enumerate(panels):
        middle = shift[:, axis]
        curves = np.column_stack([middle - sigma[:, axis], middle, middle + sigma[:, axis]])
        rows = style.thin(curves, time, gaps)
        at, broken = style.break_at_gaps(time[rows], gaps, curves[rows])
        panel.axhline(0.0, color=style.GREY, linewidth=0.8)
        panel.fill_between(at - start, broken[:, 0], broken[:, 2], **style.BAND)
        panel.plot(at - start, broken[:, 1], color=style.BLUE)
        for begin, end in estimate.support.outages:
            panel.axvspan(begin - start, end - start, zorder=0.5, alpha=0.3, **style.OUTAGE)
        for weak in estimate.support.weak:
            panel.axvspan(weak.start - start, weak.end - start, zorder=0.4, **style.OUTSIDE)
        panel.set_ylabel(f"{AXES[axis]} (m)")
    panels[0].set_title("Correction of the position: corrected − recorded, with 1 sigma")
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")
    handles: list[Artist] = [
        Line2D([], [], color=style.BLUE, label="Correction"),
        Patch(**style.BAND, label="1 sigma"),
    ]
    if estimate.support.outages:
        handles.append(Patch(**style.OUTAGE, alpha=0.3, label="GNSS outage"))
    if estimate.support.weak:
        handles.append(Patch(**style.OUTSIDE, label="Extrapolated, outside the control"))
    style.legend_above(figure, handles, columns=4)
    return figure


@style.styled
def score_figure(scores: Mapping[str, Score]) -> Figure:
    """Draw RMSE before, after and leave-one-out, on each axis and in 3D, on a logarithmic scale.

    Parameters
    ----------
    scores : mapping
        By kind of point; empty ones are omitted.
    """
    known = {name: score for name, score in scores.items() if score.before.n}
    figure = style.new_figure(3.2)
    panels = figure.subplots(1, max(len(known), 1), sharey=True, squeeze=False)[0]
    axes = [0, 1, 2, 4]
    for panel, (name, score) in zip(panels, known.items(), strict=False):
        states = {"before": score.before, "after": score.after, "leave-one-out": score.left_out}
        drawn = {state: s for state, s in states.items() if s is not None and s.n}
        width = 0.8 / len(drawn)
        for place, (state, statistics) in enumerate(drawn.items()):
            at = np.arange(4) + (place - (len(drawn) - 1) / 2) * width
            panel.bar(at, statistics.rmse[axes], width, color=STATES[state], label=state)
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.yaxis.set_major_formatter("{x:g}")
        panel.yaxis.set_minor_formatter(NullFormatter())
        panel.set_xticks(range(4), ["E", "N", "H", "3D"])
        panel.set_title(f"{name}: {score.before.n} observations")
    panels[0].set_ylabel("RMSE (m)")
    style.legend_above(figure, [Patch(color=color, label=name) for name, color in STATES.items()])
    return figure
