"""Style of all figures: palette, sizes of letters and lines, legends, thinned curves."""

import io
import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.lines import Line2D
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from mlscorr.report.settings import SETTINGS

# Okabe and Ito (2008), Color Universal Design: distinguishable by color-blind readers
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREY = "#767676"
BEFORE = ORANGE
AFTER = BLUE
BAND: dict[str, Any] = {"facecolor": f"{SKY}59", "edgecolor": "none"}  # of one sigma
OUTSIDE: dict[str, Any] = {
    "facecolor": "#f3e9c9",
    "edgecolor": "none",
}  # of parts constrained by control points
OUTAGE: dict[str, Any] = {"facecolor": "#8fb0dd", "edgecolor": "none"}
STEP: dict[str, Any] = {"color": "#7b4fa3", "linewidth": 0.9, "linestyle": (0, (1, 1.5))}
SPAN: dict[str, Any] = {"color": "#8a6d00", "linewidth": 0.8, "linestyle": (0, (4, 3))}
GAP: dict[str, Any] = {"facecolor": "#e3e3e3", "edgecolor": "#9a9a9a", "hatch": "////"}
TRACK: dict[str, Any] = {"color": "#9a9a9a"}

MARKS: dict[str, dict[str, Any]] = {
    "control": {"color": BLACK, "marker": "o", "markersize": 4.0},
    "check": {"color": VERMILLION, "marker": "D", "markersize": 4.6, "markerfacecolor": "white"},
    "unused": {"color": GREY, "marker": "x", "markersize": 5.0},
    # beams on a target
    "bright": {"color": ORANGE, "marker": "o", "markersize": 2.4, "markeredgewidth": 0},
    "dark": {"color": "#3c3c3c", "marker": "o", "markersize": 1.8, "markeredgewidth": 0},
    "went by": {"color": "#9cc9e6", "marker": "o", "markersize": 1.9, "markeredgewidth": 0},
}

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.5,
    "svg.fonttype": "path",
    "text.parse_math": False,  # names from files may contain dollar signs
    "svg.hashsalt": "mlscorr",
}
styled = matplotlib.rc_context(STYLE)  # decorator
Figures = dict[str, Callable[[], Figure]]


@cache
def _font():
    return get_font(findfont("DejaVu Sans"))


def label(name: str | None, longest: int = 14) -> str:
    """Format a name from a file for the font: one line, truncated if long.

    >>> label("T01"), label(None), label("A name that is long")
    ('T01', 'no name', 'A name that i…')
    """
    name = "".join(c if c.isprintable() else " " for c in name or "no name")
    name = "".join(c if _font().get_char_index(ord(c)) else "?" for c in name)
    if len(name) <= longest:
        return name
    return name[: longest - 1] + "…"


def nice(value: float) -> float:
    """Largest of 1, 2, 5 times a power of ten that does not exceed a positive value.

    >>> nice(0.71), nice(380.0)
    (0.5, 200.0)
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)))


class NotebookFigure(Figure):
    """Figure that notebooks show without pyplot, which would show it twice."""

    def _repr_png_(self) -> bytes:
        return png(self)


def new_figure(height: float) -> Figure:
    """Make an empty figure of the common width (height in inch)."""
    return NotebookFigure(figsize=(SETTINGS.figure_width, height), layout="constrained")


def legend_above(figure: Figure, handles: Sequence[Artist], columns: int = 3) -> None:
    """Draw a legend above all axes, where it covers no data."""
    figure.legend(handles=handles, loc="outside upper left", ncols=columns)


def mark_handles(words: dict[str, str], groups: set[str]) -> list[Line2D]:
    """Legend entries of the marks of control, check and unused targets.

    Parameters
    ----------
    words : dict
        Name of each group.
    groups : set of str
        Drawn groups.
    """
    return [
        Line2D([], [], linestyle="none", label=text, **MARKS[group])
        for group, text in words.items()
        if group in groups
    ]


def mark_handle(marker: str, color: str, words: str, size: float | None = None) -> Line2D:
    """Make a mark in a legend.

    Parameters
    ----------
    marker, color, words : str
    size : float, optional
        matplotlib's default if not given. Units: pt.
    """
    return Line2D(
        [], [], linestyle="none", marker=marker, markersize=size, color=color, label=words
    )


def draw(figures: Figures, name: str) -> Figure:
    """Draw the figure with a name.

    Parameters
    ----------
    figures : dict of functions
    name : str

    Raises
    ------
    ValueError
        If there is none.
    """
    if name not in figures:
        raise ValueError(f"There is no figure '{name}' here; available are {', '.join(figures)}.")
    return figures[name]()


def svg(figure: Figure) -> bytes:
    """Return the figure as the bytes of an SVG, with coordinates cut to 0.01 pt."""
    stream = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        _lay_out(figure)
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})
    text = stream.getvalue().decode()
    return re.sub(r' d="[^"]*"', lambda d: re.sub(r"(\.\d\d)\d+", r"\1", d[0]), text).encode()


def png(figure: Figure) -> bytes:
    """The figure as the bytes of a PNG."""
    with matplotlib.rc_context(STYLE):
        _lay_out(figure)
        figure.dpi = SETTINGS.dots_per_inch
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    return png_of(Image.fromarray(pixels))


def png_of(image: Image.Image) -> bytes:
    """An image of Pillow as the bytes of a PNG.

    Parameters
    ----------
    image : PIL.Image.Image
    """
    stream = io.BytesIO()
    about = PngInfo()
    about.add_text("Software", "mlscorr")
    dots = (SETTINGS.dots_per_inch, SETTINGS.dots_per_inch)
    image.save(stream, "png", compress_level=6, pnginfo=about, dpi=dots)
    return stream.getvalue()


def _lay_out(figure):
    """Find the layout of a figure, most of the work, once for all its files.

    ``savefig`` draws every figure one time more to find it.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasAgg(figure)
        engine.execute(figure)
    figure.set_layout_engine("none")


def thin(
    values: np.ndarray, gps_time: np.ndarray, gaps: np.ndarray, limit: int = SETTINGS.curve_epochs
) -> np.ndarray:
    """Select rows of curves to draw: each bin's minima and maxima, the ends, the edges of gaps.

    Parameters
    ----------
    values : (n, k) array
    gps_time : (n,) array
    gaps : (g, 2) array
    limit : int
        Largest number of rows, in addition to two for each gap.

    Returns
    -------
    (m,) array of int

    >>> thin(np.arange(100.0)[:, None], np.arange(100.0), np.empty((0, 2)), 8)
    array([ 0, 33, 34, 66, 67, 99])
    """
    n, k = values.shape
    edges = np.searchsorted(gps_time, gaps.ravel())
    if n <= limit:
        return np.arange(n)
    rows = [np.array([0, n - 1]), edges]
    for piece in np.array_split(np.arange(n), max(1, (limit - 2) // (2 * k))):
        part = values[piece]
        rows.append(piece[np.concatenate([part.argmin(axis=0), part.argmax(axis=0)])])
    return np.unique(np.concatenate(rows))


def break_at_gaps(gps_time: np.ndarray, gaps: np.ndarray, *values: np.ndarray) -> list[np.ndarray]:
    """Insert NaN into times and curves at each gap, so that no line crosses it.

    Parameters
    ----------
    gps_time : (n,) array
    gaps : (g, 2) array
    *values : (n, ...) arrays

    Returns
    -------
    list of (n + g, ...) arrays
    """
    if len(gaps):
        where = np.searchsorted(gps_time, gaps[:, 1])
    else:
        where = np.array([], int)
    broken = [np.insert(gps_time, where, gaps.mean(axis=1))]
    return broken + [np.insert(np.asarray(v, float), where, np.nan, axis=0) for v in values]
