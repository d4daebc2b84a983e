"""A small figure of each target, so that a surveyor can judge at a glance whether it is one."""

import io

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, Patch, Polygon
from matplotlib.ticker import MaxNLocator

from mlscorr.report.look import BLUE, ORANGE, STYLE, VERMILLION, label, styled

POINTS = 350  # most that a figure shows
ELLIPSE = 10  # times: one sigma is too small to be seen
MARGIN = 1.5  # times a target's half extent: its board and what stands beside it
FLAT = 0.7  # vertical part of the normal, from which a target lies rather than stands
LOOKS = {  # of a beam: colour and width in pt
    "bright": (ORANGE, 2.4),
    "dark": ("#3c3c3c", 1.8),
    "went by": ("#9cc9e6", 1.9),
}
STATES = {"bright": 1, "dark": 0, "went by": -1}
COLUMNS = 6  # of the contact sheet
MOST_SHOWN = 120  # on the contact sheet, those with the highest scores
DOTS_PER_INCH = 170
SMALL = 1.85, 2.15  # inch, width and height of one figure
LOW_SCORE = 0.9  # most true targets have more; less is a reason to look, not to reject


@styled
def target_figure(row, target):
    """One target as a figure of its own.

    Parameters
    ----------
    row : dict
        Of report.json or targets.json.
    target : FittedTarget
    """
    figure = Figure(figsize=SMALL, layout="constrained")
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02)
    _draw(figure.add_subplot(), row, target)
    return figure


def target_drawings(rows, fitted):
    """Pairs (title, PNG as bytes, some 20 kB) of the rows that hold an observation.

    Parameters
    ----------
    rows : list of dict
        Of report.json or targets.json.
    fitted : dict
        FittedTarget by (pass number, gps_time).
    """
    drawings = []
    for row in rows:
        target = fitted.get((row["pass"], row["gps_time"]))
        if target is not None:
            picture = io.BytesIO()
            target_figure(row, target).savefig(picture, format="png", dpi=DOTS_PER_INCH)
            drawings.append((f"{row['name']}, pass {row['pass']}", picture.getvalue()))
    return drawings


def write_contact_sheet(path, rows, fitted):
    """Write one picture of all targets, at most 120 of them, in order of pass and time.

    Those without a name are called by their row in targets.csv.
    """
    best = sorted(rows, key=lambda row: -row["score"])[:MOST_SHOWN]
    shown = sorted(best, key=lambda row: (row["pass"], row["gps_time"]))
    lines = max(1, -(-len(shown) // COLUMNS))
    with matplotlib.rc_context(STYLE):
        size = COLUMNS * SMALL[0], lines * SMALL[1] + 0.7
        figure = Figure(figsize=size, layout="constrained")
        left_out = len(rows) - len(shown)
        title = f"{len(rows)} target-like objects" if rows else "No target-like object was found"
        title += f" (the {len(shown)} with the highest scores)" if left_out else ""
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        if shown:
            figure.legend(handles=_legend(), loc="outside lower left", ncols=6)
        for i, row in enumerate(shown):
            axes = figure.add_subplot(lines, COLUMNS, i + 1)
            named = row | {"name": row["name"] or f"row {rows.index(row) + 1}"}
            _draw(axes, named, fitted[row["pass"], row["gps_time"]])
        figure.savefig(path, format="png", dpi=DOTS_PER_INCH, metadata={"Software": "mlscorr"})


def _legend():
    marks = [
        Line2D([], [], linestyle="", marker="o", markersize=4, color=colour, label=f"beam: {name}")
        for name, (colour, _) in LOOKS.items()
    ]
    return [
        *marks,
        Line2D([], [], color=BLUE, label="fitted outline"),
        Line2D([], [], color=BLUE, linestyle="", marker="+", markersize=8, label="centre"),
        Patch(
            color=VERMILLION, alpha=0.35, label=f"1 sigma of the centre, {ELLIPSE} times enlarged"
        ),
    ]


def _draw(axes, row, target):
    """Points in the plane, outline, centre and its covariance; up is up, seen by the scanner."""
    view = target.view
    turn = _upright(target) * 100.0  # cm
    points = (view.points - view.centre) @ turn.T
    half = MARGIN * 50.0 * view.outline * (1.0 if target.kind in ("circle", "hole") else 1.15)
    within = np.abs(points).max(axis=1) < half
    rows = np.flatnonzero(within)
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), POINTS)).astype(int)]
    for name, (colour, width) in LOOKS.items():
        dots = points[rows[view.state[rows] == STATES[name]]]
        axes.plot(*dots.T, linestyle="", marker="o", markersize=width, color=colour, mew=0)
    for patch in _outline(target, turn):
        axes.add_patch(patch)
    axes.add_patch(_ellipse(turn @ view.covariance @ turn.T))
    axes.plot(0.0, 0.0, "+", color=BLUE, markersize=8)
    axes.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes.tick_params(labelsize=6, length=2, pad=1)
    axes.set_xlabel("cm", fontsize=6, labelpad=0)
    _title(axes, row, target)


def _upright(target):
    """Plane axes (2, 2) to right and up as the scanner sees them; of a flat one, up is north."""
    normal = target.normal
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < FLAT else np.array([0.0, 1.0, 0.0])
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, normal), up]) @ target.view.axes.T


def _outline(target, turn):
    """Patches of the fitted outline, (0, 0) its centre."""
    view, style = target.view, {"fill": False, "edgecolor": BLUE, "linewidth": 1.1}
    radius = 50.0 * view.outline  # cm
    if target.kind in ("circle", "hole"):
        inner = [Circle((0, 0), radius * view.inner, **style)] if view.inner > 0 else []
        return [Circle((0, 0), radius, **style), *inner]
    cos, sin = np.cos(view.turn), np.sin(view.turn)
    edges = view.outline / 2 * np.array([[cos, sin], [-sin, cos]]) @ turn.T  # cm, half edges
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) @ edges
    crossing = [Polygon([-edge, edge], closed=False, **style) for edge in edges]
    return [Polygon(corners, **style), *(crossing if target.kind == "checkerboard" else [])]


def _ellipse(covariance):
    """One sigma of the centre (covariance in cm^2), enlarged."""
    values, axes = np.linalg.eigh(covariance)
    low, high = 2 * ELLIPSE * np.sqrt(np.maximum(values, 0.0))
    angle = np.degrees(np.arctan2(axes[1, 1], axes[0, 1]))
    return Ellipse((0, 0), high, low, angle=angle, color=VERMILLION, alpha=0.35, linewidth=0)


def _title(axes, row, target):
    """Name, kind and size; pass, points and sigma; what is wrong with it in red."""
    sigma = 1e3 * np.sqrt(np.trace(target.covariance))
    about = "about " if target.size_sigma > 0 else ""
    red = _doubt(row, target)
    told = red or (f"score {target.score:.2f}" if "score" in row else "")
    above = {"transform": axes.transAxes, "color": VERMILLION if red else "black"}
    axes.text(0, 1.15, label(row["name"], 12), fontweight="bold", fontsize=8, **above)
    axes.text(1, 1.15, told, fontsize=6.2, ha="right", **above)
    axes.set_title(
        f"{target.kind} {about}{100 * target.size:.0f} cm, pass {row['pass']}\n"
        f"{target.points} points, 3D sigma {sigma:.1f} mm",
        **{"fontsize": 6.2, "loc": "left", "pad": 2, "linespacing": 1.1},
    )


def _doubt(row, target):
    """A word where a target was not used, or is hardly like one."""
    if row.get("role") == "check":
        return None
    if row.get("used") is False:
        return "not used"
    if target.score < LOW_SCORE:
        return f"score {target.score:.2f}"
    return None
