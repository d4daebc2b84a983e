"""Sentences on differences between the real and the simulated cloud in a channel."""

import numpy as np

from mlscorr.gap.contrast.tables import ContrastTable, Measure, with_sigma
from mlscorr.wording import percent, value_and_sigma

SILENT = {  # reasons why a channel is not compared
    "intensity": "Intensity is not compared: the simulator has no model of it. Give the "
    "simulator's clouds with --simulated.",
    "density": "Point density is not compared: the simulator has no cloud of its own. Give its "
    "clouds with --simulated.",
    "edge_width": "Beam width is not compared: the simulator assumes a thin beam. Give the "
    "simulator's clouds with --simulated.",
    "dropout": "Lost returns are not compared: the simulator has no effect dropout.",
    "pulses": "Lost returns can't be counted: the time stamps have no regular step, or there "
    "are no flat surfaces.",
    "edges": "Too few depth edges along scan lines to estimate the beam width.",
    "apart": "The two clouds hardly overlap.",
}
PLACES = {"range": ("range", " m"), "incidence": ("angle of incidence", "°")}


def sentence(
    measure: Measure, table: ContrastTable, sums: np.ndarray, is_further: bool = False
) -> str:
    """Sentence on the largest significant difference in a table, with its value; otherwise empty.

    Parameters
    ----------
    measure : Measure
        Measure of the table.
    table : ContrastTable
    sums : (b, bins, k) array
        Sums over blocks behind the table.
    is_further : bool
        True if a sentence on another table of the channel precedes it.
    """
    run = _largest_run(table)
    if run is None:
        return ""
    part = sums[:, run].sum(axis=1, keepdims=True)
    (value,), (sigma,), _ = with_sigma(part, measure.figure, measure.weights)
    (real,), (simulated,) = measure.sides(part.sum(axis=0))
    where = _where(table, run)
    if measure.channel == "intensity":
        if where == "everywhere":
            return ""
        return _intensity(table, value, sigma, where, is_further)
    if measure.channel == "density":
        return _density(value, sigma, where, is_further)
    if measure.channel == "dropout":
        lost = f"{value_and_sigma(100 * real, 100 * sigma)} % of the beams"
        return (
            f"{_opening(lost, is_further)} on flat surfaces give no return {where}, "
            f"{percent(simulated, 1)} in the simulation: the simulator "
            f"{'loses too few returns' if value > 0 else 'loses too many returns'}."
        )
    return (
        f"{_opening('depth edges', is_further)} are smeared over "
        f"{value_and_sigma(abs(value), sigma)} mrad {'more' if value > 0 else 'less'} than "
        f"simulated {where} ({real:.2g} versus {simulated:.2g} mrad): the simulator's beam is "
        f"{'too thin' if value > 0 else 'too wide'}."
    )


def _opening(subject, is_further):
    """Subject of a sentence, which may follow another one on the same channel."""
    if is_further:
        return f"In addition, {subject}"
    return subject.capitalize()


def _density(value, sigma, where, is_further):
    change = "more"
    hint = "loses too many returns there, or objects are missing in its scene"
    if value < 0:
        change = "fewer"
        hint = "loses too few returns there, or occluding objects are missing"
    change_in_percent = value_and_sigma(100 * abs(np.expm1(value)), 100 * sigma * np.exp(value))
    return (
        f"{_opening('the real cloud', is_further)} has {change_in_percent} % {change} points than "
        f"the simulated one {where}: the simulator {hint}."
    )


def _intensity(table, value, sigma, where, is_further):
    factor = np.exp(abs(value))
    known = np.flatnonzero(np.isfinite(table.value))
    if len(known) > 1:
        slope = np.polyfit(known, table.value[known], 1)[0]
    else:
        slope = value
    times = value_and_sigma(factor, factor * sigma)
    return (
        f"{_opening('real returns', is_further)} are {times} times "
        f"{'weaker' if value < 0 else 'stronger'} than simulated ones {where}, relative to their "
        f"usual ratio: the simulator{_lacks(table.by, slope < 0)}."
    )


def _lacks(by, falls):
    """Phrase on missing features of simulated intensities, if the real ones fall or rise with
    the bins.
    """
    if by == "reflectance":
        return f"'s materials differ too {'much' if falls else 'little'} in brightness"
    if by == "range":
        along = "with range"
    else:
        along = f"with the {PLACES[by][0]}"
    if falls:
        return f" has no decrease {along}"
    return f"'s intensity decreases too fast {along}"


def _largest_run(table):
    """Slice of adjacent bins with significant differences of one sign and the largest value; or
    None.
    """
    signs = np.where(table.differs, np.sign(np.nan_to_num(table.value)), 0)
    if not signs.any():
        return None
    peak = int(np.argmax(np.where(table.differs, np.abs(np.nan_to_num(table.value)), -1)))
    first = last = peak
    while first > 0 and signs[first - 1] == signs[peak]:
        first -= 1
    while last < len(signs) - 1 and signs[last + 1] == signs[peak]:
        last += 1
    return slice(first, last + 1)


def _where(table, run):
    """Range of a run of bins, in words."""
    if run == slice(0, len(table.bins)):
        return "everywhere"
    if table.edges is None:
        return f"from {' and '.join(table.bins[run])} surfaces"
    name, unit = PLACES[table.by]
    known = np.flatnonzero(np.isfinite(table.value))
    low = table.edges[run.start]
    high = table.edges[run.stop]
    is_first = run.start <= known[0]
    is_last = run.stop > known[-1]
    if is_first and is_last:
        return "everywhere"
    of = "" if table.by == "range" else f" {name}"
    if is_last:
        return f"beyond {low:g}{unit}{of}"
    if is_first:
        return f"within {high:g}{unit}{of}"
    return f"between {low:g} and {high:g}{unit}{of}"
