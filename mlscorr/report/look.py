"""How all figures look: colours that colour-blind readers can tell apart, sizes, thinning."""

import io
import re
from functools import cache

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font

WIDTH = 7.6  # inch
EPOCHS = 3000  # most epochs a curve is drawn with

# Okabe and Ito (2008), Color Universal Design
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, GREY = "#0072B2", "#D55E00", "#767676"
BEFORE, AFTER = ORANGE, BLUE

MARKS = {
    "control": {"color": BLACK, "marker": "o", "markersize": 4.0},
    "check": {"color": VERMILLION, "marker": "D", "markersize": 4.6, "markerfacecolor": "white"},
    "unused": {"color": GREY, "marker": "x", "markersize": 5.0},
}

STYLE = {
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
    "svg.hashsalt": "mlscorr",
}
styled = matplotlib.rc_context(STYLE)  # decorator


@cache
def _font():
    return get_font(findfont("DejaVu Sans"))


def label(name, longest=14):
    """A name from a file as the font can draw it: one line, cut when long."""
    name = "".join(c if c.isprintable() else " " for c in name or "no name")
    name = "".join(c if _font().get_char_index(ord(c)) else "?" for c in name)
    return name if len(name) <= longest else name[: longest - 1] + "…"


def new_figure(height):
    """An empty figure of the common width (height in inch)."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def legend_above(figure, handles, columns=3):
    """A legend above all axes, where it covers no data."""
    figure.legend(handles=handles, loc="outside upper left", ncols=columns)


def svg(figure):
    """The figure as the bytes of an SVG, coordinates cut to 0.01 pt."""
    stream = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue().decode()
    return re.sub(r' d="[^"]*"', lambda d: re.sub(r"(\.\d\d)\d+", r"\1", d[0]), text).encode()


def thin(values, gps_time, gaps, limit=EPOCHS):
    """Rows to draw of curves (n, k): each bin's minima and maxima, the ends, the edges of gaps.

    Parameters
    ----------
    values : (n, k) array
    gps_time : (n,) array
    gaps : (g, 2) array
    limit : int
        At most this many rows (and two for each gap) are kept.

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


def break_at_gaps(gps_time, gaps, *values):
    """The times and curves with NaN put into each gap, so that no line crosses it."""
    where = np.searchsorted(gps_time, gaps[:, 1]) if len(gaps) else np.array([], int)
    broken = [np.insert(gps_time, where, gaps.mean(axis=1))]
    return broken + [np.insert(np.asarray(v, float), where, np.nan, axis=0) for v in values]
