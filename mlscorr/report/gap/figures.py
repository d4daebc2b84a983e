"""The figures of a diagnosis and of a plan by name: those that have something to show."""

from functools import partial

from mlscorr.report.gap._channels import channels_figure
from mlscorr.report.gap._innovations import innovations_figure
from mlscorr.report.gap._ladder import ladder, ladder_figure
from mlscorr.report.gap._rows import detectable_rows, worst_rows
from mlscorr.report.gap._separability import detectable_figure, heat_figure
from mlscorr.report.gap._shrinking import is_closed
from mlscorr.report.gap._site_map import site_map
from mlscorr.report.gap._splits import closure_figure, where_figure
from mlscorr.report.gap.accuracy import accuracy_figure
from mlscorr.report.style import Figures
from mlscorr.wording import known


def diagnosis_figures(document: dict) -> Figures:
    """Functions that draw the figures of a diagnosis, by name.

    Parameters
    ----------
    document : dict
        The content of gap.json; what was not determined is None.
    """
    figures = {
        "where": (where_figure, document["where"]),
        "innovations": (innovations_figure, document["innovations"]["gps_time"]),
        "evidence": (ladder_figure, ladder(document)),
        "closure": (closure_figure, is_closed(document)),
        "map": (site_map, document["map"]["trajectory"]),
        "channels": (channels_figure, any(c["tables"] for c in document.get("contrasts", ()))),
    }
    drawn = {name: partial(draw, document) for name, (draw, content) in figures.items() if content}
    return drawn | _separability(document["separability"])


def plan_figures(document: dict) -> Figures:
    """Functions that draw the figures of a plan, by name.

    Parameters
    ----------
    document : dict
        The content of plan.json.
    """
    figures = {}
    worst = worst_rows(detectable_rows(document["detectable"]))
    if any(known(row.ratio) for row in worst):
        figures["detectable"] = partial(detectable_figure, worst)
    if document.get("accuracy"):
        figures["accuracy"] = partial(accuracy_figure, document)
    if document["map"]["trajectory"]:
        figures["map"] = partial(site_map, document)
    return figures | _separability(document)


def _separability(document):
    is_matrix = len(document["correlation"]["names"]) > 1
    if is_matrix:
        return {"separability": partial(heat_figure, document)}
    return {}
