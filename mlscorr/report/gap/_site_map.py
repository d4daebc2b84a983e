"""The map of a diagnosis: trajectory, targets, and each row coloured by its innovation."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mlscorr.report.gap._innovations import channel_style
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.gap.numbers import numbers
from mlscorr.report.maps import (
    NEXT,
    NEXT_WORDS,
    WORDS,
    corners,
    frame,
    map_panels,
    mark_places,
    write_names,
)
from mlscorr.report.style import GREY, MARKS, TRACK, legend_above, mark_handle, styled


@styled
def site_map(document: dict) -> Figure:
    """Plan with the rows coloured by innovation, before and after side by side.

    Parameters
    ----------
    document : dict
        The content of gap.json; or of plan.json, which has no rows yet.
    """
    site = document["map"]
    rows = site.get("rows") or []
    states = ("before", "after") if rows else (None,)
    places = [place[:2] for place in site["trajectory"]]
    places += [row["position"][:2] for row in (*site["targets"], *rows)]
    points = [numbers(place) for place in places] or [np.zeros(2), np.ones(2)]
    low, high = corners(np.array(points), 0.12)
    figure, panels = map_panels(len(states), np.clip((high - low)[1] / (high - low)[0], 0.25, 1.6))
    figure.set_dpi(180)
    for panel, state in zip(panels, states, strict=True):
        colours = _draw(panel, site, rows, state)
        names = {target["name"]: (target["position"][:2], 1) for target in site["targets"]}
        write_names(panel, names, (high - low)[0] / panel.get_position().width)
        frame(panel, low, high, 4)
        panel.tick_params(labelsize=7.5)
        panel.label_outer()
    if rows:
        bar = figure.colorbar(colours, ax=panels, shrink=0.8, pad=0.01, extend="both")
        bar.set_label("Innovation (sigma)")
    legend_above(figure, _legend(panels[0], site, rows))
    return figure


def _draw(panel, site, rows, state):
    """Draw one state; returns what the colours are of, if there are any."""
    track = np.array([numbers(place[:2]) for place in site["trajectory"]]).reshape(-1, 2)
    panel.plot(*_parted(track).T, **TRACK, zorder=1, label="Trajectory")
    colours = None
    limit = SETTINGS.map_sigmas
    for channel in dict.fromkeys(row["channel"] for row in rows):
        part = [row for row in rows if row["channel"] == channel]
        place = np.array([row["position"][:2] for row in part])
        values = [r[state] for r in part]
        values = numbers(values)
        is_target = channel == "target"
        front = np.argsort(np.abs(np.nan_to_num(values)), kind="stable")
        colours = panel.scatter(
            *place[front].T,
            26 if is_target else 9,
            values[front],
            vmin=-limit,
            vmax=limit,
            marker=channel_style(channel).mark,
            cmap="RdYlBu_r",
            rasterized=True,
            zorder=3,
            edgecolors="#444444" if is_target else "#999999",
            linewidths=0.5 if is_target else 0.15,
        )
    _draw_targets(panel, site["targets"])
    mark_places(panel, [place[:2] for place in site.get("next_control") or []])
    if state is not None:
        panel.set_title(state.capitalize())
    return colours


def _parted(track):
    """The track with NaN where it leaps, so that no line crosses from pass to pass."""
    step = np.hypot(*np.diff(track, axis=0).T)
    if (step > 0).any():
        usual = np.median(step[step > 0])
    else:
        usual = np.inf
    leaps = np.flatnonzero(step > SETTINGS.row_gap_steps * usual)
    return np.insert(track, leaps + 1, np.nan, axis=0)


def _draw_targets(panel, targets):
    for role, words in WORDS.items():
        places = [target["position"][:2] for target in targets if target["role"] == role]
        if places:
            symbol = MARKS[role] | {"markerfacecolor": "none", "markersize": 8}
            panel.plot(*np.array(places).T, linestyle="none", zorder=4, label=words, **symbol)


def _legend(panel, site, rows):
    handles = panel.get_legend_handles_labels()[0]
    handles += [Line2D([], [], label=NEXT_WORDS, **NEXT)] * bool(site.get("next_control"))
    kinds = map(channel_style, dict.fromkeys(row["channel"] for row in rows))
    return handles + [mark_handle(kind.mark, GREY, kind.words, size=4) for kind in kinds]
