"""Small figure of each target, for a quick visual check by a surveyor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from PIL import Image

from mlscorr.evaluate import TargetRow
from mlscorr.report.pen import Pen
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import BLUE, MARKS, STYLE, VERMILLION, label, png, png_of
from mlscorr.targets import FittedTarget

BEAMS = ("dark", "bright", "went by")  # 0, 1 and -1 in a TargetView, and so counted as here
PT = SETTINGS.dots_per_inch / 72  # pixels of a point
ANGLES = np.linspace(0, 2 * np.pi, 97)
CIRCLE = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)  # of radius 1


def target_drawings(
    rows: list[TargetRow], fitted: dict[tuple[int, float], FittedTarget]
) -> list[tuple[str, bytes]]:
    """Pairs (title, PNG of about 20 kB) of the rows with an observation.

    Parameters
    ----------
    rows : list of TargetRow
    fitted : dict
        FittedTarget by (pass number, gps_time).
    """
    drawings = []
    for row in rows:
        target = fitted.get((row.pass_number, row.gps_time))
        if target is None:
            continue
        note = _doubt(row, target)
        picture = draw_target(target, row.name, row.pass_number, note, bool(note))
        title = f"{row.name}, pass {row.pass_number}"
        drawings.append((title, png_of(Image.fromarray(picture))))
    return drawings


def draw_target(
    target: FittedTarget, name: str | None, pass_number: int, note: str, is_doubtful: bool
) -> np.ndarray:
    """Pixels of one target in its plane: up is up, seen by the scanner.

    Parameters
    ----------
    target : FittedTarget
    name : str or None
    pass_number : int
    note : str
        Beside the name.
    is_doubtful : bool
        The words are red then.

    Returns
    -------
    (h, w, 3) array of uint8
        RGB, of the size of ``SETTINGS.target_figure``.
    """
    width, height = np.round(np.array(SETTINGS.target_figure) * SETTINGS.dots_per_inch).astype(int)
    frame = Frame.within(width, height, _half_width(target))
    pen = Pen(np.full((height, width, 3), 255, np.uint8))
    _axes(pen, frame)
    _beams(pen, frame, target)
    _fit(pen, frame, target)
    pen.line(frame.corners[[0, 1, 2]], "#555555", 0.8 * PT)
    _title(pen, target, name, pass_number, note, is_doubtful)
    return pen.pixels


def draw_grid(figure: Figure, pictures: Sequence[np.ndarray], columns: int) -> None:
    """Put pictures of targets into a figure, row by row.

    Parameters
    ----------
    figure : Figure
    pictures : sequence of (h, w, 3) arrays
    columns : int
    """
    lines = max(1, -(-len(pictures) // columns))
    for place, picture in enumerate(pictures, start=1):
        axes = figure.add_subplot(lines, columns, place)
        axes.imshow(picture, interpolation="antialiased")
        axes.set_axis_off()


@dataclass(frozen=True)
class Frame:
    """Axes of a target's picture: from positions in its plane in cm to pixels.

    Parameters
    ----------
    middle : (2,) array
        Units: pixels.
    half : float
        Half of a side. Units: pixels.
    half_width : float
        The same in the plane. Units: cm.
    """

    middle: np.ndarray
    half: float
    half_width: float

    @classmethod
    def within(cls, width: int, height: int, half_width: float) -> Frame:
        """The axes of a picture of a size in pixels, with three lines above them."""
        half = min(0.85 * width, 0.7 * height) / 2
        middle = np.array([0.13 * width + 0.425 * width, height * (0.17 + 0.35)])
        return cls(middle, half, half_width)

    def place(self, plane: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 2) in the plane, in cm to the right and up."""
        return self.middle + np.asarray(plane) * [1, -1] * self.half / self.half_width

    @property
    def corners(self) -> np.ndarray:
        """Upper left, lower left, lower right: pixels (3, 2)."""
        return self.middle + self.half * np.array([[-1, -1], [-1, 1], [1, 1]])


def _doubt(row, target):
    """Phrase on an unused target, or on one with a low score."""
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
    """Write one picture of the targets with the highest scores, sorted by pass and time.

    Parameters
    ----------
    path : path
        PNG file.
    rows : list of dict
        Rows of targets.json. Targets without a name are labeled by their row in targets.csv.
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
        draw_grid(figure, [_sheet_picture(row, rows, fitted) for row in best], columns)
    Path(path).write_bytes(png(figure))


def _sheet_picture(row, rows, fitted):
    """The picture of a row of targets.json."""
    target = fitted[row["pass"], row["gps_time"]]
    name = row["name"] or f"row {rows.index(row) + 1}"
    return scored_picture(target, name, row["pass"])


def scored_picture(target: FittedTarget, name: str | None, pass_number: int) -> np.ndarray:
    """Pixels of a target with its score, in red where that is low.

    Parameters
    ----------
    target : FittedTarget
    name : str or None
    pass_number : int
    """
    is_low = target.score < SETTINGS.low_score
    return draw_target(target, name, pass_number, f"score {target.score:.2f}", is_low)


def _legend():
    marks = [
        Line2D([], [], linestyle="", **{**MARKS[name], "markersize": 4}, label=f"beam: {name}")
        for name in ("bright", "dark", "went by")
    ]
    ellipse = f"1 sigma of the center, enlarged {SETTINGS.ellipse_scale:g} times"
    return [
        *marks,
        Line2D([], [], color=BLUE, label="fitted outline"),
        Line2D([], [], color=BLUE, linestyle="", marker="+", markersize=8, label="center"),
        Patch(color=VERMILLION, alpha=0.35, label=ellipse),
    ]


def _half_width(target):
    """Half of what the axes show: its board and what is beside it. Units: cm."""
    is_round = target.kind in ("circle", "hole")
    return 75.0 * target.view.outline.size * (1.0 if is_round else 1.15)


def _axes(pen, frame):
    """A grid with its numbers."""
    edge = frame.half_width
    ticks = MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(-edge, edge)
    digits = max(0, -int(np.floor(np.log10(ticks[1] - ticks[0]))))
    size = 6 * PT
    down = np.array([0.0, 2 * PT])
    for tick in ticks[np.abs(ticks) <= edge]:
        words = f"{tick:.{digits}f}".replace("-", "\N{MINUS SIGN}")
        across = frame.place([[-edge, tick], [edge, tick]])
        up = frame.place([[tick, edge], [tick, -edge]])
        for line in (across, up):
            pen.line(line, "#e4e4e4", 0.6 * PT)
        left = across[0]
        foot = up[1]
        pen.line(np.stack([left, left - [2 * PT, 0]]), "black", 0.8 * PT)
        pen.line(np.stack([foot, foot + down]), "black", 0.8 * PT)
        pen.text(tuple(left - [3.2 * PT, 0]), words, size, anchor="rm")
        pen.text(tuple(foot + 1.6 * down), words, size, anchor="mt")
    pen.text(tuple(frame.place([[0, -edge]])[0] + [0, 9.5 * PT]), "cm", size, anchor="mt")


def _beams(pen, frame, target):
    """Draw where the beams met the plane, in the color of the surface they met."""
    view = target.view
    points = (view.points - view.outline.centre) @ (100.0 * _upright(target)).T  # cm
    rows = np.flatnonzero(np.abs(points).max(axis=1) < frame.half_width)
    # so many make a figure of some 20 kB
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), 350)).astype(int)]
    names = np.array(BEAMS)[view.state[rows].astype(int)]
    for name in ("bright", "dark", "went by"):
        mark = MARKS[name]
        size = mark["markersize"] * PT
        pen.dots(frame.place(points[rows[names == name]]), mark["color"], size)


def _fit(pen, frame, target):
    """The fitted outline, its centre and that one's covariance."""
    turn = 100.0 * _upright(target)  # cm
    for line in _outline(target, turn):
        pen.line(frame.place(line), BLUE, 1.1 * PT)
    ellipse = _ellipse(turn @ target.view.outline.covariance @ turn.T)
    pen.tint(frame.place(ellipse), VERMILLION, 0.35)
    for arm in 4 * PT * np.eye(2):
        pen.line(np.stack([frame.middle - arm, frame.middle + arm]), BLUE, 1.0 * PT)


def _upright(target):
    """Plane axes (2, 2) to the right and up as seen from the scanner; for a flat target, up is
    north.
    """
    normal = target.normal
    if normal[2] ** 2 < 0.5:
        up = np.array([0.0, 0.0, 1.0])
    else:
        up = np.array([0.0, 1.0, 0.0])
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, normal), up]) @ target.view.axes.T


def _outline(target, turn):
    """Lines (n, 2) of the fitted outline, (0, 0) its centre. Units: cm."""
    outline = target.view.outline
    radius = 50.0 * outline.size  # cm
    if target.kind in ("circle", "hole"):
        radii = [radius]
        if outline.inner > 0:
            radii.append(radius * outline.inner)
        return [size * CIRCLE for size in radii]
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    edges = outline.size / 2 * np.array([[cos, sin], [-sin, cos]]) @ turn.T  # cm, half edges
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) @ edges
    lines = [corners]
    if target.kind == "checkerboard":
        lines += [np.stack([-edge, edge]) for edge in edges]
    return lines


def _ellipse(covariance):
    """Outline (n, 2) of one sigma of the centre (covariance in cm^2), enlarged. Units: cm."""
    values, axes = np.linalg.eigh(covariance)
    half = SETTINGS.ellipse_scale * np.sqrt(np.maximum(values, 0.0))
    return (half * CIRCLE) @ axes.T


def _title(pen, target, name, pass_number, note, is_doubtful):
    """Name, note, kind and size; pass, points and sigma; what is doubtful in red."""
    sigma = 1e3 * np.sqrt(np.trace(target.covariance))
    about = "about " if target.size_sigma > 0 else ""
    color = VERMILLION if is_doubtful else "black"
    width, height = pen.size
    left = 0.149 * width
    small = 6.2 * PT
    pen.text((left, 0.065 * height), label(name, 12), 8 * PT, color, "ls", bold=True)
    pen.text((0.98 * width, 0.065 * height), note, small, color, "rs")
    lines = (
        f"{target.kind} {about}{100 * target.size:.0f} cm, pass {pass_number}",
        f"{target.points} points, 3D sigma {sigma:.1f} mm",
    )
    for words, foot in zip(lines, (0.11, 0.155), strict=True):
        pen.text((left, foot * height), words, small, anchor="ls")
