"""Quality gates: conditions on a report that make a command fail."""

import operator
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches

from mlscorr.evaluate.wording import GATES
from mlscorr.survey import Statement

OPERATORS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
AXES = {"e": "easting", "n": "northing", "h": "height"}
COUNTS = {
    "check.n": "number of observations of check points",
    "control.n": "number of observations of control points",
    "check.n_surveyed": "number of surveyed check points",
    "check.n_seen": "number of check points that were found",
    "check.n_scored": "number of check points used for the RMSE",
    "check.n_unseen": "number of check points that should have been found but were not",
    "control.n_surveyed": "number of surveyed control points",
    "control.n_seen": "number of control points that were found",
    "control.n_scored": "number of control points that were used",
    "control.n_unseen": "number of control points that should have been found but were not",
    "model.sigma0": "sigma0",
    "model.outliers": "number of rejected control points",
    "coverage.longest_gap_s": "longest time without control (s)",
    "coverage.points_outside_trajectory": "points outside the trajectory",
    "coverage.points_outside_control": "points outside the control span",
    "coverage.points_corrected": "corrected points",
    "coverage.points_untouched": "points that were not corrected",
    "coverage.points_noise": "points flagged as noise",
    "coverage.points_extrapolated": "points whose correction is extrapolated",
    "coverage.share_extrapolated": "share of the points whose correction is extrapolated (0 to 1)",
    "coverage.seconds_extrapolated": "time whose correction is extrapolated (s)",
    "coverage.metres_extrapolated": "distance whose correction is extrapolated (m)",
}
WEAK = {
    "weak.n": "number of extrapolated segments",
    "weak.sigma": "largest sigma of an extrapolated segment (m)",
    "weak.length_m": "longest extrapolated segment (m)",
}
GROUPS = {"check": "check points", "control": "control points", "leave_one_out": "left-out control"}


@dataclass(frozen=True)
class Gate:
    """Condition under which a result is not good enough.

    Parameters
    ----------
    quantity : str
        One of ``quantities()``.
    operator : str
        One of ``OPERATORS``.
    limit : float
        Lengths in m.
    """

    quantity: str
    operator: str
    limit: float


def read_gate(text: str) -> Gate:
    """Parse a gate such as ``check.rmse_h > 0.03`` (lengths in m).

    Raises
    ------
    ValueError
        If the form or the quantity is unknown; the message names the most similar one.

    >>> read_gate("check.rmse_3d > 0.05")
    Gate(quantity='check.rmse_3d', operator='>', limit=0.05)
    """
    match = re.fullmatch(r"\s*([\w.]+)\s*(>=|<=|>|<)\s*([-+.\deE]+)\s*", text)
    try:
        quantity, sign, limit = match.groups()
        gate = Gate(quantity, sign, float(limit))
    except (AttributeError, ValueError):
        raise ValueError(
            f"'{text}' is not a quality gate. Write QUANTITY > NUMBER (or <, >=, <=), for "
            'example "check.rmse_3d > 0.05".'
        ) from None
    known = quantities()
    if quantity not in known:
        near = get_close_matches(quantity, known, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"The quality gate '{text}' uses '{quantity}', which is not in the report. The "
            f"nearest quantity is '{near}'."
        )
    return gate


def quantities() -> dict[str, str]:
    """Names of all quantities available in gates, with their meanings."""
    named = COUNTS | WEAK
    for group, title in GROUPS.items():
        for statistic in ("rmse", "mean", "std", "min", "max"):
            for letter, axis in AXES.items():
                named[f"{group}.{statistic}_{letter}"] = f"{statistic} of {title} in {axis} (m)"
        for length, words in (("horizontal", "horizontal distance"), ("3d", "3D distance")):
            for statistic in ("rmse", "max"):
                named[f"{group}.{statistic}_{length}"] = f"{statistic} of {title}: {words} (m)"
    return named


def failures(gates: Iterable[Gate], report: dict) -> list[str]:
    """Return a sentence for each gate that a report fails.

    A quantity that was not determined fails every gate.

    Parameters
    ----------
    gates : iterable of Gate
    report : dict
        Contents of report.json.
    """
    return [failure.sentence(GATES) for failure in failed(gates, report)]


def failed(gates: Iterable[Gate], report: dict) -> Iterator[Statement]:
    """Yield the gates that a report fails, with their values, if any.

    Parameters
    ----------
    gates : iterable of Gate
    report : dict
        Contents of report.json.
    """
    for gate in gates:
        value = _value(gate.quantity, report)
        values = {**vars(gate), "what": quantities()[gate.quantity]}
        if value is None:
            yield Statement("not determined", "fault", values)
        elif OPERATORS[gate.operator](value, gate.limit):
            yield Statement("exceeded", "fault", {**values, "value": value})


def _value(quantity, report):
    """Value of a quantity in a report, or None."""
    group, name = quantity.split(".")
    if quantity == "model.outliers":
        return len(report["model"]["outliers"])
    if quantity in WEAK:
        rows = report["weak"]
        if name == "n":
            return len(rows)
        return max((row[name] for row in rows), default=0.0)
    if quantity in COUNTS:
        return report[group][name]
    left_out = group == "leave_one_out"
    if left_out:
        values = report["control"]["leave_one_out"]
    else:
        values = report[group]["after"]
    statistic, _, axis = name.partition("_")
    if axis not in AXES:
        return values.get(name)
    vector = values.get(statistic)
    if vector is None:
        return None
    return vector[list(AXES).index(axis)]
