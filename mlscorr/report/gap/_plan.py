"""Expected results of a planned survey: accuracy along the drive, and smallest detectable
errors.
"""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.gap._innovations import passes_of
from mlscorr.report.gap._rows import DetectableRow, numbers
from mlscorr.report.style import (
    BLUE,
    GREY,
    VERMILLION,
    legend_above,
    mark_handle,
    new_figure,
    styled,
)
from mlscorr.wording import known, length_in_words


def accuracy_sentence(accuracy: dict) -> str:
    """Sentence on the expected accuracy of a correction of the planned survey.

    Parameters
    ----------
    accuracy : dict
        Section of plan.json.
    """
    worst = int(np.argmax(accuracy["sigma"]))
    return (
        f"With the assumed accuracy of the POS, {len(set(accuracy['control_times']))} "
        "observations of control points give a 3D sigma of the corrected position of "
        f"{length_in_words(accuracy['rms'])} (RMS along the drive). The largest is "
        f"{length_in_words(accuracy['largest'])} at {accuracy['gps_time'][worst]:.1f} s."
    )


@styled
def accuracy_figure(document: dict) -> Figure:
    """Draw the sigma of the corrected position over time, with one panel per pass.

    Parameters
    ----------
    document : dict
        Contents of plan.json.
    """
    accuracy = document["accuracy"]
    time = numbers(accuracy["gps_time"])
    sigma = 100 * numbers(accuracy["sigma"])
    control = numbers(accuracy["control_times"])
    places = numbers(place["gps_time"] for place in document["next_control"])
    passes = passes_of(time)
    # Times at an end of a pass may be after its last sigma, and belong to the nearer pass
    between = (passes[:-1, 1] + passes[1:, 0]) / 2
    width = np.maximum(np.diff(passes)[:, 0], 0.12 * np.diff(passes).max())
    figure = new_figure(2.6)
    panels = figure.subplots(1, len(passes), sharey=True, squeeze=False, width_ratios=width)[0]
    for number, (panel, start) in enumerate(zip(panels, passes[:, 0], strict=True)):
        inside = np.searchsorted(between, time) == number
        panel.plot(time[inside] - start, sigma[inside], color=BLUE, label="Corrected position, 3D")
        for times, color, mark, words in (
            (control, GREY, "|", "Control point observed"),
            (places, VERMILLION, "*", "Best position for the next control point"),
        ):
            there = times[np.searchsorted(between, times) == number] - start
            panel.plot(there, np.zeros(len(there)), mark, color=color, markersize=8, label=words)
        panel.set_xlabel(f"Pass {number + 1}: s after {start:.0f}")
    panels[0].set_ylim(bottom=-0.04 * sigma.max())  # last, because it ends autoscaling
    panels[0].set_ylabel("Sigma (cm)")
    legend_above(figure, panels[0].get_legend_handles_labels()[0])
    return figure


@styled
def detectable_figure(rows: list[DetectableRow]) -> Figure:
    """Draw the smallest detectable size over the usual size; below one, the effect is visible.

    Parameters
    ----------
    rows : list of DetectableRow
        Sorted by visibility; rows without a ratio are omitted.
    """
    rows = [row for row in rows if known(row.ratio)]
    ratio = np.array([row.ratio for row in rows])
    figure = new_figure(1.0 + 0.2 * len(rows))
    panel = figure.add_subplot()
    low = min(0.5, ratio.min() / 1.6)
    high = max(2.0, ratio.max() * 1.6)
    panel.axvspan(low, 1.0, color="#e6f1f8", zorder=0)
    marks = (
        ("o", BLUE, "Shows at its usual size"),
        ("X", VERMILLION, "Only larger errors detectable"),
    )
    for place, value in enumerate(ratio):
        mark, color, _ = marks[int(value > 1)]
        panel.plot([1.0, value], [place] * 2, color="#b8bfc5", linewidth=1.2, zorder=1)
        panel.plot(value, place, mark, color=color, zorder=3)
    panel.axvline(1.0, color="black", linewidth=0.9, zorder=2)
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_yticks(range(len(rows)), [row.title for row in rows])
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Smallest detectable size over the usual size (logarithmic)")
    legend_above(figure, [mark_handle(*mark) for mark in marks])
    return figure
