"""Figures of points seen from above, for use without a report."""

import io

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

DRAWN = 200_000  # points: more do not fit into a picture
DOTS = 150  # dots per inch, in a notebook


class CloudFigure(Figure):
    """Figure that notebooks show without pyplot."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DOTS)
        return stream.getvalue()


def cloud_figure(xyz: np.ndarray, intensity: np.ndarray) -> Figure:
    """Draw points from above, in gray by intensity.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    intensity : (n,) array
    """
    some = slice(None, None, max(1, len(xyz) // DRAWN))
    figure = CloudFigure(figsize=(7.2, 5.4), layout="constrained")
    axes = figure.add_subplot()
    if len(xyz):
        low, high = np.percentile(intensity[some], (2, 98))
        axes.scatter(
            xyz[some, 0],
            xyz[some, 1],
            s=0.3,
            c=intensity[some],
            cmap="gray",
            vmin=low,
            vmax=max(high, low + 1),
            linewidths=0,
        )
    axes.set(aspect="equal", facecolor="#1b2a41", xlabel="Easting (m)", ylabel="Northing (m)")
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.tick_params(labelsize=7)
    axes.set_title(f"{len(xyz)} points from above, by intensity", loc="left", fontsize=9.5)
    return figure


def path_figure(place: np.ndarray, pairs: np.ndarray) -> Figure:
    """Draw a path from above, with a mark at its start.

    Parameters
    ----------
    place : (n, 3) array
        Units: m.
    pairs : (k, 2) int array
        Indices of the positions that a line joins.
    """
    figure = CloudFigure(figsize=(7.2, 4.8), layout="constrained")
    axes = figure.add_subplot()
    axes.add_collection(LineCollection(list(place[pairs][:, :, :2]), colors="#0072B2"))
    axes.plot(*place[0, :2], "o", color="#D55E00", label="Start")
    axes.set(aspect="equal", xlabel="Easting (m)", ylabel="Northing (m)")
    axes.autoscale()
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.tick_params(labelsize=7)
    axes.legend(frameon=False)
    return figure
