"""Quality gates: conditions on a report that make a command fail."""

import operator
import re
from dataclasses import dataclass
from difflib import get_close_matches

OPERATORS = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
AXES = {"e": (0, "easting"), "n": (1, "northing"), "h": (2, "height")}
COUNTS = {
    "check.n": "number of observed check points",
    "control.n": "number of observed control points",
    "model.sigma0": "sigma0",
    "model.outliers": "number of rejected control points",
    "coverage.longest_gap_s": "longest time without control (s)",
    "coverage.points_outside_trajectory": "points outside the trajectory",
    "coverage.points_outside_control": "points outside the control span",
}
GROUPS = {"check": "check points", "control": "control points", "leave_one_out": "left-out control"}


@dataclass(frozen=True)
class Gate:
    """A condition under which a result is not good enough: quantity, operator, limit."""

    quantity: str
    operator: str
    limit: float


def read_gate(text):
    """The gate that a sentence such as ``check.rmse_h > 0.03`` states (lengths in m).

    Raises ValueError for another form or an unknown quantity, naming the nearest known one.

    >>> read_gate("check.rmse_3d > 0.05")
    Gate(quantity='check.rmse_3d', operator='>', limit=0.05)
    """
    match = re.fullmatch(r"\s*([\w.]+)\s*(>=|<=|>|<)\s*(\S+)\s*", text)
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
            f"The quality gate '{text}' asks for '{quantity}', which the report doesn't have. "
            f"The nearest it has is '{near}'."
        )
    return gate


def quantities():
    """Names of all quantities that a gate can ask for, with what they are."""
    named = dict(COUNTS)
    for group, title in GROUPS.items():
        for statistic in ("rmse", "mean", "std", "min", "max"):
            for letter, (_, axis) in AXES.items():
                named[f"{group}.{statistic}_{letter}"] = f"{statistic} of {title} in {axis} (m)"
        for length, words in (("horizontal", "horizontal distance"), ("3d", "3D distance")):
            for statistic in ("rmse", "max"):
                named[f"{group}.{statistic}_{length}"] = f"{statistic} of {title}: {words} (m)"
    return named


def failures(gates, report):
    """A sentence for each gate that a report (the content of report.json) fails.

    A quantity that was not determined fails every gate: what isn't known isn't good enough.
    """
    sentences = []
    for gate in gates:
        what = quantities()[gate.quantity]
        found = _value(gate.quantity, report)
        if found is None:
            sentences.append(f"{gate.quantity}: {what} was not determined.")
        elif OPERATORS[gate.operator](found, gate.limit):
            sentences.append(
                f"{gate.quantity}: {what} is {found:.4g} {gate.operator} {gate.limit:g}."
            )
    return sentences


def _value(quantity, report):
    """The number that a report holds for a quantity, or None."""
    group, name = quantity.split(".")
    if quantity == "model.outliers":
        return len(report["model"]["outliers"])
    if quantity in COUNTS:
        return report[group][name]
    if group == "leave_one_out":
        values = report["control"]["leave_one_out"]
    else:
        values = report[group]["after"]
    statistic, _, axis = name.partition("_")
    if axis not in AXES:
        return values.get(name)
    found = values.get(statistic)
    return None if found is None else found[AXES[axis][0]]
