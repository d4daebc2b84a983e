"""Page of a project: its drives on a map, and a table with links to each."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter

from mlscorr.report.maps import corners, frame, write_names
from mlscorr.report.pages import Page, data_uri
from mlscorr.report.style import new_figure, nice, styled, svg
from mlscorr.wording import counted

SECTIONS = {"drives": "Drives", "map": "Map"}


def write_project(path: str | Path, document: dict, tracks: dict[str, np.ndarray]) -> None:
    """Write the self-contained page of a project, with links to those of its drives.

    Parameters
    ----------
    path : path
        HTML file.
    document : dict
        Contents of project.json.
    tracks : dict
        Easting, northing (m) and expected error (m) along each drive (k, 3), by name.
    """
    if tracks:
        figures = {"map": data_uri(svg(project_map(tracks)))}
    else:
        figures = {}
    Page(
        title=f"{document['name']}: correction of {counted(len(document['drives']), 'drive')}",
        summary="project-summary.html",
        sections={name: title for name, title in SECTIONS.items() if name != "map" or tracks},
        content={"document": document, "figures": figures},
        prefix="project-",
    ).write(path)


@styled
def project_map(tracks: dict[str, np.ndarray]) -> Figure:
    """Draw a plan of all drives, colored by the expected error.

    Parameters
    ----------
    tracks : dict
        See write_project.
    """
    places = np.vstack([track[np.isfinite(track[:, 0])] for track in tracks.values()])
    low, high = corners(places[:, :2], 0.4)  # wide enough for labels below it
    width, height = high - low
    figure = new_figure(1.0 + 6.0 * float(np.clip(height / width, 0.3, 1.3)))
    axes = figure.add_subplot()
    millimetres = 1000 * places[:, 2]
    colours = LogNorm(max(millimetres.min(), 0.1), max(millimetres.max(), 0.2))
    for track in tracks.values():
        ends = np.stack([track[:-1], track[1:]], axis=1)
        ends = ends[np.isfinite(ends).all(axis=(1, 2))]
        size = 1000 * ends[:, :, 2].mean(axis=1)
        lines = LineCollection(ends[:, :, :2], array=size, norm=colours, cmap="viridis", lw=2.2)
        lines.set_capstyle("round")  # a short drive is a dot
        axes.add_collection(lines)
    known = {name: track[np.isfinite(track[:, 0]), :2] for name, track in tracks.items()}
    write_names(
        axes, {name: (line[len(line) // 2], 1) for name, line in known.items()}, 1.2 * width
    )
    ends = nice(colours.vmin), nice(colours.vmax)
    powers = 10.0 ** np.arange(np.floor(np.log10(ends[0])), np.ceil(np.log10(ends[1])) + 1)
    bar = figure.colorbar(lines, ax=axes, location="bottom", shrink=0.8, aspect=50)
    bar.set_ticks([step * power for power in powers for step in (1, 2, 3, 5, 7)], minor=False)
    bar.ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    bar.ax.minorticks_off()
    bar.ax.set_xlim(colours.vmin, colours.vmax)
    bar.set_label("Expected error: 3D sigma of the corrected position (mm)")
    frame(axes, low, high)
    axes.set_title("Drives and expected error")
    return figure
