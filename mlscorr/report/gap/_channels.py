"""Non-geometric channels, and distances used in other fields: sentences, rows, a figure."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mlscorr.effects import lowered
from mlscorr.report.gap._innovations import channel_style
from mlscorr.report.gap._rows import bin_names, numbers
from mlscorr.report.headline import StatementRow
from mlscorr.report.style import BLUE, GREY, VERMILLION, legend_above, new_figure, styled
from mlscorr.wording import joined, known, plain

WORDS = {  # of channels: meaning, figure, axis label
    "intensity": ("Intensity", "real over simulated, relative to the usual ratio", "Ratio"),
    "density": ("Density", "real over simulated number", "Ratio"),
    "dropout": ("Lost beams", "real minus simulated share", "Share"),
    "edge_width": ("Edge width", "real minus simulated, mrad", "mrad"),
}
SPLITS = {
    "range": "range (m)",
    "incidence": "incidence (°)",
    "reflectance": "brightness",
    "all": "",
}
FIGURES = {
    "energy_distance": "Energy distance",
    "mmd": "MMD, squared",
    "chamfer": "Chamfer distance",
}
SAMPLES = {  # of the clouds
    "points": "Places of points",
    "intensity": "Intensity, log10",
    "density": "Points of a cell, log10",
}


class ChannelRow(NamedTuple):
    """Bin of a channel: real and simulated figure, comparison, sigma, blocks; flag of a
    difference.
    """

    channel: str
    by: str
    bin: str
    texts: list[str]
    differs: bool


class DistanceRow(NamedTuple):
    """Distance, and whether it exceeds that between halves of the simulation, as texts."""

    sample: str
    figure: str
    before: str
    after: str
    floor: str
    unit: str
    drawn: int
    stands_out: bool


def channel_statements(document: dict) -> Iterator[StatementRow]:
    """Yield statements on differences in non-geometric channels, if any could be compared.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    parts = [], []
    for each in document.get("contrasts", ()):
        parts[bool(each["silent"])].append(each)
    compared, silent = parts
    if not compared:
        return
    names, rest = (joined(lowered(WORDS[e["channel"]][0]) for e in some) for some in parts)
    rest = f" Not compared: {rest}." if silent else ""
    sentences = [text for each in compared for text in each["sentences"]]
    if not sentences:
        yield StatementRow("Channels", "green", f"No significant difference in {names}.{rest}")
        return
    more = len(sentences) - 1
    rest = f" {more} more on the page." * bool(more) + rest
    yield StatementRow("Channels", "amber", f"{sentences[0]}{rest}")


def channel_rows(document: dict) -> list[ChannelRow]:
    """Rows of the table of channels.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    rows = []
    for each in document.get("contrasts", ()):
        whole = [] if each["whole"] is None else [each["whole"]]
        for table in [*each["tables"], *whole]:
            columns = (table[key] for key in ("real", "simulated", "value", "sigma", "blocks"))
            bins = zip(bin_names(table), table["differs"], *columns, strict=True)
            for name, differs, *values in bins:
                texts = [plain(value) for value in values]
                title = WORDS[each["channel"]][0]
                by = SPLITS[table["by"]]
                rows.append(ChannelRow(title, by, name, texts, differs))
    return rows


def distance_rows(document: dict) -> list[DistanceRow]:
    """Rows of the table of distances.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    return [
        DistanceRow(
            SAMPLES.get(each["channel"]) or f"{channel_style(each['channel']).words}: innovations",
            FIGURES[each["figure"]],
            plain(each["before"]),
            plain(each["after"]),
            f"{plain(each['floor'])} (95 % below {plain(each['floor_high'])})",
            each["unit"],
            each["drawn"],
            known(each["before"]) and each["before"] > each["floor_high"],
        )
        for each in document.get("distances", ())
    ]


@styled
def channels_figure(document: dict) -> Figure:
    """Draw each channel by its covariates, with 95 % intervals; orange-red for differences.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    tables = [(each, table) for each in document["contrasts"] for table in each["tables"]]
    columns = min(3, len(tables))
    rows = -(-len(tables) // columns)
    figure = new_figure(0.6 + 1.9 * rows)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, (each, table) in zip(panels, tables, strict=False):
        _draw(panel, each, table)
    for panel in panels[len(tables) :]:
        panel.set_visible(False)
    marks = ((BLUE, "Not significant"), (VERMILLION, "Significant"))
    handles = [Line2D([], [], color=c, marker="o", lw=1.2, ms=4, label=text) for c, text in marks]
    handles.append(Line2D([], [], color=GREY, linewidth=0.9, label="As simulated"))
    legend_above(figure, handles)
    return figure


def _draw(panel, each, table):
    has_edges = "edges" in table
    count = len(table["value"])
    if has_edges:
        edges = numbers(table["edges"])
    else:
        edges = np.arange(count + 1.0) - 0.5
    value = numbers(table["value"])
    sigma = numbers(table["sigma"])
    middle = 0.5 * (edges[1:] + edges[:-1])
    half = 0.5 * np.diff(edges)
    panel.axhline(1.0 if each["figure"] == "ratio" else 0.0, color=GREY, linewidth=0.9, zorder=1)
    differs = np.array(table["differs"], bool)
    for which, color in ((~differs, BLUE), (differs, VERMILLION)):
        panel.errorbar(
            middle[which],
            value[which],
            1.96 * sigma[which],
            half[which],
            fmt="o",
            color=color,
            markersize=3.5,
            linewidth=1.2,
            zorder=3,
        )
    title, _, unit = WORDS[each["channel"]]
    panel.set_title(f"{title} by {SPLITS[table['by']]}", fontsize=8)
    panel.set_ylabel(unit)
    if not has_edges:
        panel.set_xticks(range(count), table["bins"])
    panel.margins(y=0.2)
