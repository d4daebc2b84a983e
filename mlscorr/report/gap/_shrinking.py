"""How far the gap shrinks once the simulator has the cause, in words."""

from typing import NamedTuple

from mlscorr.effects import lowered, title
from mlscorr.wording import DASH, joined, known, percent, signed

GAPS = {  # by the kind of gap that a closure measures
    "systematic": "Systematic part of the gap (a mean over all rows)",
    "scatter": "Scatter beyond the stated one",
    "returns": "Returns beyond the expected ones",
}
NOTHING_TO_CLOSE = "Before, it was no larger than chance makes it: there is nothing to close."
AXES = {"E": "easting", "N": "northing", "H": "height"}


class Fact(NamedTuple):
    """A number beside the verdict: what it is, it, and more in words."""

    title: str
    number: str
    more: str = ""


def is_closed(document: dict) -> bool:
    """Whether anything was put into the simulator.

    Parameters
    ----------
    document : dict
        The content of gap.json.
    """
    closure = document["closure"]
    return closure["effect"] not in (None, "", "none") and known(closure["before"])


def is_within(
    value: float | None, band: list[float | None], kind: str | None = None, is_left: bool = False
) -> bool:
    """Whether a gap is what it may be when nothing is wrong; not, when one is not known.

    Parameters
    ----------
    value : float or None
    band : list of 2 floats or None
    kind : str, optional
        Of the gap: below the band more returns are lost than by chance, of others it is smaller.
    is_left : bool
        Whether it is what a cause in the simulator leaves: below the band, too much was put in.
    """
    is_known = all(map(known, [value, *band]))
    is_low = is_known and value < band[0]
    return is_known and value <= band[1] and not (is_low and (is_left or kind == "returns"))


def shrinking(document: dict) -> Fact:
    """How far the gap shrinks once the simulator has the cause.

    Parameters
    ----------
    document : dict
        The content of gap.json.
    """
    closure = document["closure"]
    gap = document["gap"]
    if not is_closed(document):
        before = signed(gap["before"], gap["unit"])
        more = f"When nothing is wrong: {span(gap)}."
        return Fact("The gap between survey and simulation", before, more)
    pair = " → ".join(signed(closure[when], closure["unit"]) for when in ("before", "after"))
    if document["verdict"]["label"] == "unknown":
        nearest = f"With the nearest known effect, {lowered(title(closure['effect']))},"
        return Fact(f"{nearest} in the simulator", pair, shrunk(closure))
    more = ""
    left = (closure["after"], closure["null_band"], closure.get("kind"))
    if not known(closure["shrink"]):
        more = ""
    elif is_within(*left, is_left=True):
        chance = " What is left is what chance leaves when nothing is wrong."
        more = "" if not_closed(closure) else chance
    elif is_within(*left):
        more = " Less is left than chance leaves: too much was put in."
    if closure["is_held_out"]:
        data = "held-out data"
    else:
        data = "the data in which it was found"
    part = f"{GAPS.get(closure.get('kind'), 'Gap')} on {data}"
    return Fact(f"{part}, before → after the simulator has it", pair, shrunk(closure) + more)


def shrunk(closure: dict) -> str:
    """By how much the squared gap shrinks, with its interval, in words.

    Errors that the simulator with the cause makes far smaller than they are stand first: their
    square may be a small part of the gap's.

    Parameters
    ----------
    closure : dict
        Of gap.json.
    """
    (low, high), share, between = closure["interval"], closure["shrink"], ""
    if not known(share):
        return not_closed(closure) + NOTHING_TO_CLOSE
    if known(low) and known(high):
        between = f" (95 %: {percent(low)} to {percent(high)})"
    text = f"{percent(share)} of the squared gap is gone{between}."
    if share >= 1:
        text = f"All of the squared gap is gone{between}."
    elif share < 0:
        text = f"The squared gap did not shrink, it grew{between}."
    return not_closed(closure) + text


def not_closed(closure: dict) -> str:
    """Along which axes errors are far beyond their simulated sigma with the cause; else nothing.

    Parameters
    ----------
    closure : dict
        Of gap.json.
    """
    errors = closure.get("over_sigma") or {"beyond": []}
    if not errors["beyond"]:
        return ""
    ratio = dict(zip(errors["axes"], errors["after"], strict=True))
    sizes = [f"{ratio[axis]:.1f} times in {AXES[axis]}" for axis in errors["beyond"]]
    return (
        f"Not closed: errors are still {joined(sizes)} the sigma that the simulator gives them. "
        "Of squares in mm: "
    )


def span(gap: dict) -> str:
    """What a gap is when nothing is wrong, in words.

    Parameters
    ----------
    gap : dict
        Of gap.json.
    """
    if not all(map(known, gap["null_band"])):
        return DASH
    return " to ".join(signed(end, gap["unit"]) for end in gap["null_band"])
