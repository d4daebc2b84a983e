"""The accuracy that a planned survey will reach along the drive."""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.gap._innovations import passes_of
from mlscorr.report.gap.numbers import numbers
from mlscorr.report.style import BLUE, GREY, VERMILLION, legend_above, new_figure, styled
from mlscorr.wording import length_in_words


def accuracy_sentence(accuracy: dict) -> str:
    """What a correction of the planned survey will reach.

    Parameters
    ----------
    accuracy : dict
        Of plan.json.
    """
    worst = int(np.argmax(accuracy["sigma"]))
    return (
        f"By what is believed of the POS, {len(set(accuracy['control_times']))} looks at control "
        f"points give the corrected position a 3D sigma of {length_in_words(accuracy['rms'])} "
        f"(RMS along the drive), at worst {length_in_words(accuracy['largest'])} at "
        f"{accuracy['gps_time'][worst]:.1f} s."
    )


@styled
def accuracy_figure(document: dict) -> Figure:
    """Sigma of the corrected position over time, each pass in a panel of its own.

    Parameters
    ----------
    document : dict
        The content of plan.json.
    """
    accuracy = document["accuracy"]
    time = numbers(accuracy["gps_time"])
    sigma = 100 * numbers(accuracy["sigma"])
    control = numbers(accuracy["control_times"])
    places = numbers(place["gps_time"] for place in document["next_control"])
    passes = passes_of(time)
    # Times at an end of a pass may lie beyond its last sigma, and belong to the nearer pass
    between = (passes[:-1, 1] + passes[1:, 0]) / 2
    width = np.maximum(np.diff(passes)[:, 0], 0.12 * np.diff(passes).max())
    figure = new_figure(2.6)
    panels = figure.subplots(1, len(passes), sharey=True, squeeze=False, width_ratios=width)[0]
    for number, (panel, start) in enumerate(zip(panels, passes[:, 0], strict=True)):
        inside = np.searchsorted(between, time) == number
        panel.plot(time[inside] - start, sigma[inside], color=BLUE, label="Corrected position, 3D")
        for times, color, mark, words in (
            (control, GREY, "|", "A control point is seen"),
            (places, VERMILLION, "*", "The next one would help most"),
        ):
            there = times[np.searchsorted(between, times) == number] - start
            panel.plot(there, np.zeros(len(there)), mark, color=color, markersize=8, label=words)
        panel.set_xlabel(f"Pass {number + 1}: s after {start:.0f}")
    panels[0].set_ylim(bottom=-0.04 * sigma.max())  # of all, after all: it ends their scaling
    panels[0].set_ylabel("Sigma (cm)")
    legend_above(figure, panels[0].get_legend_handles_labels()[0])
    return figure
