"""A small figure of each target, so that a surveyor can judge at a glance whether it is one."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, Patch, Polygon
from matplotlib.ticker import MaxNLocator

from mlscorr.evaluate import TargetRow
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import BLUE, MARKS, STYLE, VERMILLION, label, png, styled, wipe
from mlscorr.targets import FittedTarget

BEAMS = ("dark", "bright", "went by")  # 0, 1 and -1 in a TargetView, and so counted as here


@styled
def target_figure(
    target: FittedTarget, name: str | None, pass_number: int, note: str = ""
) -> Figure:
    """One target as a figure of its own.

    Parameters
    ----------
    target : FittedTarget
    name : str or None
    pass_number : int
    note : str
        What is doubtful about it, written in red.
    """
    figure, axes = _blank()
    _draw(axes, target)
    _title(axes, target, name, pass_number, note, bool(note))
    return figure


def _blank():
    """A figure and its axes, with three lines above them.

    A layout that is sought takes a third of the time and cuts the first line.
    """
    figure = Figure(SETTINGS.target_figure)
    return figure, figure.add_axes((0.13, 0.13, 0.85, 0.7))


@styled
def target_drawings(
    rows: list[TargetRow], fitted: dict[tuple[int, float], FittedTarget]
) -> list[tuple[str, bytes]]:
    """Pairs (title, PNG, some 20 kB) of the rows that hold an observation.

    Parameters
    ----------
    rows : list of TargetRow
    fitted : dict
        FittedTarget by (pass number, gps_time).
    """
    drawings = []
    figure, axes = _blank()  # new axes for each would take most of the time
    for row in rows:
        target = fitted.get((row.pass_number, row.gps_time))
        if target is None:
            continue
        note = _doubt(row, target)
        _draw(axes, target)
        _title(axes, target, row.name, row.pass_number, note, bool(note))
        drawings.append((f"{row.name}, pass {row.pass_number}", png(figure)))
        wipe(axes)
    return drawings


def draw_target(
    axes: Axes, target: FittedTarget, name: str | None, pass_number: int, note: str
) -> None:
    """Draw a target into axes of a larger figure; a low score is red.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    target : FittedTarget
    name : str or None
    pass_number : int
    note : str
    """
    _draw(axes, target)
    _title(axes, target, name, pass_number, note, target.score < SETTINGS.low_score)


def _doubt(row, target):
    """Words where a target was not used, or is hardly like one."""
    if row.role == "check":
        return ""
    if not row.used:
        return "not used"
    if target.score < SETTINGS.low_score:
        return f"score {target.score:.2f}"
    return ""


def write_contact_sheet(
    path: str | Path, rows: list[dict], fitted: dict[tuple[int, float], FittedTarget]
) -> None:
    """Write one picture of all targets, those with the highest scores, in order of pass and time.

    Parameters
    ----------
    path : path
        The PNG file.
    rows : list of dict
        Of targets.json. Those without a name are called by their row in targets.csv.
    fitted : dict
        FittedTarget by (pass number, gps_time).
    """
    columns = 6
    best = sorted(rows, key=lambda row: -row["score"])[: 20 * columns]
    best.sort(key=lambda row: (row["pass"], row["gps_time"]))
    lines = max(1, -(-len(best) // columns))
    with matplotlib.rc_context(STYLE):
        width, height = SETTINGS.target_figure
        figure = Figure(figsize=(columns * width, lines * height + 0.7), layout="constrained")
        if rows:
            title = f"{len(rows)} target-like objects"
        else:
            title = "No target-like object was found"
        title += f" (the {len(best)} with the highest scores)" if len(best) < len(rows) else ""
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        if best:
            figure.legend(handles=_legend(), loc="outside lower left", ncols=6)
        for i, row in enumerate(best):
            axes = figure.add_subplot(lines, columns, i + 1)
            target = fitted[row["pass"], row["gps_time"]]
            name = row["name"] or f"row {rows.index(row) + 1}"
            draw_target(axes, target, name, row["pass"], f"score {target.score:.2f}")
    Path(path).write_bytes(png(figure))


def _legend():
    marks = [
        Line2D([], [], linestyle="", **{**MARKS[name], "markersize": 4}, label=f"beam: {name}")
        for name in ("bright", "dark", "went by")
    ]
    ellipse = f"1 sigma of the center, enlarged {SETTINGS.ellipse_scale:g} times"
    return [
        *marks,
        Line2D([], [], color=BLUE, label="fitted outline"),
        Line2D([], [], color=BLUE, linestyle="", marker="+", markersize=8, label="centre"),
        Patch(color=VERMILLION, alpha=0.35, label=ellipse),
    ]


def _draw(axes, target):
    """Points in the plane, outline, centre and its covariance; up is up, seen by the scanner."""
    view = target.view
    outline = target.view.outline
    turn = _upright(target) * 100.0  # cm
    points = (view.points - outline.centre) @ turn.T
    is_round = target.kind in ("circle", "hole")
    half = 75.0 * outline.size * (1.0 if is_round else 1.15)  # cm: its board and what is beside it
    rows = np.flatnonzero(np.abs(points).max(axis=1) < half)
    # so many make a figure of some 20 kB
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), 350)).astype(int)]
    names = np.array(BEAMS)[view.state[rows].astype(int)]
    for name in ("bright", "dark", "went by"):
        axes.plot(*points[rows[names == name]].T, linestyle="", **MARKS[name])
    for patch in _outline(target, turn):
        axes.add_patch(patch)
    axes.add_patch(_ellipse(turn @ outline.covariance @ turn.T))
    axes.plot(0.0, 0.0, "+", color=BLUE, markersize=8)
    axes.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.tick_params(labelsize=6, length=2, pad=1)
    axes.set_xlabel("cm", fontsize=6, labelpad=0)


def _upright(target):
    """Plane axes (2, 2) to right and up as the scanner sees them; of a flat one, up is north."""
    normal = target.normal
    if normal[2] ** 2 < 0.5:
        up = np.array([0.0, 0.0, 1.0])
    else:
        up = np.array([0.0, 1.0, 0.0])
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, normal), up]) @ target.view.axes.T


def _outline(target, turn):
    """Patches of the fitted outline, (0, 0) its centre."""
    outline = target.view.outline
    style = {"fill": False, "edgecolor": BLUE, "linewidth": 1.1}
    radius = 50.0 * outline.size  # cm
    if target.kind in ("circle", "hole"):
        if outline.inner > 0:
            inner = [Circle((0, 0), radius * outline.inner, **style)]
        else:
            inner = []
        return [Circle((0, 0), radius, **style), *inner]
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    edges = outline.size / 2 * np.array([[cos, sin], [-sin, cos]]) @ turn.T  # cm, half edges
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) @ edges
    crossing = [Polygon([-edge, edge], closed=False, **style) for edge in edges]
    return [Polygon(corners, **style), *(crossing if target.kind == "checkerboard" else [])]


def _ellipse(covariance):
    """One sigma of the centre (covariance in cm^2), enlarged."""
    values, axes = np.linalg.eigh(covariance)
    low, high = 2 * SETTINGS.ellipse_scale * np.sqrt(np.maximum(values, 0.0))
    angle = np.degrees(np.arctan2(axes[1, 1], axes[0, 1]))
    return Ellipse((0, 0), high, low, angle=angle, color=VERMILLION, alpha=0.35, linewidth=0)


def _title(axes, target, name, pass_number, note, is_doubtful):
    """Name, note, kind and size; pass, points and sigma; what is doubtful in red."""
    sigma = 1e3 * np.sqrt(np.trace(target.covariance))
    about = "about " if target.size_sigma > 0 else ""
    above = {"transform": axes.transAxes, "color": VERMILLION if is_doubtful else "black"}
    axes.text(0, 1.15, label(name, 12), fontweight="bold", fontsize=8, **above)
    axes.text(1, 1.15, note, fontsize=6.2, ha="right", **above)
    axes.set_title(
        f"{target.kind} {about}{100 * target.size:.0f} cm, pass {pass_number}\n"
        f"{target.points} points, 3D sigma {sigma:.1f} mm",
        **{"fontsize": 6.2, "loc": "left", "pad": 2, "linespacing": 1.1},
    )
