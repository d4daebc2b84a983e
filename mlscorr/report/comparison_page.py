"""Page of a comparison of methods: a sentence, a table, a figure."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from mlscorr.report import style
from mlscorr.report._comparison_screen import ranking, undetermined
from mlscorr.report.pages import Page, data_uri

SECTIONS = {  # in order; empty ones are omitted
    "scores": "Residuals",
    "check": "Check points only",
    "absent": "Not determined",
    "figure": "Chart",
    "methods": "Methods",
    "unseen": "Not found",
}
KINDS = {  # color, mark and words
    "none": (style.GREY, "x", "as recorded"),
    "one move": (
        style.VERMILLION,
        "s",
        "one transformation of the whole cloud, independent of time",
    ),
    "over time": (style.GREEN, "^", "polynomials and interpolation over time"),
    "collocation": (style.BLUE, "o", "collocation: polynomials plus the POS error over time"),
}


def write_comparison(path: str | Path, document: dict) -> None:
    """Write the self-contained page of a comparison.

    Parameters
    ----------
    path : path
        HTML file.
    document : dict
        Contents of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    absent = undetermined(document)
    there = {
        "check": by == "cross_validated" and bool(document["check_points"]),
        "absent": bool(absent),
        "unseen": bool(document["unseen"]),
    }
    figures = {"comparison": data_uri(style.svg(comparison_figure(document)))}
    content = {
        "document": document,
        "by": by,
        "ranked": ranked,
        "absent": absent,
        "kinds": {name: words for name, (_, _, words) in KINDS.items()},
        "figures": figures,
    }
    Page(
        title=f"{document['name']}: methods of correction compared",
        summary="compare-summary.html",
        sections={name: title for name, title in SECTIONS.items() if there.get(name, True)},
        content=content,
        prefix="compare-",
        styles=("compare.css",),
    ).write(path)


@style.styled
def comparison_figure(document: dict) -> Figure:
    """Draw the RMSE of every method on each axis, the best at the top; logarithmic scale in m.

    Parameters
    ----------
    document : dict
        Contents of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    figure = style.new_figure(1.6 + 0.27 * len(ranked))
    panels = figure.subplots(1, 3, sharey=True, sharex=True)
    values = np.maximum([row[by]["rmse"] for row in ranked], 1e-4)  # m, left end at least
    places = np.arange(len(ranked))
    for axis, panel in enumerate(panels):
        column = values[:, axis]
        panel.hlines(places, 1e-9, column, color="#d3d8dc", linewidth=1.0, zorder=1)
        for place, row, value in zip(places, ranked, column, strict=True):
            color, mark, _ = KINDS[row["kind"]]
            panel.plot(value, place, mark, color=color, markersize=5.5, zorder=3)
        panel.axvline(column.min(), color=style.BLUE, linewidth=0.7, linestyle=":", zorder=2)
        panel.set_title(("East", "North", "Height")[axis])
        panel.set_xlim(values.min() / 1.6, values.max() * 1.6)
        _ticks_in_words(panel)
    panels[0].set_yticks(places, [row["name"] for row in ranked])
    panels[0].set_ylim(len(ranked) - 0.4, -0.6)
    figure.supxlabel("RMSE (logarithmic scale; dotted: the smallest on this axis)", fontsize=8.5)
    handles = [
        style.mark_handle(mark, color, words)
        for name, (color, mark, words) in KINDS.items()
        if any(row["kind"] == name for row in ranked)
    ]
    style.legend_above(figure, handles, columns=2)
    return figure


def _ticks_in_words(panel):
    """Label a logarithmic axis in words: 1 mm, 1 cm, 10 cm, 1 m."""

    def words(value, _):
        for unit, size in (("m", 1.0), ("cm", 0.01), ("mm", 0.001)):
            if value >= 0.999 * size:
                return f"{value / size:g} {unit}"
        return f"{1000 * value:g} mm"

    panel.set_xscale("log")
    low, high = panel.get_xlim()
    if high < 20 * low:
        steps = (1, 2, 5)
    else:
        steps = (1, 3) if high < 1000 * low else (1,)
    panel.xaxis.set_major_locator(LogLocator(subs=steps, numticks=8))
    panel.xaxis.set_major_formatter(FuncFormatter(words))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
