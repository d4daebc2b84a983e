"""The page of a comparison: which method corrects how well, in a sentence, a table, a figure."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from mlscorr.effects.wording import joined
from mlscorr.report import tables
from mlscorr.report.pages import Page, data_uri
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import (
    BLUE,
    GREEN,
    GREY,
    VERMILLION,
    legend_above,
    new_figure,
    styled,
    svg,
)

SECTIONS = {  # in their order; one without anything to show is left out
    "scores": "What remains",
    "check": "Check points alone",
    "absent": "Not determined",
    "figure": "As a picture",
    "methods": "The methods",
    "unseen": "Not seen",
}
COLLOCATION = "lsc"
KINDS = {  # colour, mark and words
    "none": (GREY, "x", "as recorded"),
    "one move": (VERMILLION, "s", "one move of the whole cloud, blind to time"),
    "over time": (GREEN, "^", "polynomials of time"),
    "collocation": (BLUE, "o", "collocation: polynomials and the POS's own error over time"),
}

OTHERS = {
    "one move": "Best of those that move the whole cloud as one",
    "over time": "Best of the polynomials of time alone",
}


def write_comparison(path: str | Path, document: dict) -> None:
    """Write the self-contained page of a comparison.

    Parameters
    ----------
    path : path
        The HTML file.
    document : dict
        The content of compare.json.
    """
    ranked, by = ranking(document), document["scored_by"]
    absent = [
        (row["name"], row["why"] or row[by].get("why") or "no point to score it by")
        for row in document["methods"]
        if row not in ranked
    ]
    few_checked = by == "cross_validated" and bool(document["check_points"])
    there = {
        "scores": bool(ranked),
        "check": bool(ranked) and few_checked,
        "absent": bool(absent),
        "figure": bool(ranked),
        "unseen": bool(document["unseen"]),
    }
    figures = {"comparison": data_uri(svg(comparison_figure(document)))} if ranked else {}
    content = {
        "document": document,
        "sentences": verdict(document),
        "basis": basis(document),
        "by": by,
        "ranked": ranked,
        "absent": absent,
        "warned": [(row["name"], text) for row in document["methods"] for text in row["warnings"]],
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


def ranking(document: dict) -> list[dict]:
    """Rows of the methods that have a score, by their 3D RMSE, the best first.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    by = document["scored_by"]
    scored = [row for row in document["methods"] if row[by]["rmse_3d"] is not None]
    return sorted(scored, key=lambda row: row[by]["rmse_3d"])


def basis(document: dict) -> str:
    """What the scores rest on, in one sentence.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    control, check = document["control_points"], document["check_points"]
    made = f"Every method was fitted to the same {_points(control, 'control point')}"
    if document["scored_by"] == "check":
        return f"{made} and scored by {_points(check, 'check point')} that took no part."
    if document["scored_by"] == "control":
        return f"{made}. Nothing independent is left to score them by: this is the mere fit."
    too_few = f"only {_points(check, 'check point')}" if check else "no check points"
    groups = document["cross_validation_groups"]
    left = "each left out in turn" if groups == control else f"left out in {groups} groups in turn"
    others = "; each check point from all control points" if check else ""
    return (
        f"{made}. There {'is' if check == 1 else 'are'} {too_few}, so the scores are "
        f"cross-validated over all points: control points, {left}, are predicted from the "
        f"others{others}."
    )


def _points(number, words):
    return f"{number} {words}{'s' * (number != 1)}"


def verdict(document: dict) -> list[str]:
    """The result in sentences.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    ranked, by = ranking(document), document["scored_by"]
    if not ranked:
        return ["No point was found that could score the methods."]
    value = {row["name"]: row[by]["rmse_3d"] for row in ranked}
    best = ranked[0]["name"]
    tied = [name for name in value if value[name] - value[best] < SETTINGS.difference]
    raw = f"{tables.number(value['raw'])} m without any correction"
    if "raw" in tied:
        text = f"The cloud as recorded, with {tables.number(value['raw'])} m, is as good as any"
        return [
            f"No method improves this cloud by {1000 * SETTINGS.difference:.0f} mm or more. {text}."
        ]
    sentences = [_winner(ranked[0], tied, tables.number(value[best]), raw)]
    for kind, words in OTHERS.items():
        rest = [row["name"] for row in ranked if row["kind"] == kind]
        if rest and rest[0] not in tied:
            sentences.append(f"{words}: {rest[0]}, with {tables.number(value[rest[0]])} m.")
    if COLLOCATION in value and COLLOCATION not in tied:
        own, behind = value[COLLOCATION], value[COLLOCATION] - value[best]
        sentences.append(
            f"{COLLOCATION}, with {tables.number(own)} m, is {tables.number(behind)} m behind."
        )
    return sentences


def _winner(row, tied, value, raw):
    """The sentence on the best method, or on those that are too close to tell apart."""
    if len(tied) == 1:
        about = row["about"][0].lower() + row["about"][1:].rstrip(".")
        return f"Best is {row['name']} ({about}): 3D RMSE {value} m, against {raw}."
    return (
        f"Best are {joined(tied)}: 3D RMSE {value} m, against {raw}. They differ by less than "
        f"{1000 * SETTINGS.difference:.0f} mm, which can't be told apart."
    )


@styled
def comparison_figure(document: dict) -> Figure:
    """RMSE of every method on each axis, the best at the top; a logarithmic scale in m.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    ranked, by = ranking(document), document["scored_by"]
    figure = new_figure(1.6 + 0.27 * len(ranked))
    panels = figure.subplots(1, 3, sharey=True, sharex=True)
    values = np.maximum([row[by]["rmse"] for row in ranked], 1e-4)  # m, the left end at least
    places = np.arange(len(ranked))
    for axis, panel in enumerate(panels):
        column = values[:, axis]
        panel.hlines(places, 1e-9, column, color="#d3d8dc", linewidth=1.0, zorder=1)
        for place, row, value in zip(places, ranked, column, strict=True):
            color, mark, _ = KINDS[row["kind"]]
            panel.plot(value, place, mark, color=color, markersize=5.5, zorder=3)
        panel.axvline(column.min(), color=BLUE, linewidth=0.7, linestyle=":", zorder=2)
        panel.set_title(("East", "North", "Height")[axis])
        panel.set_xlim(values.min() / 1.6, values.max() * 1.6)
        _ticks_in_words(panel)
    panels[0].set_yticks(places, [row["name"] for row in ranked])
    panels[0].set_ylim(len(ranked) - 0.4, -0.6)
    figure.supxlabel("RMSE (logarithmic scale; dotted: the least on this axis)", fontsize=8.5)
    handles = [
        Line2D([], [], linestyle="none", marker=mark, color=color, label=words)
        for name, (color, mark, words) in KINDS.items()
        if any(row["kind"] == name for row in ranked)
    ]
    legend_above(figure, handles, columns=2)
    return figure


def _ticks_in_words(panel):
    """A logarithmic axis with ticks in words: 1 mm, 1 cm, 10 cm, 1 m."""

    def words(value, _):
        for unit, size in (("m", 1.0), ("cm", 0.01), ("mm", 0.001)):
            if value >= 0.999 * size:
                return f"{value / size:g} {unit}"
        return f"{1000 * value:g} mm"

    panel.set_xscale("log")
    low, high = panel.get_xlim()
    steps = (1, 2, 5) if high < 20 * low else (1, 3) if high < 1000 * low else (1,)
    panel.xaxis.set_major_locator(LogLocator(subs=steps, numticks=8))
    panel.xaxis.set_major_formatter(FuncFormatter(words))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
